// SPDX-License-Identifier: Apache-2.0
//
// How far the operator moved the desired joints in one cycle with the pedal down: the correction
// may move by a share of it (envelope.hpp). And how far that went beyond going to and fro: by a
// share of this an offset may shrink (transfer.hpp), which a trembling hand does not ask for.
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
  /// A desired joint travels once it has left a band of this half width, which it drags along: a
  /// tremor of 0.2 mm at the tip, 5 cm from the remote centre and farther, and a quarter more.
  static constexpr JointVector kTremorJi = {5e-3F, 5e-3F, 2.5e-4F};

  /// End of a cycle. `published` has its desired joints without `correction_ji`, which was applied
  /// in that cycle: a correction that changes is no command.
  void update(const ravencal_state& published, const JointVector& correction_ji) noexcept {
    const bool follows = StateGuards::motors_follow(published);
    for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
      const float desired_ji = published.arm[0].jpos_d_ji[j] + correction_ji[j];
      const float moved_ji = std::fabs(desired_ji - desired_ji_[j]);
      // A desired joint that is not finite, or that only rounding changed, did not move.
      const bool moved =
          moved_ji > kRounding * std::fabs(desired_ji) && moved_ji - moved_ji == 0.0F;
      moved_ji_[j] = follows && follows_ && moved ? moved_ji : 0.0F;
      drag(j, desired_ji, follows && follows_);
      desired_ji_[j] = desired_ji;
    }
    follows_ = follows;
  }

  /// Per joint, >= 0; zero across a change of the pedal.
  [[nodiscard]] const JointVector& moved_ji() const noexcept { return moved_ji_; }
  [[nodiscard]] const JointVector& travelled_ji() const noexcept { return travelled_ji_; }

 private:
  /// Adding the correction that the host took out rounds twice, in either cycle.
  static constexpr float kRounding = 4.0F * std::numeric_limits<float>::epsilon();

  void drag(std::size_t j, float desired_ji, bool goes_on) noexcept {
    const float centre_ji = centre_ji_[j];
    const float low_ji = desired_ji - kTremorJi[j];
    const float high_ji = desired_ji + kTremorJi[j];
    const float dragged_ji = centre_ji < low_ji    ? low_ji
                             : centre_ji > high_ji ? high_ji
                                                   : centre_ji;
    const float travelled_ji = std::fabs(dragged_ji - centre_ji);
    const bool counts = goes_on && travelled_ji - travelled_ji == 0.0F;
    travelled_ji_[j] = counts ? travelled_ji : 0.0F;
    centre_ji_[j] = counts ? dragged_ji : desired_ji;
  }

  JointVector desired_ji_{};
  JointVector centre_ji_{};  ///< of the band of each desired joint
  JointVector travelled_ji_{};
  JointVector moved_ji_{};
  bool follows_ = false;
};

}  // namespace ravencal::rt
