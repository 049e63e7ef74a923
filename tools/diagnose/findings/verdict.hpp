// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "diagnose/findings/findings.hpp"

namespace ravencal::diagnose {

/// Fills the report's verdict from its findings; `notes` are sentences to add. Adds the effect
/// `unknown` where something real has no name.
void decide(Report& report, const std::vector<std::string>& notes);

/// A number with its unit for people: degrees and millimetres instead of rad and m, "N m/rad"
/// instead of N_m_per_rad.
std::string quantity(double value, const std::string& unit);

}  // namespace ravencal::diagnose
