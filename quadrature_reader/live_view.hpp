// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "quadrature_reader/logger.hpp"

namespace ravencal::quadrature_reader {

/// The status as a table for people: one line per joint in degrees or millimetres, one for the
/// rest.
std::string table_of(const LoggerStatus& status);

/// The status as one line of JSON in SI units, without newline.
std::string json_of(const LoggerStatus& status);

/// What rows lack whose joints have no zero, and how they get one; one sentence.
std::string advice_on_zeros(const std::vector<std::string>& joints);

/// Which joints lost data how often, in one sentence; empty if none did.
std::string losses_in(const LoggerStatus& status);

}  // namespace ravencal::quadrature_reader
