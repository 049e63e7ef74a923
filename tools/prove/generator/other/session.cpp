// SPDX-License-Identifier: Apache-2.0
//
// A run of the other world: a cascade of position and velocity loops in its 1 kHz cycle. The
// velocity is low-pass filtered, the command reaches the drive whole cycles late, and the recorded
// torque is that of the quantised measured current. Cascade and filter after Leonhard, "Control of
// Electrical Drives", Springer, 1985; the current loop is its first-order lag.
#include <algorithm>
#include <cmath>
#include <deque>

#include "prove/generator/other/arm.hpp"
#include "prove/generator/recorder.hpp"
#include "prove/generator/world.hpp"

namespace ravencal::prove {
namespace {

using Eigen::Index;

class OtherRunner {
 public:
  OtherRunner(const Session& session, const SessionSeeds& seeds, OtherArm arm)
      : session_(session),
        recorder_(session, seeds),
        arm_(std::move(arm)),
        count_(static_cast<Index>(session.joints.size())),
        waiting_(static_cast<std::size_t>(session.other.latency_cycles), Vector3d::Zero()),
        keep_(std::exp(-kCycleS / session.other.velocity_filter_s)) {
    arm_.place(recorder_.desired_at(0.0));
  }

  core::Status step(long cycle) {
    const double t_s = static_cast<double>(cycle) * kCycleS;
    recorder_.read_truth(t_s, arm_.joints());
    recorder_.keep(cycle, servo(t_s));
    recorder_.disturb(t_s, inputs_);
    return arm_.advance(inputs_, kCycleS);
  }

  [[nodiscard]] record::Recording recording() const { return recorder_.recording(); }

 private:
  RecordedRow servo(double t_s) {
    RecordedRow row;
    row.t_s = t_s;
    row.desired = recorder_.desired_at(std::max(0.0, t_s));
    const Vector3d wanted = recorder_.motors_of(row.desired);
    const Vector3d motors = arm_.motors(), currents = arm_.currents();
    Vector3d measured = Vector3d::Zero(), asked = Vector3d::Zero();
    for (Index i = 0; i < count_; ++i) {
      const auto n = static_cast<std::size_t>(i);
      const JointSession& j = session_.joints[n];
      const JointPhysics& p = session_.robot.joints[n];
      const double to_joint = p.reduction / p.gearbox_ratio;
      const double motor_rad = recorder_.encoder_rad(i, motors[i], t_s);
      const double raw = started_ ? (motor_rad - last_motor_[i]) / kCycleS : 0.0;
      velocity_[i] = raw + keep_ * (velocity_[i] - raw);
      last_motor_[i] = motor_rad;
      asked[i] = to_joint * cascade(i, wanted[i] * p.reduction - motor_rad, t_s);
      row.motor_rad[i] = motor_rad;
      row.motor_velocity[i] = velocity_[i];
      row.torque[i] =
          std::round(currents[i] / to_joint * j.dac_counts_per_n_m) / j.dac_counts_per_n_m;
      measured[i] = motor_rad / p.reduction;
    }
    started_ = true;
    waiting_.push_back(asked);
    inputs_.effort = waiting_.front();
    waiting_.pop_front();
    row.estimate = recorder_.joints_of(measured);
    return row;
  }

  /// Torque at the capstan in whole counts: kd (v_wanted - v) and its integral, where
  /// v_wanted = kp / kd times the position error.
  double cascade(Index i, double error_rad, double t_s) {
    const JointSession& j = session_.joints[static_cast<std::size_t>(i)];
    const double velocity_error = j.kp / j.kd * error_rad - velocity_[i];
    const double torque =
        j.kd * (velocity_error + integral_[i]) + recorder_.added_torque_n_m(i, t_s);
    const double whole = std::round(torque * j.dac_counts_per_n_m);
    const bool clips = j.dac_limit_counts > 0.0 && std::abs(whole) > j.dac_limit_counts;
    // The integral waits while the drive clips.
    if (session_.other.integral_time_s > 0.0 && !clips)
      integral_[i] += velocity_error * kCycleS / session_.other.integral_time_s;
    const double given = clips ? std::clamp(whole, -j.dac_limit_counts, j.dac_limit_counts) : whole;
    return given / j.dac_counts_per_n_m;
  }

  const Session& session_;
  Recorder recorder_;
  OtherArm arm_;
  Index count_;
  CycleInputs inputs_;
  std::deque<Vector3d> waiting_;
  double keep_;
  Vector3d velocity_ = Vector3d::Zero(), integral_ = Vector3d::Zero();
  Vector3d last_motor_ = Vector3d::Zero();
  bool started_ = false;
};

}  // namespace

core::Result<record::Recording> run_other_session(const Session& session, const SessionSeeds& seeds,
                                                  const std::function<bool()>& look) {
  RAVENCAL_ASSIGN_OR_RETURN(OtherArm arm, OtherArm::create(session.robot, session.other));
  OtherRunner runner(session, seeds, std::move(arm));
  RAVENCAL_RETURN_IF_ERROR(
      run_cycles(session, look, [&runner](long cycle) { return runner.step(cycle); }));
  return runner.recording();
}

}  // namespace ravencal::prove
