// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "model/origin.hpp"

namespace ravencal::model {

/// Object with `arm`, `robot`, `controller`, `coordinates`, all texts.
nlohmann::ordered_json origin_json(const Origin& origin);

}  // namespace ravencal::model
