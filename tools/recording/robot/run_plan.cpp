// SPDX-License-Identifier: Apache-2.0
#include "robot/run_plan.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>
#include <numbers>

#include "core/constants.hpp"
#include "core/joint_layout.hpp"

namespace ravencal::robot {
namespace {

using Eigen::Index;
using Eigen::Vector3d;

const Vector3d kShown(core::kRadPerDeg, core::kRadPerDeg, 1e-3);  // deg, deg, mm
constexpr std::array<const char*, 3> kShownUnits = {"deg", "deg", "mm"};

Vector3d low_of(const trajectory::Trajectory& trajectory) {
  Vector3d low = trajectory.joints_ji.front();
  for (const Eigen::VectorXd& joints : trajectory.joints_ji) low = low.cwiseMin(joints);
  return low;
}

Vector3d high_of(const trajectory::Trajectory& trajectory) {
  Vector3d high = trajectory.joints_ji.front();
  for (const Eigen::VectorXd& joints : trajectory.joints_ji) high = high.cwiseMax(joints);
  return high;
}

std::string topic_text(const RunArguments& arguments) {
  const auto arm = arguments.named_crtk_arm();
  return arm ? command_topic_of(*arm, arguments.mode)
             : fmt::format("servo_{} of the CRTK arm that a probe finds", arguments.mode);
}

}  // namespace

std::optional<CrtkArm> RunArguments::named_crtk_arm() const {
  if (crtk_arm.empty()) return std::nullopt;
  return crtk_arm == "arm1" ? CrtkArm::kArm1 : CrtkArm::kArm2;
}

std::vector<CrtkArm> RunArguments::crtk_arms() const {
  if (const auto named = named_crtk_arm()) return {*named};
  return {CrtkArm::kArm1, CrtkArm::kArm2};
}

void add_run_arguments(CLI::App& command, RunArguments& arguments) {
  command.add_option("--trajectory", arguments.trajectory, "CSV of `ravencal trajectory`");
  command.add_option("--out", arguments.out, "Recording to create (.db): states and true joints");
  command.add_option("--arm", arguments.arm, "The arm with the external encoders")
      ->check(CLI::IsMember({"gold", "green"}))
      ->capture_default_str();
  command
      .add_option(
          "--crtk-arm", arguments.crtk_arm,
          "The CRTK arm that drives it: arm1 or arm2; default: found out by moving an elbow by "
          "0.3 deg and back")
      ->check(CLI::IsMember({"arm1", "arm2"}));
  command
      .add_option("--mode", arguments.mode, "jr: increments (servo_jr); jp: positions (servo_jp)")
      ->check(CLI::IsMember({"jr", "jp"}))
      ->capture_default_str();
  command
      .add_option(
          "--max-speed", arguments.max_speed,
          "Shoulder, elbow [deg/s], insertion [mm/s]; default: the authors' follower. Their "
          "random motion goes up to 3,4,7")
      ->delimiter(',')
      ->expected(3)
      ->check(CLI::Range(0.01, 20.0))
      ->capture_default_str();
  command.add_option("--rate-hz", arguments.rate_hz, "Rows per second of the recording")
      ->check(CLI::Range(1.0, 1000.0))
      ->capture_default_str();
  command
      .add_option("--stale-s", arguments.stale_s, "Stop after so long without a state of the robot")
      ->check(CLI::Range(0.02, 30.0))
      ->capture_default_str();
  command
      .add_option("--wait-s", arguments.wait_s,
                  "Give up if robot, homing or pedal have not come after so long")
      ->check(CLI::Range(0.1, 86400.0))
      ->capture_default_str();
  command.add_flag("--no-encoders", arguments.no_encoders,
                   "Record without true joints (`ravencal merge` can add them)");
  command.add_flag("--dry-run", arguments.dry_run, "Print duration and limits; needs no robot");
  command.add_flag("--check", arguments.check,
                   "Look whether robot and encoders are there, and end");
  command.add_flag("--await-homed", arguments.await_homed,
                   "Wait until the robot is homed, and end");
  command.add_flag("--force", arguments.force, "Replace an existing recording");
  command.add_flag("--json", arguments.json, "Print the summary as JSON");
  command.footer(
      "Needs ROS 1, the controller's CRTK branch and a homed robot; the pedal pauses and goes on,\n"
      "Ctrl-C ends (exit 0). The recording is kept whatever happens. Exit 4: the robot was "
      "stopped.\n"
      "On the CRTK branch the order of the USB boards decides whether arm1 is gold or green: "
      "without\n"
      "--crtk-arm the run begins with a probe, an elbow that moves by 0.3 deg and back.\n"
      "Examples: ravencal run --trajectory zigzag3.csv --out zigzag3.db --dry-run\n"
      "          ravencal run --trajectory zigzag3.csv --out zigzag3.db --crtk-arm arm2");
}

core::Result<RunPlan> make_plan(const RunArguments& arguments) {
  if (arguments.trajectory.empty()) return core::usage_error("--trajectory is missing");
  if (arguments.out.empty() && !arguments.dry_run) return core::usage_error("--out is missing");
  RunPlan plan;
  RAVENCAL_ASSIGN_OR_RETURN(plan.trajectory, trajectory::read_csv(arguments.trajectory));
  RAVENCAL_ASSIGN_OR_RETURN(
      plan.trajectory, trajectory::in_order(std::move(plan.trajectory), trajectory::raven_joints(),
                                            arguments.trajectory, "a RAVEN arm"));
  for (Index joint = 0; joint < 3; ++joint) {
    plan.follower.limits.max_speed_ji_per_s[joint] =
        arguments.max_speed[static_cast<std::size_t>(joint)] * kShown[joint];
  }
  RAVENCAL_RETURN_IF_ERROR(
      check_positions(plan.trajectory, plan.follower.limits, arguments.trajectory));
  plan.follower.arm = arguments.arm;
  plan.follower.crtk_arm = arguments.named_crtk_arm();
  plan.follower.mode = arguments.mode;
  plan.follower.stale_s = arguments.stale_s;
  plan.duration_s = slowed(plan.trajectory, plan.follower.limits).duration_s();
  return plan;
}

std::string plan_text(const RunArguments& arguments, const RunPlan& plan) {
  std::string text = fmt::format(
      "{}: {} rows, {:.1f} s ({:.1f} min), sent as {} within these limits:\n", arguments.trajectory,
      plan.trajectory.t_s.size(), plan.duration_s, plan.duration_s / 60.0, topic_text(arguments));
  const MotionLimits& limits = plan.follower.limits;
  const Vector3d low = low_of(plan.trajectory).cwiseQuotient(kShown);
  const Vector3d high = high_of(plan.trajectory).cwiseQuotient(kShown);
  text += fmt::format("  {:<10}{:>18}{:>18}{:>14}{:>18}\n", "joint", "uses", "may use",
                      "per second", "per message");
  for (Index j = 0; j < 3; ++j) {
    const std::string unit = kShownUnits[static_cast<std::size_t>(j)];
    const double shown = kShown[j];
    text += fmt::format(
        "  {:<10}{:>18}{:>18}{:>14}{:>18}\n", core::kSlotNames[static_cast<std::size_t>(j)],
        fmt::format("{:.1f}..{:.1f} {}", low[j], high[j], unit),
        fmt::format("{:.1f}..{:.1f} {}", limits.low_ji[j] / shown, limits.high_ji[j] / shown, unit),
        fmt::format("{:.3f} {}", limits.max_speed_ji_per_s[j] / shown, unit),
        fmt::format("{} {}", limits.max_increment_ji[j], j == 2 ? "m" : "rad"));
  }
  return text;
}

std::string plan_json(const RunArguments& arguments, const RunPlan& plan) {
  nlohmann::ordered_json json = {{"trajectory", arguments.trajectory},
                                 {"rows", plan.trajectory.t_s.size()},
                                 {"duration_s", plan.duration_s},
                                 {"topic", topic_text(arguments)},
                                 {"joints", nlohmann::ordered_json::array()}};
  const MotionLimits& limits = plan.follower.limits;
  const Vector3d low = low_of(plan.trajectory);
  const Vector3d high = high_of(plan.trajectory);
  for (Index j = 0; j < 3; ++j) {
    const auto slot = static_cast<std::size_t>(j);
    json["joints"].push_back({{"joint", core::kSlotNames[slot]},
                              {"unit", core::kSlotUnits[slot]},
                              {"uses", {low[j], high[j]}},
                              {"limits", {limits.low_ji[j], limits.high_ji[j]}},
                              {"max_speed", limits.max_speed_ji_per_s[j]},
                              {"max_increment", limits.max_increment_ji[j]}});
  }
  return json.dump(2) + "\n";
}

}  // namespace ravencal::robot
