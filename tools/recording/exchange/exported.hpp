// SPDX-License-Identifier: Apache-2.0
//
// What the readers of ravencal's own exports have in common. Private to exchange/.
#pragma once

#include <filesystem>
#include <string>

#include "core/result.hpp"
#include "record/recording.hpp"

namespace ravencal::exchange {

/// A channel as an export names it, in the SI unit that values are to be in. Errors name the word.
core::Result<record::Channel> exported_channel(std::string name, const std::string& unit,
                                               const std::string& role, std::string joint);

/// Holds the invariants of a recording, or says what is wrong with it.
core::Result<record::Recording> checked(record::Recording recording,
                                        const std::filesystem::path& path);

}  // namespace ravencal::exchange
