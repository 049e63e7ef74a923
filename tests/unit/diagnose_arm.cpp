// SPDX-License-Identifier: Apache-2.0
#include "diagnose_arm.hpp"

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace ravencal::generator {
namespace {

constexpr double kReduction = 121.5;
constexpr double kGearbox = 12.25;
constexpr double kTick_s = 1e-3;
constexpr int kInner = 10;
constexpr double kMotorInertia = 0.34;  // at the joint
constexpr double kLinkMass = 0.6, kLinkArm_m = 0.35, kLinkInertia = 0.12;
constexpr double kWarmUp_s = 140.0;
constexpr double kTwoPi = 6.283185307179586;

class Draw {
 public:
  explicit Draw(std::uint64_t seed) : engine_(seed) {}
  double uniform() { return static_cast<double>(engine_() >> 11U) * 0x1.0p-53; }
  double normal() {
    double sum = -6.0;
    for (int i = 0; i < 12; ++i) sum += uniform();
    return sum;
  }

 private:
  std::mt19937_64 engine_;
};

/// LuGre (Canudas de Wit, Olsson, Astrom, Lischinsky 1995), implicit in its bristle.
struct LuGre {
  double z = 0.0;
  double step(double v, double dt_s, double level, double stiffness) {
    if (level <= 0.0) return 0.0;
    const double next = (z + v * dt_s) / (1.0 + stiffness * std::abs(v) * dt_s / level);
    const double rate = (next - z) / dt_s;
    z = next;
    return stiffness * z + 0.06 * std::sqrt(stiffness) * rate;
  }
};

std::vector<double> desired_path(const ArmScene& scene, Draw& draw) {
  const auto count = static_cast<std::size_t>(scene.duration_s / kTick_s);
  std::vector<double> path(count);
  double x = 0.0, v = 0.0, target = 0.45, speed = 0.05, hold = 0.0;
  for (std::size_t i = static_cast<std::size_t>(scene.rest_s / kTick_s); i < count; ++i) {
    const double wanted = hold > 0.0 ? 0.0 : (x < target ? speed : -speed);
    hold = std::max(0.0, hold - kTick_s);
    v += std::clamp(wanted - v, -0.5 * kTick_s, 0.5 * kTick_s);
    const double last = x;
    x += v * kTick_s;
    if (hold <= 0.0 && (last - target) * (x - target) <= 0.0) {
      const double side = target > 0.0 ? -1.0 : 1.0;
      if (scene.rich) {
        target = side * 0.5 * (0.05 + 0.95 * draw.uniform());
        if (draw.uniform() < 0.3)
          target = std::clamp(x + side * (0.01 + 0.1 * draw.uniform()), -0.5, 0.5);
        speed = 0.03 * std::exp(2.3 * draw.uniform());
        if (draw.uniform() < 0.2) hold = 2.0 + 8.0 * draw.uniform();
      } else {
        target = side * 0.5 * (0.6 + 0.4 * draw.uniform());
        speed = 0.03 + 0.04 * draw.uniform();
      }
    }
    path[i] = x;
  }
  return path;
}

/// Everything that moves, in joint units.
struct Arm {
  double motor = 0.0, motor_rate = 0.0, joint = 0.0, joint_rate = 0.0, creep = 0.0, strand = 0.0;
  LuGre motor_side, joint_side;

  /// Balanced at the motor's zero with its friction behind the cable fully built up.
  void rest_on_one_side(const ArmTruth& t, double mount_rad) {
    joint = -(t.weight_n_m * std::sin(mount_rad) + t.joint_friction) / t.stiffness;
    joint_side.z = t.joint_friction / std::max(1.0, t.joint_friction / 4e-4);
  }

  void step(const ArmTruth& t, double effort, double slip, double wander, double mount_rad) {
    constexpr double kStep = kTick_s / kInner;
    const double hill = (motor - 0.1) / 0.06;
    const double drive = motor * (1.0 + t.gain) + t.run_out_rad * std::sin(9.92 * motor + 1.0) +
                         slip + t.bump_rad * std::exp(-hill * hill);
    const double length = drive - joint - creep;
    const double gap = t.gap_half_rad;
    const double stretch = length > gap ? length - gap : (length < -gap ? length + gap : 0.0);
    const double rate = motor_rate * (1.0 + t.gain) - joint_rate;
    double tension = t.stiffness * stretch + (gap > 0.0 && stretch == 0.0 ? 0.0 : 3.0 * rate);
    if (t.strands_n_m > 0.0) {  // Bouc-Wen
      const double grows = rate * strand > 0.0 ? 1.0 - std::abs(strand) : 1.0;
      strand = std::clamp(strand + kStep * rate / t.strands_yield_rad * grows, -1.0, 1.0);
      tension += t.strands_n_m * strand;
    }
    if (t.creep > 0.0) creep += kStep * (t.creep * tension - creep) / 25.0;
    const double friction =
        motor_side.step(motor_rate, kStep, t.motor_friction, t.motor_friction / 3e-4) +
        t.viscous * motor_rate + 0.5 * t.uneven_n_m * std::abs(std::tanh(motor_rate / 0.002)) +
        0.5 * t.uneven_viscous * std::abs(motor_rate);
    const double behind = joint_side.step(joint_rate, kStep, t.joint_friction,
                                          std::max(1.0, t.joint_friction / 4e-4));
    const double weight =
        (t.weight_n_m + t.payload_kg * 9.81 * kLinkArm_m) * std::sin(joint + mount_rad);
    const double inertia = kLinkInertia + (kLinkMass + t.payload_kg) * kLinkArm_m * kLinkArm_m;
    motor_rate += kStep * (effort - friction - tension + wander) / kMotorInertia;
    joint_rate += kStep * (tension - behind - weight) / inertia;
    motor += kStep * motor_rate;
    joint += kStep * joint_rate;
  }
};

ArmTruth off_by(ArmTruth truth, double deviation, Draw& draw) {
  for (double* value : {&truth.motor_friction, &truth.viscous, &truth.stiffness,
                        &truth.joint_friction, &truth.weight_n_m}) {
    *value *= 1.0 + deviation * std::clamp(draw.normal(), -1.5, 1.5);
  }
  return truth;
}

/// First-order coloured noise of unit deviation.
struct ColouredNoise {
  double state = 0.0;
  double step(Draw& draw, double dt_s, double time_s) {
    const double keep = std::exp(-dt_s / time_s);
    return state = keep * state + std::sqrt(1.0 - keep * keep) * draw.normal();
  }
};

}  // namespace

record::Recording record_arm(const ArmTruth& nominal, const ArmScene& scene) {
  Draw draw(scene.seed);
  const ArmTruth truth = off_by(nominal, scene.deviation, draw);
  const std::vector<double> desired = desired_path(scene, draw);
  const auto stride = static_cast<std::size_t>(std::lround(1.0 / (kTick_s * scene.rate_hz)));
  const double count_rad = kTwoPi / 4000.0 / kReduction;
  using record::Role;
  record::Recording recording;
  recording.source = "generated";
  recording.channels = {{"elbow.desired", "rad", Role::kDesiredPosition, "elbow"},
                        {"elbow.motor", "rad", Role::kMotorPosition, "elbow"},
                        {"elbow.truth", "rad", Role::kJointTruth, "elbow"},
                        {"elbow.torque", "N_m", Role::kDriveTorque, "elbow"}};
  const std::size_t rows = desired.size() / stride;
  recording.samples.resize(static_cast<Eigen::Index>(rows), 4);
  Arm arm;
  if (scene.rest_s > 0.0) arm.rest_on_one_side(truth, scene.mount_rad);
  ColouredNoise fast, slow, torque;
  std::vector<double> past;
  double last = 0.0;
  for (std::size_t i = 0; i < rows * stride; ++i) {
    const double t_s = static_cast<double>(i) * kTick_s;
    const bool late = t_s > 0.6 * scene.duration_s;
    const double measured =
        std::round(arm.motor / count_rad) * count_rad + (late ? truth.lost_rad : 0.0);
    const double wanted_rate = i > 0 ? (desired[i] - desired[i - 1]) / kTick_s : 0.0;
    const double effort =
        361.0 * (desired[i] - measured) + 9.6 * (wanted_rate - (measured - last) / kTick_s);
    last = measured;
    past.push_back(arm.joint);
    const double wander = 0.05 * torque.step(draw, kTick_s, 2.0);
    if (i % stride == 0) {
      const auto row = static_cast<Eigen::Index>(i / stride);
      const double dt_s = 1.0 / scene.rate_hz;
      const auto back = std::min(i, static_cast<std::size_t>(truth.delay_s / kTick_s));
      recording.t_ns.push_back(static_cast<std::int64_t>(i) * 1'000'000);
      recording.samples.row(row) << desired[i], measured * kReduction,
          past[i - back] + truth.offset_rad + truth.drift_rad * (1.0 - std::exp(-t_s / kWarmUp_s)) +
              1.4e-4 * draw.normal() + 2.1e-4 * fast.step(draw, dt_s, 3.0) +
              1.5e-4 * slow.step(draw, dt_s, 120.0),
          effort * kGearbox / kReduction;
    }
    for (int k = 0; k < kInner; ++k)
      arm.step(truth, effort, late ? truth.slip_rad : 0.0, wander, scene.mount_rad);
  }
  return recording;
}

std::string arm_plant(const std::string& concealed, double mount_rad) {
  const std::string gravity = "[" + std::to_string(9.81 * std::cos(mount_rad)) + ", " +
                              std::to_string(-9.81 * std::sin(mount_rad)) + ", 0.0]";
  std::string text = R"([robot]
name = "one joint"
gravity_m_per_s2 = )" +
                     gravity + R"(
tool_joints_rad = [0.0, 0.0, 0.0, 0.0]

[[joint]]
name = "elbow"
kind = "revolute"
motor_inertia_kg_m2 = 2.3032e-5
gearbox_ratio = 12.25
reduction = 121.5
joint_encoder_resolution_rad = 1e-5

  [joint.link]
  mass_kg = 0.6
  com_m = [0.35, 0.0, 0.0]
  inertia_kg_m2 = [0.0, 0.0, 0.12]

  [joint.drive]
  input = "torque_n_m"
)";
  const auto add = [&](const std::string& id, const std::string& numbers) {
    if (id != concealed) text += "\n  [[joint.effect]]\n  id = \"" + id + "\"\n" + numbers;
  };
  add("coulomb_friction", "  level_n_m = 2.5\n");
  add("viscous_friction", "  damping_n_m_s_per_rad = 2.4\n");
  add("compliance", "  stiffness_n_m_per_rad = 400\n  damping_n_m_s_per_rad = 3\n");
  add("joint_friction", "  level_n_m = 0.5\n  presliding_rad = 0.0004\n");
  return text;
}

}  // namespace ravencal::generator
