// SPDX-License-Identifier: Apache-2.0
//
// How far the operator moved the desired joints in one cycle with the pedal down: the correction
// may move by a share of it (envelope.hpp), and its offset may shrink by a share (transfer.hpp).
// Real-time thread only.
#pragma once

#include <cmath>
#include <cstddef>
#include <limits>

#include "ravencal/plugin.h"
#include "rt_plugin/guards.hpp"
#include "rt_plugin/joint_vector.hpp"

namespace ravencal::rt {

class CommandedMotion {
 public:
  /// End of a cycle. `published` has its desired joints without `correction_ji`, which was applied
  /// in that cycle: a correction that changes is no command.
  void see(const ravencal_state& published, const JointVector& correction_ji) noexcept {
    const bool follows = StateGuards::motors_follow(published);
    for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
      const float desired_ji = published.arm[0].jpos_d_ji[j] + correction_ji[j];
      const float moved_ji = std::fabs(desired_ji - desired_ji_[j]);
      // A desired joint that is not finite, or that only rounding changed, did not move.
      const bool moved =
          moved_ji > kRounding * std::fabs(desired_ji) && moved_ji - moved_ji == 0.0F;
      moved_ji_[j] = follows && follows_ && moved ? moved_ji : 0.0F;
      desired_ji_[j] = desired_ji;
    }
    follows_ = follows;
  }

  /// Per joint, >= 0; zero across a change of the pedal.
  [[nodiscard]] const JointVector& moved_ji() const noexcept { return moved_ji_; }

 private:
  /// Adding the correction that the host took out rounds twice, in either cycle.
  static constexpr float kRounding = 4.0F * std::numeric_limits<float>::epsilon();

  JointVector desired_ji_{};
  JointVector moved_ji_{};
  bool follows_ = false;
};

}  // namespace ravencal::rt
