// SPDX-License-Identifier: Apache-2.0
//
// What surrounds the robot of a sealed case, whatever laws move it: the desired motion, noise that
// remembers, the encoders, and the recorder's chain (truth stamped late on another clock, nearest
// stamps paired).
#pragma once

#include <functional>
#include <vector>

#include "prove/generator/mechanics.hpp"
#include "prove/generator/session.hpp"

namespace ravencal::prove {

inline constexpr double kCycleS = 1e-3;

/// One row of the robot's stream. SI units; torque at the capstan.
struct RecordedRow {
  double t_s = 0.0;
  Vector3d desired = Vector3d::Zero(), motor_rad = Vector3d::Zero();
  Vector3d motor_velocity = Vector3d::Zero(), estimate = Vector3d::Zero();
  Vector3d torque = Vector3d::Zero();
};

/// What disturbs one joint; every source has its own stream, stepped once a cycle whatever happens.
class Disturber {
 public:
  Disturber(const JointSession& joint, std::uint64_t seed, const std::string& name, bool on);
  void apply(double t_s, Eigen::Index i, CycleInputs& inputs);

 private:
  const JointSession& joint_;
  bool on_;
  Random effort_random_, level_random_;
  Coloured effort_, level_;
};

/// Noise of one joint's external encoder, stepped at each of its readings.
class TruthSensor {
 public:
  TruthSensor(const JointSession& joint, std::uint64_t seed, const std::string& name, bool on,
              double period_s);
  double read(double position);

 private:
  const JointSession& joint_;
  bool on_;
  Random random_;
  Coloured coloured_;
  double walk_step_;
  double walk_ = 0.0;
};

/// Keeps a reference to the session.
class Recorder {
 public:
  Recorder(const Session& session, const SessionSeeds& seeds);

  [[nodiscard]] Vector3d desired_at(double t_s) const;
  /// By the controller's coupling: motors over their reduction from joints, and back.
  [[nodiscard]] Vector3d motors_of(const Vector3d& joints) const {
    return motor_from_joint_ * joints;
  }
  [[nodiscard]] Vector3d joints_of(const Vector3d& motors) const {
    return joint_from_motor_ * motors;
  }
  /// Motor angle in rad as the encoder of joint `i` counts it, lost counts included.
  [[nodiscard]] double encoder_rad(Eigen::Index i, double motor, double t_s) const;
  /// What is added to the drive's input of joint `i`, torque at the capstan.
  [[nodiscard]] double added_torque_n_m(Eigen::Index i, double t_s) const;

  /// Once a cycle each: noise and lengths of the cables; readings of the external encoders that
  /// were due at `t_s`; the row, where the throttled stream has one.
  void disturb(double t_s, CycleInputs& inputs);
  void read_truth(double t_s, const Vector3d& joints);
  void keep(long cycle, const RecordedRow& row);

  [[nodiscard]] record::Recording recording() const;

 private:
  struct Reading {
    double stamp_s;
    Vector3d value;
  };

  const Session& session_;
  SessionSeeds seeds_;
  Eigen::Index count_;
  Random stamps_;
  std::vector<Path> paths_;
  std::vector<Disturber> disturbers_;
  std::vector<TruthSensor> sensors_;
  Eigen::Matrix3d motor_from_joint_, joint_from_motor_;
  std::vector<Vector3d> history_;
  std::vector<Reading> readings_;
  std::vector<RecordedRow> rows_;
  double next_reading_s_ = 0.0;
};

/// Calls `step` with the number of each cycle: from 1.5 s before the recording, at rest, to its
/// end. `look` is asked about once per simulated second; false stops. Errors: kUsage where it did,
/// else the step's.
core::Status run_cycles(const Session& session, const std::function<bool()>& look,
                        const std::function<core::Status(long cycle)>& step);

}  // namespace ravencal::prove
