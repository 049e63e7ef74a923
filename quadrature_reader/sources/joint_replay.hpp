// SPDX-License-Identifier: Apache-2.0
//
// One joint of a recording, row by row, as readings. What the rows say is missing becomes a loss:
// lines that change both at once, counts beside them that go on by more than the lines show, counts
// that no joint reaches, raw counters that wrap.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "quadrature_reader/axis.hpp"
#include "quadrature_reader/reading.hpp"
#include "quadrature_reader/sources/count_follower.hpp"

namespace ravencal::quadrature_reader {

/// Levels of the lines A | B << 1 | Z << 2, with the count beside them where the recording has it.
class LinesReplay {
 public:
  LinesReplay(std::uint8_t axis, const CountLimit& limit)
      : axis_(axis), max_counts_per_s_(limit.counts_per_s) {}
  /// NaN levels are a loss; a NaN count is none.
  void take(std::int64_t t_ns, double levels, double count, std::vector<Reading>& out);

 private:
  /// What is missing before a row; nullopt if nothing is.
  [[nodiscard]] std::optional<Reading> missing_at(std::int64_t t_ns, std::int64_t levels,
                                                  std::optional<std::int64_t> count) const;
  /// How far both lines went that changed at once, signed; 0: nothing tells.
  [[nodiscard]] std::int64_t movement_by_pace(std::int64_t t_ns) const;
  void put_edges(std::int64_t t_ns, std::int64_t levels, std::vector<Reading>& out);
  void begin_pace(std::int64_t t_ns) { edges_t_ns_ = {t_ns}; }

  std::uint8_t axis_;
  double max_counts_per_s_;
  std::optional<std::int64_t> levels_;
  std::optional<std::int64_t> count_;
  std::vector<std::int64_t> edges_t_ns_;  // the last ones without a turn; never empty once begun
  std::int64_t direction_ = 0;
};

/// Counts of a device that counts by itself.
class CountsReplay {
 public:
  /// `counts`: the joint's whole column; a limit that nobody said gives way to its steady speed.
  CountsReplay(std::uint8_t axis, const CountLimit& limit, std::span<const std::int64_t> t_ns,
               std::span<const double> counts);
  /// NaN is a loss.
  void take(std::int64_t t_ns, double count, std::vector<Reading>& out);

 private:
  struct Counted {
    std::int64_t t_ns = 0;
    std::int64_t count = 0;
  };
  /// What to add to a count that is `step` away from the last one; 0: it has not wrapped.
  [[nodiscard]] std::int64_t unwrapping(std::int64_t step, std::int64_t dt_ns) const;

  std::uint8_t axis_;
  double max_counts_per_s_;
  double range_counts_ = 0.0;  // of the whole column
  std::int64_t unwrapped_counts_ = 0;
  CountFollower follower_;
  bool lost_ = false;
  std::optional<Counted> believed_;  // the last one, unwrapped
  std::optional<std::int64_t> delivered_;
};

}  // namespace ravencal::quadrature_reader
