// SPDX-License-Identifier: Apache-2.0
//
// What an error says of a word that is none of those that exist.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace ravencal::core {

/// The word of `known` that was most likely meant: one that `word` begins with, or the one that the
/// fewest changed letters make of it. None if all are too far.
std::optional<std::string> likely_meant(std::string_view word,
                                        const std::vector<std::string>& known);

/// "; did you mean 'mm'? known: m, mm, ...", for the end of an error.
std::string instead_of(std::string_view word, const std::vector<std::string>& known);

}  // namespace ravencal::core
