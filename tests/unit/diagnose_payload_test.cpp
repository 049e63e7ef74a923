// SPDX-License-Identifier: Apache-2.0
//
// A weight at the tool is one cause for what every joint of the arm carries; where no drive was
// recorded, weights are seen by what they stretch.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "diagnose/diagnose.hpp"
#include "diagnose/effects/effects.hpp"
#include "diagnose/effects/shapes.hpp"
#include "diagnose/selection/invariance.hpp"
#include "diagnose/selection/selection.hpp"
#include "diagnose_arm.hpp"
#include "diagnose_form.hpp"
#include "physics/plant_effort.hpp"

namespace {

using namespace ravencal;
using Eigen::Index;
using Eigen::VectorXd;

constexpr double kStep_s = 0.04;
constexpr Index kRows = 6000;
constexpr int kJoints = 3;

struct Drive {
  const char* name;
  double low, high, speed, coulomb, viscous, noise;
};
constexpr Drive kDrives[kJoints] = {{"shoulder", 0.4, 1.0, 0.03, 1.5, 2.5, 0.05},
                                    {"elbow", 0.9, 2.6, 0.06, 1.4, 2.2, 0.05},
                                    {"insertion", 0.34, 0.42, 0.004, 13.0, 700.0, 0.6}};

std::string arm_text(double payload_kg, bool shoulder_rubs) {
  constexpr const char* kLinks[kJoints] = {
      "mass_kg = 0.494\n  com_m = [0.0065, 0.09775, -0.13771]\n"
      "  inertia_kg_m2 = [0.017376, 0.011, 0.006499]\n",
      "mass_kg = 0.75\n  com_m = [-0.002, -0.18274, -0.23053]\n"
      "  inertia_kg_m2 = [0.081579, 0.044329, 0.037686]\n",
      "mass_kg = 0.231\n  com_m = [0, 0, 0]\n  inertia_kg_m2 = [0.0029, 0.003, 0.000355]\n"};
  std::string text =
      "[robot]\nname = \"raven2\"\narm = \"gold\"\ngravity_m_per_s2 = [-9.8, 0, 0]\n"
      "tool_joints_rad = [0.0, 0.0, 0.0, 0.0]\n";
  if (payload_kg > 0.0)
    text += "\n[payload]\nmass_kg = " + std::to_string(payload_kg) + "\ncom_m = [0, 0, 0]\n";
  for (int j = 0; j < kJoints; ++j) {
    const bool slides = j == 2;
    text += std::string("\n[[joint]]\nname = \"") + kDrives[j].name + "\"\nkind = \"" +
            (slides ? "prismatic" : "revolute") +
            "\"\nmotor_inertia_kg_m2 = 0.01\ngearbox_ratio = 1.0\n" +
            (slides ? "reduction_rad_per_m = 1.0\njoint_encoder_resolution_m = 5e-6\n"
                    : "reduction = 1.0\njoint_encoder_resolution_rad = 1e-5\n") +
            "\n  [joint.link]\n  " + kLinks[j] + "\n  [joint.drive]\n  input = \"torque_n_m\"\n";
    if (j > 0 || shoulder_rubs)
      text += std::string("\n  [[joint.effect]]\n  id = \"coulomb_friction\"\n  level_n") +
              (slides ? "" : "_m") + " = " + std::to_string(kDrives[j].coulomb) + "\n";
    text += std::string("\n  [[joint.effect]]\n  id = \"viscous_friction\"\n  damping_n_") +
            (slides ? "s_per_m" : "m_s_per_rad") + " = " + std::to_string(kDrives[j].viscous) +
            "\n";
  }
  return text;
}

physics::Plant parsed(const std::string& text) {
  auto plant = physics::parse_plant(text, "test plant");
  EXPECT_TRUE(plant.ok()) << (plant.ok() ? "" : plant.error().message);
  return plant.value();
}

/// Zig-zags of three joints whose drives carry the weight of their links and the payload, rub, and
/// are pushed about by slow noise.
struct Truth {
  double payload_kg = 0.0;
  double load_share = 0.0, asymmetry = 0.0;  ///< of the elbow's dry friction
};
record::Recording recorded(const Truth& truth, std::uint64_t seed) {
  std::mt19937_64 engine(seed);
  const auto uniform = [&] { return static_cast<double>(engine() >> 11U) * 0x1.0p-53; };
  const auto normal = [&] {
    double sum = -6.0;
    for (int i = 0; i < 12; ++i) sum += uniform();
    return sum;
  };
  std::vector<VectorXd> q(kJoints, VectorXd(kRows));
  for (int j = 0; j < kJoints; ++j) {
    const Drive& d = kDrives[j];
    double x = 0.5 * (d.low + d.high), target = d.high, v = 0.0;
    for (Index i = 0; i < kRows; ++i) {
      v += 0.25 * ((x < target ? d.speed : -d.speed) - v);
      if (std::abs(x - target) < 1.5 * d.speed * kStep_s)
        target =
            d.low + (d.high - d.low) *
                        (target > 0.5 * (d.low + d.high) ? 0.4 * uniform() : 1.0 - 0.4 * uniform());
      q[static_cast<std::size_t>(j)][i] = x += v * kStep_s;
    }
  }
  const auto weights = physics::holding_efforts(parsed(arm_text(truth.payload_kg, true)), q);
  record::Recording recording;
  recording.source = "generated";
  recording.samples.resize(kRows, 2 * kJoints);
  for (Index i = 0; i < kRows; ++i)
    recording.t_ns.push_back(std::llround(1e9 * kStep_s * static_cast<double>(i)));
  for (int j = 0; j < kJoints; ++j) {
    const Drive& d = kDrives[j];
    const bool slides = j == 2;
    recording.channels.push_back({std::string(d.name) + ".estimate", slides ? "m" : "rad",
                                  record::Role::kJointEstimate, d.name});
    recording.channels.push_back({std::string(d.name) + ".torque", slides ? "N" : "N_m",
                                  record::Role::kDriveTorque, d.name});
    const VectorXd& x = q[static_cast<std::size_t>(j)];
    double bristle = 0.0, slow = 0.0;
    for (Index i = 0; i < kRows; ++i) {
      const double moved = i > 0 ? x[i] - x[i - 1] : 0.0;
      bristle = std::clamp(bristle + moved / (slides ? 3e-5 : 3e-4), -1.0, 1.0);
      slow = 0.96 * slow + 0.28 * normal();
      const double load = weights[static_cast<std::size_t>(j)][i];
      const double dry = (d.coulomb + (j == 1 ? truth.load_share : 0.0) * std::abs(load)) *
                         (1.0 + (j == 1 ? truth.asymmetry : 0.0) * bristle) * bristle;
      recording.samples(i, 2 * j) = x[i];
      recording.samples(i, 2 * j + 1) = load + dry + d.viscous * moved / kStep_s + d.noise * slow;
    }
  }
  return recording;
}

std::string names_in(const diagnose::Report& report) {
  std::string names;
  for (const auto& e : report.effects) names += e.joint + "/" + e.stage + "/" + e.id + " ";
  return names + report.verdict.text;
}

diagnose::Report found(const record::Recording& recording, const physics::Plant& plant) {
  diagnose::Options options;
  options.threads = 1;
  auto report = diagnose::diagnose({recording}, {}, plant, options);
  EXPECT_TRUE(report.ok()) << (report.ok() ? "" : report.error().message);
  return report.value();
}

/// Dry friction that the plant lacks as well hides behind what stands in for the weight.
TEST(ArmPayload, IsOneNameForWhatAllJointsCarryBesideFrictionOfOne) {
  const auto report = found(recorded({.payload_kg = 0.3}, 3), parsed(arm_text(0.0, false)));
  ASSERT_EQ(report.effects.size(), 2U) << names_in(report);
  const auto of = [&](const char* id) {
    return std::find_if(report.effects.begin(), report.effects.end(),
                        [&](const diagnose::NamedEffect& e) { return e.id == id; });
  };
  ASSERT_NE(of("payload"), report.effects.end()) << names_in(report);
  ASSERT_NE(of("coulomb_friction"), report.effects.end()) << names_in(report);
  EXPECT_EQ(of("coulomb_friction")->joint, "shoulder");
  EXPECT_NEAR(of("payload")->parameters.front().value, 0.3, 0.03);
}

/// The friction behind the cable holds a payload as it holds the link, at rest before the first
/// motion above all: the drive feels what a cable with both on it passes on.
TEST(Payload, LoadsTheDriveThroughTheCableAndItsFriction) {
  constexpr double kMount_rad = 0.2, kPayload_kg = 0.3;
  const auto plant = parsed(generator::arm_plant({}, kMount_rad));
  const auto recording =
      generator::record_arm({}, {.seed = 11, .rest_s = 30.0, .mount_rad = kMount_rad});
  const auto set = diagnose::build_series({recording}, {}, plant, {});
  ASSERT_TRUE(set.ok());
  int drives = 0;
  for (const diagnose::Series& s : set->series) {
    if (s.stage != diagnose::Stage::kDrive) continue;
    ++drives;
    const VectorXd loaded = s.weight + kPayload_kg * s.payload_per_kg;
    const VectorXd felt =
        diagnose::cable_tension(s, loaded, s.cable) - diagnose::cable_tension(s, s.weight, s.cable);
    const VectorXd found = kPayload_kg * diagnose::payload()->columns(s, {}).col(0);
    EXPECT_LT((found - felt).norm(), 0.05 * felt.norm());
  }
  EXPECT_EQ(drives, 1);
}

/// Each joint's plant could be off by that much, but not all of them towards one weight.
TEST(ArmPayload, IsWeighedByTheArmWhereNoJointNamesItAlone) {
  const auto plant = parsed(arm_text(0.0, true));
  const auto report = found(recorded({.payload_kg = 0.05}, 5), plant);
  ASSERT_EQ(report.effects.size(), 1U) << names_in(report);
  EXPECT_EQ(report.effects.front().id, "payload") << names_in(report);
  EXPECT_NEAR(report.effects.front().parameters.front().value, 0.05, 0.02);
  EXPECT_TRUE(found(recorded({}, 5), plant).effects.empty());
}

/// What load adds to friction differs between the directions where friction does: no proxy's mark.
TEST(LoadDependentFriction, MayDifferBetweenTheDirectionsWhereFrictionDoes) {
  const auto plant = parsed(arm_text(0.0, true));
  const auto set =
      diagnose::build_series({recorded({.load_share = 0.6, .asymmetry = -0.6}, 7)}, {}, plant, {});
  ASSERT_TRUE(set.ok());
  for (diagnose::Series series : set->series) {
    if (series.joint != "elbow" || series.stage != diagnose::Stage::kDrive) continue;
    // A pendulum that passes below its axis: its load varies by all of it within a direction.
    series.weight = 3.0 * (series.motion.q.array() - series.motion.q.mean()).sin().matrix();
    series.transmitted = series.weight;
    const diagnose::Nominal nominal = diagnose::nominal_of(series, plant);
    diagnose::Forms forms;
    forms.push_back(generator::form_of("load_dependent_friction"));
    diagnose::ChannelModel model = diagnose::prepare_channel(series, nominal, forms);
    const diagnose::FormCandidate& candidate = *model.candidates.front();
    model.chosen.push_back({0, candidate.shapes.front(), candidate.columns.front()});
    model.hold_nominal();
    VectorXd b = diagnose::joint_fit(model);
    const auto compares_directions = [&] {
      const auto scales = diagnose::invariance_of(model, b, 0).scales;
      return std::any_of(scales.begin(), scales.end(),
                         [](const auto& s) { return s.regime == "direction: low"; });
    };
    b[0] = 2.0 * model.floor;
    EXPECT_FALSE(compares_directions());
    b[0] = 0.0;  // even friction
    EXPECT_TRUE(compares_directions());
  }
}

/// A weight of which the plant knows nothing stretches the cable like a wrong ratio, but by the
/// sine of the angle.
TEST(Weight, IsSeenInTheStretchWhereNoDriveWasRecorded) {
  const auto named = [](const generator::ArmTruth& truth, const std::string& plant) {
    record::Recording recording = generator::record_arm(truth, {.seed = 11});
    recording.channels.pop_back();
    recording.samples.conservativeResize(Eigen::NoChange, 3);
    return found(recording, parsed(plant));
  };
  std::string weightless = generator::arm_plant();
  const auto at = weightless.find("mass_kg = 0.6");
  ASSERT_NE(at, std::string::npos);
  weightless.replace(at, 13, "mass_kg = 0.0");
  const auto lacking = named({}, weightless);
  ASSERT_EQ(lacking.effects.size(), 1U) << names_in(lacking);
  const diagnose::NamedEffect& weight = lacking.effects.front();
  const bool said = weight.id == "gravity" ||
                    std::find(weight.ambiguous_with.begin(), weight.ambiguous_with.end(),
                              "gravity") != weight.ambiguous_with.end();
  EXPECT_TRUE(said) << names_in(lacking);
  const auto hung = named({.payload_kg = 0.4}, generator::arm_plant());
  ASSERT_EQ(hung.effects.size(), 1U) << names_in(hung);
  EXPECT_EQ(hung.effects.front().stage, "drive") << names_in(hung);
}

}  // namespace
