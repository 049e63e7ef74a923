// SPDX-License-Identifier: Apache-2.0
#include "prove/generator/session.hpp"

#include <algorithm>
#include <cmath>

#include "prove/generator/mechanics.hpp"
#include "prove/generator/recorder.hpp"

namespace ravencal::prove {
namespace {

using Eigen::Index;

class Runner {
 public:
  Runner(const Session& session, const SessionSeeds& seeds, Mechanics mechanics)
      : session_(session),
        recorder_(session, seeds),
        mechanics_(std::move(mechanics)),
        count_(static_cast<Index>(session.joints.size())) {
    mechanics_.place(recorder_.desired_at(0.0));
  }

  core::Status step(long cycle) {
    const double t_s = static_cast<double>(cycle) * kCycleS;
    recorder_.read_truth(t_s, mechanics_.joints());
    recorder_.keep(cycle, servo(t_s));
    recorder_.disturb(t_s, inputs_);
    return mechanics_.advance(inputs_, kCycleS);
  }

  [[nodiscard]] record::Recording recording() const { return recorder_.recording(); }

 private:
  RecordedRow servo(double t_s) {
    RecordedRow row;
    row.t_s = t_s;
    row.desired = recorder_.desired_at(std::max(0.0, t_s));
    const Vector3d wanted = recorder_.motors_of(row.desired);
    const Vector3d motors = mechanics_.motors();
    Vector3d measured = Vector3d::Zero();
    for (Index i = 0; i < count_; ++i) {
      const auto n = static_cast<std::size_t>(i);
      const JointSession& j = session_.joints[n];
      const JointPhysics& p = session_.robot.joints[n];
      row.motor_rad[i] = recorder_.encoder_rad(i, motors[i], t_s);
      row.motor_velocity[i] = started_ ? (row.motor_rad[i] - last_motor_[i]) / kCycleS : 0.0;
      double torque =
          j.kp * (wanted[i] * p.reduction - row.motor_rad[i]) - j.kd * row.motor_velocity[i];
      torque += recorder_.added_torque_n_m(i, t_s);
      double dac = std::trunc(torque * j.dac_counts_per_n_m);
      if (j.dac_limit_counts > 0.0) dac = std::clamp(dac, -j.dac_limit_counts, j.dac_limit_counts);
      row.torque[i] = dac / j.dac_counts_per_n_m;
      inputs_.effort[i] = row.torque[i] * (p.reduction / p.gearbox_ratio);
      measured[i] = row.motor_rad[i] / p.reduction;
    }
    last_motor_ = row.motor_rad;
    started_ = true;
    row.estimate = recorder_.joints_of(measured);
    return row;
  }

  const Session& session_;
  Recorder recorder_;
  Mechanics mechanics_;
  Index count_;
  CycleInputs inputs_;
  Vector3d last_motor_ = Vector3d::Zero();
  bool started_ = false;
};

}  // namespace

core::Result<record::Recording> run_session(const Session& session, const SessionSeeds& seeds,
                                            const std::function<bool()>& look) {
  RAVENCAL_ASSIGN_OR_RETURN(Mechanics mechanics, Mechanics::create(session.robot));
  Runner runner(session, seeds, std::move(mechanics));
  RAVENCAL_RETURN_IF_ERROR(
      run_cycles(session, look, [&runner](long cycle) { return runner.step(cycle); }));
  return runner.recording();
}

}  // namespace ravencal::prove
