// SPDX-License-Identifier: Apache-2.0
//
// An arm whose elbow is moved by its shoulder as well: its cable runs over the shoulder's link, or
// the shoulder's drive turns its pulley. Joints follow zig-zags; cables and motors follow from what
// they carry, quasi-statically. Shared with what is tested: the links' weight (holding_efforts).
// Virtual work, springs, frictions, drives and noise are written down here.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "diagnose/diagnose.hpp"
#include "physics/plant_effort.hpp"

namespace {

using namespace ravencal;
using Eigen::Index;
using Eigen::VectorXd;
using physics::Through;

constexpr double kStep_s = 0.04;
constexpr Index kRows = 6000;
constexpr std::size_t kJoints = 3;
constexpr double kCoupling = -0.3;  // elbow per shoulder

struct Axis {
  const char* name;
  double low, high, speed, coulomb, viscous, behind, presliding, stiffness;
  double effort_noise, position_noise;
};
constexpr Axis kAxes[kJoints] = {
    {"shoulder", 0.4, 1.0, 0.03, 1.5, 2.5, 0.45, 5e-4, 250.0, 0.05, 1.5e-4},
    {"elbow", 0.9, 2.0, 0.06, 1.4, 2.2, 0.5, 5e-4, 300.0, 0.05, 1.5e-4},
    {"insertion", 0.34, 0.42, 0.004, 13.0, 700.0, 1.5, 2e-5, 30000.0, 0.6, 1e-5}};

/// `way`: of the elbow's cable; empty: the plant does not say.
physics::Plant plant_of(const std::string& way) {
  constexpr const char* kLinks[kJoints] = {
      "mass_kg = 0.494\ncom_m = [0.0065, 0.09775, -0.13771]\ninertia_kg_m2 = [0, 0, 0]\n",
      "mass_kg = 0.75\ncom_m = [-0.002, -0.18274, -0.23053]\ninertia_kg_m2 = [0, 0, 0]\n",
      "mass_kg = 0.231\ncom_m = [0, 0, 0]\ninertia_kg_m2 = [0, 0, 0]\n"};
  std::string text =
      "coupling = [[0, 0, 0], [-0.3, 0, 0], [0, 0, 0]]\n[robot]\nname = \"raven2\"\n"
      "arm = \"gold\"\ngravity_m_per_s2 = [-9.8, 0, 0]\ntool_joints_rad = [0, 0, 0, 0]\n";
  for (std::size_t j = 0; j < kJoints; ++j) {
    const Axis& axis = kAxes[j];
    const bool slides = j == 2;
    const auto number = [&](const char* key, const char* of_turning, const char* of_sliding,
                            double value) {
      return std::string(key) + (slides ? of_sliding : of_turning) + " = " + std::to_string(value) +
             "\n";
    };
    text += std::string("[[joint]]\nname = \"") + axis.name + "\"\nkind = \"" +
            (slides ? "prismatic" : "revolute") +
            "\"\nmotor_inertia_kg_m2 = 0.0001\ngearbox_ratio = 1.0\n" +
            number("reduction", "", "_rad_per_m", 1.0) +
            number("joint_encoder_resolution", "_rad", "_m", 1e-5);
    if (j == 1 && !way.empty()) text += "coupling_through = \"" + way + "\"\n";
    text += std::string("[joint.link]\n") + kLinks[j] + "[joint.drive]\ninput = \"torque_n_m\"\n" +
            "[[joint.effect]]\nid = \"compliance\"\n" +
            number("stiffness", "_n_m_per_rad", "_n_per_m", axis.stiffness) +
            number("damping", "_n_m_s_per_rad", "_n_s_per_m", 0.0) +
            "[[joint.effect]]\nid = \"joint_friction\"\n" +
            number("level", "_n_m", "_n", axis.behind) +
            number("presliding", "_rad", "_m", axis.presliding) +
            "[[joint.effect]]\nid = \"coulomb_friction\"\n" +
            number("level", "_n_m", "_n", axis.coulomb) +
            "[[joint.effect]]\nid = \"viscous_friction\"\n" +
            number("damping", "_n_m_s_per_rad", "_n_s_per_m", axis.viscous);
  }
  auto plant = physics::parse_plant(text, "test plant");
  EXPECT_TRUE(plant.ok()) << (plant.ok() ? "" : plant.error().message);
  return plant.value();
}

class Noise {
 public:
  explicit Noise(std::uint64_t seed) : engine_(seed) {}
  double uniform() { return static_cast<double>(engine_() >> 11U) * 0x1.0p-53; }
  double normal() {
    double sum = -6.0;
    for (int i = 0; i < 12; ++i) sum += uniform();
    return sum;
  }

 private:
  std::mt19937_64 engine_;
};

/// Zig-zags with uneven turns between the ends of the range.
VectorXd zig_zag(const Axis& axis, Noise& noise) {
  VectorXd path(kRows);
  double x = 0.5 * (axis.low + axis.high), target = axis.high, v = 0.0;
  for (Index i = 0; i < kRows; ++i) {
    v += 0.25 * ((x < target ? axis.speed : -axis.speed) - v);
    if (std::abs(x - target) < 1.5 * axis.speed * kStep_s) {
      const bool high = target > 0.5 * (axis.low + axis.high);
      const double reach = high ? 0.4 * noise.uniform() : 1.0 - 0.4 * noise.uniform();
      target = axis.low + (axis.high - axis.low) * reach;
    }
    path[i] = x += v * kStep_s;
  }
  return path;
}

/// Elastic while the joint turns back, then sliding.
VectorXd friction(const VectorXd& path, double level, double presliding) {
  VectorXd out = VectorXd::Zero(path.size());
  double bristle = 0.0;
  for (Index i = 1; i < path.size(); ++i) {
    bristle = std::clamp(bristle + (path[i] - path[i - 1]) / presliding, -1.0, 1.0);
    out[i] = level * bristle;
  }
  return out;
}

VectorXd rate_of(const VectorXd& path) {
  VectorXd out = VectorXd::Zero(path.size());
  out.tail(kRows - 1) = (path.tail(kRows - 1) - path.head(kRows - 1)) / kStep_s;
  return out;
}

struct Truth {
  Through way = Through::kLink;
  double softer = 1.0;   ///< factor of the shoulder's compliance
  double gap_rad = 0.0;  ///< half-width of a gap in the shoulder's cable
};

record::Recording recorded(const Truth& truth, std::uint64_t seed) {
  Noise noise(seed);
  std::vector<VectorXd> q, tension, end, effort;
  for (const Axis& axis : kAxes) q.push_back(zig_zag(axis, noise));
  const auto weight = physics::holding_efforts(plant_of({}), q);
  for (std::size_t j = 0; j < kJoints; ++j)
    tension.push_back(weight[j] + friction(q[j], kAxes[j].behind, kAxes[j].presliding));
  if (truth.way == Through::kLink) tension[0] += kCoupling * tension[1];
  for (std::size_t j = 0; j < kJoints; ++j)
    end.push_back(q[j] + (j == 0 ? truth.softer : 1.0) / kAxes[j].stiffness * tension[j]);
  end[0] += truth.gap_rad * tension[0].array().sign().matrix();
  std::vector<VectorXd> motor = end;
  motor[1] -= kCoupling * (truth.way == Through::kLink ? q[0] : end[0]);
  std::vector<VectorXd> felt = tension;
  if (truth.way == Through::kDrive) felt[0] += kCoupling * tension[1];
  record::Recording out;
  out.source = "coupled arm";
  out.samples.resize(kRows, 3 * kJoints);
  for (Index i = 0; i < kRows; ++i) out.t_ns.push_back(std::llround(1e9 * kStep_s * double(i)));
  for (std::size_t j = 0; j < kJoints; ++j) {
    const Axis& axis = kAxes[j];
    const std::string name = axis.name, unit = j == 2 ? "m" : "rad";
    out.channels.push_back({name + ".motor", "rad", record::Role::kMotorPosition, name});
    out.channels.push_back({name + ".truth", unit, record::Role::kJointTruth, name});
    out.channels.push_back({name + ".torque", "N_m", record::Role::kDriveTorque, name});
    felt[j] +=
        friction(motor[j], axis.coulomb, 0.6 * axis.presliding) + axis.viscous * rate_of(motor[j]);
    double pushed = 0.0, read = 0.0;
    for (Index i = 0; i < kRows; ++i) {
      pushed = 0.96 * pushed + 0.28 * noise.normal();
      read = 0.9 * read + 0.43 * noise.normal();
      const auto column = static_cast<Index>(3 * j);
      out.samples(i, column) = motor[j][i];
      out.samples(i, column + 1) = q[j][i] + axis.position_noise * read;
      out.samples(i, column + 2) = felt[j][i] + axis.effort_noise * pushed;
    }
  }
  return out;
}

diagnose::Report found(const record::Recording& recording, const physics::Plant& plant) {
  diagnose::Options options;
  options.threads = 1;
  options.placebos = 0;
  auto report = diagnose::diagnose({recording}, {}, plant, options);
  EXPECT_TRUE(report.ok()) << (report.ok() ? "" : report.error().message);
  return report.value();
}

std::string names_in(const diagnose::Report& report) {
  std::string names;
  for (const auto& e : report.effects)
    names += e.joint + "/" + e.stage + "/" + e.id + (e.from.empty() ? "" : " from " + e.from) + " ";
  return names + report.verdict.text;
}

/// Nothing is missing in the plant but one word: by which way the elbow's cable goes.
void expect_no_name(Through way, std::uint64_t seed) {
  const physics::Plant silent = plant_of({});
  const auto report = found(recorded({.way = way}, seed), silent);
  for (const auto& effect : report.effects) EXPECT_EQ(effect.id, "unknown") << names_in(report);
  ASSERT_EQ(report.routings.size(), 1U);
  EXPECT_EQ(report.routings.front().through, physics::through_word(way));
  EXPECT_FALSE(report.routings.front().by_plant);
  EXPECT_NE(report.verdict.text.find("elbow's cable"), std::string::npos);
  EXPECT_EQ(report.improved.joints[1].coupling_through, way);
}

TEST(CoupledCable, GetsNoNameOverALinkWhereThePlantIsSilent) { expect_no_name(Through::kLink, 3); }

TEST(CoupledCable, GetsNoNameOverADriveWhereThePlantIsSilent) {
  expect_no_name(Through::kDrive, 4);
}

TEST(CoupledCable, IsTakenAsThePlantSays) {
  const auto recording = recorded({.way = Through::kLink}, 5);
  const auto right = found(recording, plant_of("link"));
  for (const auto& effect : right.effects) EXPECT_EQ(effect.id, "unknown") << names_in(right);
  ASSERT_EQ(right.routings.size(), 1U);
  EXPECT_TRUE(right.routings.front().by_plant);
  // A plant that says the wrong way lacks what it denies.
  const auto wrong = found(recording, plant_of("drive"));
  EXPECT_FALSE(wrong.effects.empty() && wrong.unexplained.empty()) << names_in(wrong);
}

/// What the way of a cable does not explain keeps its name.
TEST(CoupledCable, LeavesTheNamesThatNoWayExplains) {
  const auto gap = found(recorded({.way = Through::kDrive, .gap_rad = 1.5e-3}, 6), plant_of({}));
  ASSERT_EQ(gap.effects.size(), 1U) << names_in(gap);
  EXPECT_EQ(gap.effects.front().id, "backlash") << names_in(gap);
  EXPECT_EQ(gap.effects.front().joint, "shoulder");
  const auto soft = found(recorded({.way = Through::kLink, .softer = 1.5}, 7), plant_of({}));
  ASSERT_EQ(soft.effects.size(), 1U) << names_in(soft);
  EXPECT_EQ(soft.effects.front().id, "compliance") << names_in(soft);
  EXPECT_TRUE(soft.effects.front().out_of_tolerance);
}

}  // namespace
