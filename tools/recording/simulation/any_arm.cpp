// SPDX-License-Identifier: Apache-2.0
#include "simulation/any_arm.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "physics/predict/predict.hpp"
#include "physics/predict/run_arm.hpp"
#include "physics/predict/smoother.hpp"
#include "record/recording_writer.hpp"
#include "simulation/session_parts.hpp"

namespace ravencal::simulation {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using physics::Plant;
using record::Role;

/// Of the servo that leads a joint whose plant states none: critically damped, as fast as those of
/// arms are (the maker's own of small and large arms lie between some and some tens of Hz).
constexpr double kServo_hz = 10.0;
/// The arm stands still before the recording begins, for its weight to settle.
constexpr double kSettle_s = 2.0;
constexpr double kLookPeriod_s = 1.0;  ///< simulated time between two looks at the user

/// Motors as they moved, [rows][joints].
struct Run {
  MatrixXd desired, motors, velocities, efforts;
  std::vector<std::int64_t> t_ns;
  bool interrupted = false;
};

core::Status check_options(const Plant& plant, const SessionOptions& options) {
  std::vector<std::string_view> only;
  if (options.edges) only.emplace_back("edges of the external encoders");
  if (options.rehome_every_s > 0.0 || options.rehomings > 0) only.emplace_back("homings");
  if (options.drift) only.emplace_back("drift");
  if (options.on_truth) only.emplace_back("the truth of each cycle");
  if (only.empty()) return {};
  return core::usage_error(fmt::format(
      "{}: {}: only the twin of a RAVEN arm has that (three joints, each with [joint.controller] "
      "and [joint.homing])",
      plant.source, fmt::join(only, ", ")));
}

core::Status check_loads(const Plant& plant) {
  for (const physics::Joint& joint : plant.joints) {
    if (!joint.external_load) continue;
    return core::data_error(fmt::format(
        "{}: joint '{}' is loaded from outside by the recorded '{}', which no trajectory has: give "
        "--follow with a recording",
        plant.source, joint.name, joint.external_load->channel));
  }
  return {};
}

/// The plant's servos; `led` gets the names of joints that have none.
std::vector<physics::ArmServo> servos_of(const Plant& plant, const MatrixXd& inertia,
                                         std::vector<std::string>& led) {
  std::vector<physics::ArmServo> servos;
  for (std::size_t j = 0; j < plant.joints.size(); ++j) {
    const physics::Joint& joint = plant.joints[j];
    const auto own = physics::servo_law(joint);
    if (own && own->position > 0.0) {
      servos.push_back({*own, joint.controller->gravity_compensation});
      continue;
    }
    led.push_back(joint.name);
    const auto place = static_cast<Index>(j);
    const double rate = 2.0 * std::numbers::pi * kServo_hz, moved = inertia(place, place);
    servos.push_back({{moved * rate * rate, 2.0 * moved * rate, 2.0 * moved * rate, 0.0}, true});
  }
  return servos;
}

core::Result<physics::ArmRun> arm_of(const Plant& plant, const VectorXd& start,
                                     std::vector<std::string>& led) {
  const std::vector<physics::ArmServo> none(plant.joints.size());
  RAVENCAL_ASSIGN_OR_RETURN(physics::ArmRun resting, physics::ArmRun::create(plant, none));
  resting.place(start);
  RAVENCAL_ASSIGN_OR_RETURN(
      physics::ArmRun arm,
      physics::ArmRun::create(plant, servos_of(plant, resting.inertia(), led)));
  arm.place(start);
  const auto cycles = static_cast<std::int64_t>(kSettle_s * plant.robot.control_rate_hz);
  for (std::int64_t i = 0; i < cycles; ++i) arm.advance(start, start);
  return arm;
}

Run run_along(const Plant& plant, physics::ArmRun& arm, const trajectory::Trajectory& trajectory,
              std::int64_t cycles_per_row, const ProgressFunction& progress) {
  const double rate_hz = plant.robot.control_rate_hz;
  const auto cycles = static_cast<std::int64_t>(std::floor(trajectory.duration_s() * rate_hz));
  const auto look = static_cast<std::int64_t>(kLookPeriod_s * rate_hz);
  const Index rows = cycles / cycles_per_row + 1;
  const auto joints = static_cast<Index>(plant.joints.size());
  Run run;
  for (MatrixXd* part : {&run.desired, &run.motors, &run.velocities, &run.efforts})
    part->resize(rows, joints);
  VectorXd wanted = trajectory.at(0.0), from = physics::asked_motors(plant, wanted);
  for (std::int64_t i = 0; i <= cycles && !run.interrupted; ++i) {
    const VectorXd next = trajectory.at(static_cast<double>(i + 1) / rate_hz);
    const VectorXd to = physics::asked_motors(plant, next);
    const VectorXd motors = arm.motors_ji();
    arm.advance(from, to);
    if (i % cycles_per_row == 0) {
      const Index row = i / cycles_per_row;
      run.t_ns.push_back(std::llround(1e9 * static_cast<double>(i) / rate_hz));
      run.desired.row(row) = wanted;
      run.motors.row(row) = motors;
      run.velocities.row(row) = arm.velocities_ji();
      run.efforts.row(row) = arm.efforts();
    }
    run.interrupted =
        i % look == 0 &&
        !progress(static_cast<double>(i) / static_cast<double>(std::max<std::int64_t>(1, cycles)));
    wanted = next;
    from = to;
  }
  for (MatrixXd* part : {&run.desired, &run.motors, &run.velocities, &run.efforts})
    part->conservativeResize(static_cast<Index>(run.t_ns.size()), joints);
  return run;
}

/// Where the plant's transmissions hold the joints, [joints]; empty where no encoder would show it.
core::Result<std::vector<VectorXd>> shown_joints(const Plant& plant, const Run& run) {
  const bool any =
      std::any_of(plant.joints.begin(), plant.joints.end(),
                  [](const physics::Joint& j) { return j.joint_encoder_resolution_ji > 0.0; });
  if (!any) return std::vector<VectorXd>{};
  physics::ForcedMotion forced;
  forced.t_s.resize(run.motors.rows());
  for (Index i = 0; i < forced.t_s.size(); ++i)
    forced.t_s[i] = 1e-9 * static_cast<double>(run.t_ns[static_cast<std::size_t>(i)]);
  forced.fresh.assign(run.t_ns.size(), 0);
  forced.fresh.front() = 1;
  for (Index j = 0; j < run.motors.cols(); ++j)
    forced.motors.push_back(physics::smooth_motion(forced.t_s, run.motors.col(j), forced.fresh));
  RAVENCAL_ASSIGN_OR_RETURN(const physics::Prediction placed, physics::predict(plant, forced));
  return placed.position;
}

void add_column(record::Recording& out, const record::Channel& channel, const VectorXd& values) {
  out.channels.push_back(channel);
  out.samples.conservativeResize(values.size(), static_cast<Index>(out.channels.size()));
  out.samples.rightCols<1>() = values;
}

/// What a controller logs of its motors and, where the plant has one, what the external encoder
/// says.
record::Recording recording_of(const Plant& plant, const Run& run,
                               const std::vector<VectorXd>& shown) {
  record::Recording out;
  out.t_ns = run.t_ns;
  MatrixXd believed(run.motors.rows(), run.motors.cols());
  for (Index i = 0; i < believed.rows(); ++i)
    believed.row(i) = physics::believed_joints(plant, run.motors.row(i).transpose());
  for (std::size_t j = 0; j < plant.joints.size(); ++j) {
    const physics::Joint& joint = plant.joints[j];
    const auto k = static_cast<Index>(j);
    const bool turns = joint.kind == physics::JointKind::kRevolute;
    const std::string unit = turns ? "rad" : "m";
    const double torque_per_effort = joint.gearbox_ratio / joint.reduction;
    const auto add = [&](std::string_view what, std::string_view in, Role role,
                         const VectorXd& values) {
      add_column(out, {fmt::format("{}.{}", joint.name, what), std::string(in), role, joint.name},
                 values);
    };
    add("desired", unit, Role::kDesiredPosition, run.desired.col(k));
    add("position", unit, Role::kJointEstimate, believed.col(k));
    add("motor", "rad", Role::kMotorPosition, run.motors.col(k) * joint.reduction);
    add("motor_velocity", "rad_per_s", Role::kMotorVelocity,
        run.velocities.col(k) * joint.reduction);
    add("torque", "N_m", Role::kDriveTorque, run.efforts.col(k) * torque_per_effort);
    const double step = joint.joint_encoder_resolution_ji;
    if (step > 0.0)
      add("truth", unit, Role::kJointTruth,
          shown[j].unaryExpr([step](double q) { return step * std::round(q / step); }));
  }
  return out;
}

}  // namespace

core::Result<SessionSummary> record_any_arm(const Plant& plant,
                                            const trajectory::Trajectory& trajectory,
                                            const std::filesystem::path& out,
                                            const SessionOptions& options,
                                            const ProgressFunction& progress) {
  RAVENCAL_RETURN_IF_ERROR(check_options(plant, options));
  RAVENCAL_RETURN_IF_ERROR(check_loads(plant));
  RAVENCAL_ASSIGN_OR_RETURN(const std::int64_t cycles, cycles_per_row(plant, options));
  std::vector<std::string> led;
  RAVENCAL_ASSIGN_OR_RETURN(physics::ArmRun arm,
                            arm_of(plant, physics::asked_motors(plant, trajectory.at(0.0)), led));
  const Run run = run_along(plant, arm, trajectory, cycles, progress);
  if (!run.motors.allFinite())
    return core::data_error(fmt::format(
        "{}: the simulation has no end: a joint runs away under its servo; check the gains of "
        "[joint.controller] against inertia_kg_m2 and inner_rate_hz",
        plant.source));
  RAVENCAL_ASSIGN_OR_RETURN(const std::vector<VectorXd> shown, shown_joints(plant, run));
  record::Recording recording = recording_of(plant, run, shown);
  recording.meta = meta_of(plant, options);
  if (!led.empty()) recording.meta["led_by_simulation"] = fmt::format("{}", fmt::join(led, " "));
  if (run.interrupted)
    recording.events.push_back({run.t_ns.back(), "interrupted", "stopped by the user"});
  RAVENCAL_RETURN_IF_ERROR(
      record::write_recording(recording, out, options.overwrite && !run.interrupted));
  SessionSummary summary;
  summary.rows = recording.rows();
  summary.simulated_s = kSettle_s + 1e-9 * static_cast<double>(run.t_ns.back());
  summary.interrupted = run.interrupted;
  summary.led = std::move(led);
  return summary;
}

}  // namespace ravencal::simulation
