// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "diagnose/findings/findings.hpp"

namespace ravencal::diagnose {

/// Fills the report's verdict from its findings and notes. Adds the effect `unknown` where
/// something real has no name.
void decide(Report& report);

/// A number with its unit for people: degrees and millimetres instead of rad and m, "N m/rad"
/// instead of N_m_per_rad.
std::string quantity(double value, const std::string& unit);

}  // namespace ravencal::diagnose
