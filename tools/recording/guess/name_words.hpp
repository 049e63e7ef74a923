// SPDX-License-Identifier: Apache-2.0
//
// The words of a name: how columns, joints and topics are split, and what each word says.
// Private to guess/.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "guess/column_name.hpp"

namespace ravencal::guess {

/// Separators are what is neither letter nor digit, a change to upper case, and a change between
/// letters and digits. Words keep their case.
std::vector<std::string> words_of(std::string_view name);
std::string lower(std::string_view text);
bool is_number(std::string_view word);

struct Word {
  std::string_view text;  ///< lower case; two words with a space between are a pair
  std::optional<Quantity> quantity;
  std::optional<Side> side;
};
/// What a word or a pair of words says; nullptr: nothing that is known.
const Word* find_word(std::string_view text);

/// True for words that stand in names of joints and tell none: "joint", "axis", "data".
bool names_no_joint(std::string_view word);

struct UnitWord {
  std::string_view unit;  ///< of core/units.hpp; empty: the name has none
  double scale = 1.0;     ///< `unit` per unit of the file
};
/// Takes the longest spelling of a unit off the end; a name of one word is a unit only where it is
/// a word of time.
UnitWord take_unit(std::vector<std::string>& words);

}  // namespace ravencal::guess
