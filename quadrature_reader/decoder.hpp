// SPDX-License-Identifier: Apache-2.0
//
// x4 quadrature decoding of edges: every edge of A and B is one count, its sign follows from the
// level of the other line. Forward is A before B: (A,B) = 00 10 11 01 00.
//
// What A and B alone show of lost edges:
//  - one lost or repeated edge shows at the next edge of the same line, which then has the
//    polarity that the line already had; at a steady speed the true count follows too;
//  - an even number of lost edges on each line leaves consistent levels. Nothing in A and B shows
//    it: the count is wrong by a multiple of 4. The kernel's sequence numbers (libgpiod 2), a full
//    event queue (libgpiod 1) or the index pulse find it; on_lost() takes the first two.
// The count never resets and is always congruent, modulo 4, with the levels. Not thread-safe; no
// allocation.
#pragma once

#include <cstdint>
#include <optional>

#include "quadrature_reader/reading.hpp"

namespace ravencal::quadrature_reader {

/// From one pair of levels (A | B << 1) to another in counts: -1, 0, 1, or 2 where both changed,
/// which no single edge does.
int phase_step(std::int64_t from_levels, std::int64_t to_levels);

/// What one call changed.
struct DecoderStep {
  std::int64_t delta_counts = 0;
  enum class Kind : std::uint8_t {
    kNone,      ///< no movement: levels confirmed, or not yet enough known
    kStep,      ///< one edge, one count
    kRepeated,  ///< an edge to the level that the line already had: doubled, or its partner lost
    kRepaired,  ///< as kRepeated, but the edges in between tell the count of a steady motion
    kResync,    ///< levels known again after a loss; `delta_counts` is the best estimate
  } kind = Kind::kNone;
};

class QuadratureDecoder {
 public:
  /// Largest error that the count may have. kUnbounded once an unknown number of edges was lost.
  static constexpr std::int64_t kUnbounded = INT64_MAX;

  /// An edge of A or B to `level`.
  DecoderStep on_edge(Line line, bool level);

  /// Both lines were read while no edge was pending.
  DecoderStep on_levels(bool a, bool b);

  /// Edges are missing here: `edges` of them, or 0 if nobody counted. The count goes on at the
  /// next call that settles both levels.
  void on_lost(std::int64_t edges);

  /// Edges are missing here, but the movement is known to within `uncertainty` counts.
  void on_unseen(std::int64_t movement_counts, std::int64_t uncertainty);

  /// Declares the present count right, e.g. after an index pulse or homing.
  void trust() { uncertainty_counts_ = 0; }

  [[nodiscard]] std::int64_t count() const { return count_; }
  /// Bound of |count - true count| since the last trust(), given single faults.
  [[nodiscard]] std::int64_t uncertainty_counts() const { return uncertainty_counts_; }
  [[nodiscard]] bool levels_known() const { return known_[0] && known_[1]; }
  /// -1, 0 or 1: direction of the last counted edge.
  [[nodiscard]] int direction() const { return direction_; }

 private:
  DecoderStep repeated_edge(int line);
  DecoderStep settle(int last_line);
  void add_uncertainty(std::int64_t counts);

  std::int64_t count_ = 0;
  std::int64_t uncertainty_counts_ = 0;
  std::int64_t lost_edges_ = 0;  // exact number in the open gap; meaningless if lost_unknown_
  std::optional<std::int64_t> unseen_counts_;  // on_unseen() said how far the open gap moved
  bool gap_open_ = false;                      // on_lost() was called, levels not settled since
  bool lost_unknown_ = false;
  bool started_ = false;  // levels were settled once
  bool known_[2] = {false, false};
  bool level_[2] = {false, false};
  bool after_gap_[2] = {false, false};  // each line's level right after the gap
  int phase_before_gap_ = 0;
  int direction_ = 0;
  int other_edges_[2] = {0, 0};  // edges of the other line since this line's last edge
};

}  // namespace ravencal::quadrature_reader
