// SPDX-License-Identifier: Apache-2.0
#include "rt_plugin/correction.hpp"

namespace ravencal::rt {

std::uint32_t Correction::move(Allowed allowed, const JointVector& target_ji,
                               const JointVector& step_ji, const JointVector& largest_ji) noexcept {
  if (allowed == Allowed::kNone) ji_ = JointVector{};
  std::uint32_t behind = 0;
  for (std::size_t j = 0; j < ji_.size(); ++j) {
    const float bounded_ji = std::clamp(target_ji[j], -largest_ji[j], largest_ji[j]);
    const float reachable_ji =
        allowed == Allowed::kFollow ? bounded_ji : part_of(ji_[j], target_ji[j]);
    const float most_ji = allowed == Allowed::kStay ? 0.0F : step_ji[j];
    const float gap_ji = reachable_ji - ji_[j];
    behind += gap_ji > most_ji || gap_ji < -most_ji ? 1U : 0U;
    if (gap_ji > most_ji) {
      ji_[j] += most_ji;
    } else if (gap_ji < -most_ji) {
      ji_[j] -= most_ji;
    } else {
      ji_[j] = reachable_ji;
    }
  }
  return behind;
}

bool Correction::keep_part(const JointVector& ji) noexcept {
  const JointVector before_ji = ji_;
  for (std::size_t j = 0; j < ji_.size(); ++j) ji_[j] = part_of(ji_[j], ji[j]);
  return ji_ != before_ji;
}

}  // namespace ravencal::rt
