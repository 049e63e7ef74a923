// SPDX-License-Identifier: Apache-2.0
//
// The correction of joints 1 to 3, and the only two ways to change it: what the state of the
// envelope allows, and taking a part of it away. Real-time thread only.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "rt_plugin/joint_vector.hpp"

namespace ravencal::rt {

/// What may become of the correction in a cycle.
enum class Allowed {
  kNone,    ///< there is none
  kStay,    ///< not at all
  kShrink,  ///< towards the target, as far as that lies between it and zero
  kFollow,  ///< towards the target
};

class Correction {
 public:
  [[nodiscard]] const JointVector& ji() const noexcept { return ji_; }

  /// Moves each joint towards its target, by at most its step, as far as allowed; `largest_ji`
  /// bounds it whatever the target is. Returns how many did not arrive at what they may reach.
  std::uint32_t move(Allowed allowed, const JointVector& target_ji, const JointVector& step_ji,
                     const JointVector& largest_ji) noexcept;

  /// Keeps of each joint's correction the part that is also in `ji`; returns whether one changed.
  bool keep_part(const JointVector& ji) noexcept;

  /// The part of `correction_ji` that is also in `ji`: never more, never of the other sign.
  [[nodiscard]] static float part_of(float correction_ji, float ji) noexcept {
    const float least_ji = correction_ji < 0.0F ? correction_ji : 0.0F;
    const float most_ji = correction_ji > 0.0F ? correction_ji : 0.0F;
    return std::max(least_ji, std::min(most_ji, ji));
  }

 private:
  JointVector ji_{};
};

}  // namespace ravencal::rt
