// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "conversion/foreign_model.hpp"
#include "fuzz/inputs.hpp"

namespace ravencal::fuzz {

/// The chain of layers fits together, and the file itself runs on inputs of that width.
void promise_chain(const conversion::ForeignModel& model);

}  // namespace ravencal::fuzz
