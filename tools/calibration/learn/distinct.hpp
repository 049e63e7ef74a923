// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>

#include "core/result.hpp"

namespace ravencal::learn {

/// Whether every file is another one, by content: a recording that counts twice, or that both
/// trains and validates, misleads. Errors: kUsage; kIo.
core::Status check_distinct(std::span<const std::string> training,
                            std::span<const std::string> validation);

}  // namespace ravencal::learn
