// SPDX-License-Identifier: Apache-2.0
#include "robot/arm_probe.hpp"

#include <algorithm>
#include <cmath>

#include "robot/follower.hpp"

namespace ravencal::robot {
namespace {

using Eigen::Vector3d;

constexpr Eigen::Index kElbow = 1;
// Without commands the CRTK branch sets both arms' desired joints to the measured ones within ten
// cycles: they do not change later for that reason.
constexpr double kSilenceS = 0.3;
constexpr double kLegS = 0.25;        // out, and back again: 1.2 deg/s
constexpr double kAnswerS = 0.25;     // for the last increment to show in /ravenstate
constexpr double kSeenShare = 0.5;    // of the reach: that arm was driven
constexpr double kUnseenShare = 0.2;  // of the reach: that arm was not
constexpr int kRounds = 5;            // a hold-up of ten cycles takes the commands back

}  // namespace

void ArmProbe::restart() {
  go_on(Leg::kSilence);
  arm_ = CrtkArm::kArm1;
}

void ArmProbe::go_on(Leg leg) {
  leg_ = leg;
  leg_s_ = 0.0;
}

void ArmProbe::start(const RobotView& view) {
  const double middle = 0.5 * (limits_.low_ji[kElbow] + limits_.high_ji[kElbow]);
  direction_ = view.joints_ji[kElbow] < middle ? 1.0 : -1.0;
  own_last_rad_ = view.desired_ji[kElbow];
  other_last_rad_ = view.other_desired_ji[kElbow];
  own_moved_rad_ = other_moved_rad_ = sent_ = 0.0;
}

/// Adds up the outward motion of the desired joints. It counts even if the controller takes it back
/// after a hold-up.
void ArmProbe::watch(const RobotView& view) {
  const auto outwards = [this](double now_rad, double& last_rad) {
    const double moved = direction_ * (now_rad - last_rad);
    last_rad = now_rad;
    return std::max(0.0, moved);
  };
  own_moved_rad_ += outwards(view.desired_ji[kElbow], own_last_rad_);
  other_moved_rad_ += outwards(view.other_desired_ji[kElbow], other_last_rad_);
}

/// Increment from the share that has been sent to this one.
Vector3d ArmProbe::move(double share_of_reach) {
  const double share = std::clamp(share_of_reach, 0.0, 1.0);
  const double increment = direction_ * kReachRad * (share - sent_);
  sent_ = share;
  return {0.0, increment, 0.0};
}

void ArmProbe::judge() {
  const bool own = own_moved_rad_ > kSeenShare * kReachRad;
  const bool other = other_moved_rad_ > kUnseenShare * kReachRad;
  found_ = own && !other;
  if (found_) return;
  go_on(Leg::kSilence);
  const bool last = arm_ == CrtkArm::kArm2;
  arm_ = last ? CrtkArm::kArm1 : CrtkArm::kArm2;
  if (!last || ++round_ < kRounds) return;
  failure_ = own ? "both arms follow one CRTK arm"
                 : "neither /arm1 nor /arm2 drives it, the controller does not take the commands";
}

std::optional<Vector3d> ArmProbe::step(const RobotView& view, double dt_s) {
  if (found_ || !failure_.empty()) return std::nullopt;
  leg_s_ += dt_s;
  if (leg_ == Leg::kSilence) {
    if (leg_s_ < kSilenceS) return std::nullopt;
    start(view);
    go_on(Leg::kOut);
  }
  if (leg_ == Leg::kOut || leg_ == Leg::kWait) watch(view);
  std::optional<Vector3d> increment = Vector3d(Vector3d::Zero());
  if (leg_ == Leg::kOut) {
    increment = move(leg_s_ / kLegS);
    if (leg_s_ >= kLegS) go_on(Leg::kWait);
  } else if (leg_ == Leg::kWait) {
    if (leg_s_ >= kAnswerS) go_on(Leg::kBack);
  } else if (leg_ == Leg::kBack) {
    increment = move(1.0 - leg_s_ / kLegS);
    if (leg_s_ >= kLegS) go_on(Leg::kRest);
  } else if (leg_s_ >= kAnswerS) {
    judge();
  }
  return increment;
}

}  // namespace ravencal::robot
