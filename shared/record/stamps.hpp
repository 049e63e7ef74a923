// SPDX-License-Identifier: Apache-2.0
//
// How the fields of a row say its time: numbers of a unit, seconds with a fraction beside them,
// dates, counters that start again. Pure functions, any thread.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace ravencal::record {

inline constexpr double kNsPerS = 1e9;

/// The clock of a source, as its profile states it.
struct Clock {
  std::string unit = "s";            ///< s, ms, us, ns; "date": ISO 8601; "clock": hh:mm:ss
  std::string fraction_unit = "ns";  ///< of the second column of the time, where there is one
  double wraps_at = 0.0;             ///< starts again at 0 there, in `unit`; 0: never
  double rounded_to = 0.0;           ///< stamps are multiples of that, in `unit`; 0: they are exact
  bool drops_bad = false;  ///< rows whose stamp is missing or runs backwards leave with an event
};

/// True for the units that are words: "date" and "clock".
bool is_written_out(std::string_view unit);

/// "2025-03-30 01:59:50.005", "2025-03-30T01:59:50Z" and "+02:00" in ns since 1970, or
/// "01:59:50.005" in ns since midnight. Nothing for other text.
std::optional<std::int64_t> ns_of_text(std::string_view unit, std::string_view text);

using Stamps = std::vector<std::optional<std::int64_t>>;

/// What the fields of the rows say, a value a row; those that are not used are empty.
struct StampFields {
  std::span<const double> numbers;
  std::span<const double> fractions;
  std::span<const std::string> words;
};

/// ns of each row, counted on over the starts from 0; nothing where a field says no time or one
/// beyond the range.
Stamps stamps_of(const Clock& clock, const StampFields& fields);

/// The largest part of the rows in which no stamp runs backwards: true for its rows.
std::vector<bool> longest_rising(const Stamps& stamps);

/// Puts rounded stamps (never falling) on the straight line of their rate, from gap to gap, where
/// no stamp is further from it than one step; else equal ones are spread up to the next.
void spread_rounded(std::span<std::int64_t> t_ns, std::int64_t step_ns);

}  // namespace ravencal::record
