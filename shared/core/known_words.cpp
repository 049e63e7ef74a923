// SPDX-License-Identifier: Apache-2.0
#include "core/known_words.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <numeric>

namespace ravencal::core {
namespace {

/// A word with more than a third of its letters changed is another word. No source: a choice.
constexpr std::size_t kLettersPerMistake = 3;

char lower(char c) { return static_cast<char>(std::tolower(static_cast<unsigned char>(c))); }

/// Letters to insert, drop or replace (Levenshtein, 1966); a capital is no mistake.
std::size_t mistakes(std::string_view one, std::string_view other) {
  std::vector<std::size_t> row(other.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < one.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i + 1;
    for (std::size_t k = 0; k < other.size(); ++k) {
      const std::size_t replaced = diagonal + (lower(one[i]) == lower(other[k]) ? 0U : 1U);
      diagonal = row[k + 1];
      row[k + 1] = std::min({replaced, row[k] + 1, diagonal + 1});
    }
  }
  return row.back();
}

}  // namespace

std::optional<std::string> likely_meant(std::string_view word,
                                        const std::vector<std::string>& known) {
  const std::string* best = nullptr;
  std::size_t fewest = word.size() / kLettersPerMistake + 1;
  for (const std::string& candidate : known) {
    const std::size_t count = mistakes(word, candidate);
    if (count >= fewest) continue;
    fewest = count;
    best = &candidate;
  }
  if (best != nullptr) return *best;
  for (const std::string& candidate : known) {
    const bool begins = word.starts_with(candidate + "_");
    if (begins && (best == nullptr || candidate.size() > best->size())) best = &candidate;
  }
  return best != nullptr ? std::optional(*best) : std::nullopt;
}

std::string instead_of(std::string_view word, const std::vector<std::string>& known) {
  const auto meant = likely_meant(word, known);
  return fmt::format("; {}known: {}", meant ? fmt::format("did you mean '{}'? ", *meant) : "",
                     fmt::join(known, ", "));
}

}  // namespace ravencal::core
