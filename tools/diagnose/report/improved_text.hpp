// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "diagnose/findings/findings.hpp"

namespace ravencal::diagnose {

/// The improved plant as a file's text, which parse_plant reads if the plant that was diagnosed
/// could be read. Findings that no plant can hold stand in comments at its end.
std::string improved_text(const Report& report);

}  // namespace ravencal::diagnose
