// SPDX-License-Identifier: Apache-2.0
//
// Desired motion of each joint: trapezoidal moves between random corners. SI units.
#pragma once

#include <string_view>
#include <vector>

#include "prove/generator/random.hpp"

namespace ravencal::prove {

enum class MotionKind {
  kSlow,    ///< a zig-zag through the workspace, no holds, one speed range
  kRich,    ///< holds, nested reversals, a tenth to several times the speed
  kFast,    ///< between random corners at three to eight times the speed
  kOneWay,  ///< moves and holds that never turn
};
std::string_view word_of(MotionKind kind);
/// Speeds differ by much and include fast ones.
inline bool is_rich(MotionKind kind) {
  return kind == MotionKind::kRich || kind == MotionKind::kFast;
}

struct MotionRange {
  double low = 0.0, high = 1.0;
  double slowest = 0.02, fastest = 0.06;  ///< of the slow zig-zag
};

class Path {
 public:
  /// At least `duration_s` long.
  Path(const MotionRange& range, MotionKind kind, double duration_s, Random random);
  [[nodiscard]] double at(double t_s) const;

 private:
  /// From `from` to `to` within [begin, begin + length], speeding up and down for `ramp`.
  struct Move {
    double begin_s, length_s, ramp_s, from, to;
  };
  void add(double to, double speed, double ramp_s);
  void go_one_way(const MotionRange& range, double duration_s, bool up, Random& random);
  std::vector<Move> moves_;
};

}  // namespace ravencal::prove
