// SPDX-License-Identifier: Apache-2.0
//
// The encoder itself: edges that a quadrature encoder of given resolution puts out for a motion.
// The digital twin's truth and the tests go through it, so that the decoder's path is the real one.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "quadrature_reader/reading.hpp"

namespace ravencal::quadrature_reader {

struct EncodeSettings {
  double counts_per_unit = 1.0;   ///< counts (after x4) per unit of position, > 0
  std::int64_t index_counts = 0;  ///< counts between index pulses; 0: no index line
  std::uint8_t axis = 0;
};

/// The same encoder, for a motion that comes bit by bit.
class MotionEncoder {
 public:
  explicit MotionEncoder(const EncodeSettings& settings) : settings_(settings) {}

  /// Moves linearly to `position` at `t_ns`, which rises; appends the edges of the way in time
  /// order. The first call appends the levels instead.
  void move_to(std::int64_t t_ns, double position, std::vector<Reading>& out);

  /// Count after the last edge, as a counter that was never reset.
  [[nodiscard]] std::int64_t count() const { return count_; }

 private:
  void step_to(std::int64_t t_ns, std::int64_t count, std::vector<Reading>& out);
  [[nodiscard]] bool level_z(std::int64_t count) const;

  EncodeSettings settings_;
  bool started_ = false;
  std::int64_t count_ = 0;
  std::int64_t last_t_ns_ = 0;
  double last_counts_ = 0.0;  // exact position, in counts
};

/// Edges of the motion given by `position` at the strictly increasing instants `t_ns` (same
/// length), linear in between. Starts with the levels (kLevels) at t_ns[0]. The count is
/// round(position * counts_per_unit), so the boundary between n and n + 1 lies at n + 1/2; the
/// index is high while count modulo index_counts is 0. Result in time order.
std::vector<Reading> encode_motion(std::span<const std::int64_t> t_ns,
                                   std::span<const double> position,
                                   const EncodeSettings& settings);

}  // namespace ravencal::quadrature_reader
