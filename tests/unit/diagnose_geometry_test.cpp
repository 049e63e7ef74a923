// SPDX-License-Identifier: Apache-2.0
//
// Faults of a robot model's geometry and masses: MuJoCo moves an arm whose link is 80 mm longer,
// whose wrist stands 150 mm to the side, whose joint reads 8 degrees beside its zero, whose
// friction is twice the model's, whose tool is 60 g heavier, and pairs of these.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "diagnose/diagnose.hpp"
#include "diagnose_robot_pair.hpp"

namespace ravencal::diagnose {
namespace {

constexpr double kZero_rad = 8.0 * M_PI / 180.0;

/// What the robot has beside its model.
struct Fault {
  double length_m = 0.0, wrist_m = 0.0, damping_n_m_s_per_rad = 0.0, zero_rad = 0.0, tool_kg = 0.0;
};

/// Sizes and masses of the four-joint arm in github.com/caid-technologies/simcorrect.
std::string arm(const Fault& f) {
  return fmt::format(
      R"(<mujoco model="arm">
  <compiler angle="radian"/>
  <option timestep="0.0005" gravity="0 0 -9.81"/>
  <worldbody>
    <body name="base" pos="0 0 0.66">
      <inertial pos="0 0 0" mass="1" diaginertia="0.01 0.01 0.01"/>
      <joint name="j1" axis="0 0 1" damping="8" armature="0.05"/>
      <body name="elbow" pos="0.34 0 0">
        <inertial pos="0 0 0" mass="0.4" diaginertia="0.004 0.004 0.004"/>
        <joint name="j2" axis="0 1 0" damping="{}" armature="0.03" ref="{}"/>
        <body name="wrist" pos="{} {} 0">
          <inertial pos="0 0 0" mass="0.15" diaginertia="0.002 0.002 0.002"/>
          <joint name="j3" axis="0 1 0" damping="4" armature="0.02"/>
          <body name="wrist2" pos="0.12 0 0">
            <inertial pos="0 0 0" mass="0.1" diaginertia="0.001 0.001 0.001"/>
            <joint name="j4" axis="0 1 0" damping="3" armature="0.02"/>
            <body name="tool" pos="0.1 0 0">
              <inertial pos="0 0 0" mass="{}" diaginertia="0.001 0.001 0.001"/>
            </body>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator>
    <position joint="j1" kp="900"/>
    <position joint="j2" kp="700"/>
    <position joint="j3" kp="500"/>
    <position joint="j4" kp="400"/>
  </actuator>
</mujoco>)",
      6.0 + f.damping_n_m_s_per_rad, f.zero_rad, 0.30 + f.length_m, f.wrist_m, 0.12 + f.tool_kg);
}

double desired_rad(double t_s, int joint, double seed) {
  constexpr double kMiddle_rad[] = {0.0, 0.2, 1.0, 0.0}, kReach_rad[] = {0.9, 0.6, 0.7, 0.2};
  const double slow_hz = 0.11 + 0.013 * seed + 0.037 * joint;
  return kMiddle_rad[joint] + kReach_rad[joint] * two_sines(slow_hz, t_s, joint, seed);
}

constexpr const char* kPlaces[] = {"link_length", "link_axial", "link_across", "joint_zero"};

/// The model; what a simulation states it has exactly, and its joints stand where it says to 1 %.
physics::Plant stated_exactly() {
  physics::Plant plant = plant_of_mjcf(arm({}));
  for (physics::Joint& joint : plant.joints) {
    for (const char* key : {"inertia", "weight_scale", "viscous_friction", "torque_constant"})
      joint.tolerance[key] = 0.01;
    joint.tolerance["centre_of_mass"] = 1e-4;
    for (const char* key : kPlaces) joint.tolerance[key] = 0.01;
  }
  return plant;
}

struct Named {
  std::vector<std::string> any_of;  ///< "joint id", of which one must be named
  double value;
};

struct Case {
  std::string name;
  Fault fault;
  std::vector<Named> expected;
};

/// The wrist or the elbow to the side: they differ by where the elbow's own mass is.
const Case kSingle[] = {
    {"Length", {.length_m = 0.08}, {{{"j3 link_length"}, 0.08}}},
    {"Wrist", {.wrist_m = 0.15}, {{{"j3 link_axial", "j2 link_across"}, 0.15}}},
    {"Damping", {.damping_n_m_s_per_rad = 6.0}, {{{"j2 viscous_friction"}, 12.0}}},
    {"Zero", {.zero_rad = kZero_rad}, {{{"j2 joint_zero"}, -kZero_rad}}},
    {"Tool", {.tool_kg = 0.06}, {{{"j4 payload"}, 0.06}}},
};

/// No fault, each one and every pair.
std::vector<Case> cases() {
  std::vector<Case> all = {{"Clean", {}, {}}};
  for (const Case& one : kSingle) all.push_back(one);
  for (const Case& one : kSingle) {
    for (const Case* other = &one + 1; other != std::end(kSingle); ++other) {
      Case pair = one;
      pair.name += other->name;
      pair.fault.length_m += other->fault.length_m;
      pair.fault.wrist_m += other->fault.wrist_m;
      pair.fault.damping_n_m_s_per_rad += other->fault.damping_n_m_s_per_rad;
      pair.fault.zero_rad += other->fault.zero_rad;
      pair.fault.tool_kg += other->fault.tool_kg;
      pair.expected.push_back(other->expected.front());
      all.push_back(std::move(pair));
    }
  }
  return all;
}

/// Of a value.
constexpr double kNear = 0.04;

class DiagnoseGeometry : public ::testing::TestWithParam<Case> {};

TEST_P(DiagnoseGeometry, NamesTheFaultsWithTheirValuesAndNothingElse) {
  const Case& c = GetParam();
  constexpr double kTraining_s = 60.0, kHeldOut_s = 40.0;
  const physics::Plant plant = stated_exactly();
  const auto report =
      diagnose({recording_of_mjcf(arm(c.fault), desired_rad, 1.0, kTraining_s)},
               {recording_of_mjcf(arm(c.fault), desired_rad, 2.0, kHeldOut_s)}, plant, {});
  ASSERT_TRUE(report.ok()) << report.error().message;
  std::string found;
  for (const NamedEffect& effect : report->effects)
    found += fmt::format("{} {}; ", effect.joint, effect.id);
  EXPECT_EQ(report->effects.size(), c.expected.size()) << found;
  for (const Named& expected : c.expected) {
    const auto at =
        std::find_if(report->effects.begin(), report->effects.end(), [&](const auto& e) {
          const std::string name = e.joint + " " + e.id;
          return std::find(expected.any_of.begin(), expected.any_of.end(), name) !=
                 expected.any_of.end();
        });
    ASSERT_NE(at, report->effects.end()) << expected.any_of.front() << " in " << found;
    EXPECT_NEAR(at->parameters.front().value, expected.value, kNear * std::abs(expected.value))
        << at->id;
    EXPECT_LE(at->parameters.front().ci95.first, expected.value) << at->id;
    EXPECT_GE(at->parameters.front().ci95.second, expected.value) << at->id;
  }
}

INSTANTIATE_TEST_SUITE_P(Faults, DiagnoseGeometry, ::testing::ValuesIn(cases()),
                         [](const auto& tested) { return tested.param.name; });

TEST(DiagnoseGeometryTolerance, HoldsALinkWithinWhatThePlantStates) {
  physics::Plant plant = stated_exactly();
  plant.joints[2].tolerance["link_length"] = 0.05;
  const Fault fault{.length_m = 0.01};
  const auto report = diagnose({recording_of_mjcf(arm(fault), desired_rad, 1.0, 60.0)},
                               {recording_of_mjcf(arm(fault), desired_rad, 2.0, 40.0)}, plant, {});
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_TRUE(report->effects.empty()) << report->verdict.text;
  const auto length =
      std::find_if(report->refitted.begin(), report->refitted.end(),
                   [](const NamedEffect& e) { return e.id == "link_length" && e.joint == "j3"; });
  ASSERT_NE(length, report->refitted.end());
  EXPECT_NEAR(length->parameters.front().value, 0.01, 0.002);
}

TEST(DiagnoseGeometryTolerance, SaysNothingOfPlacesThatThePlantStatesWithoutOne) {
  const Fault fault{.length_m = 0.08};
  const auto report =
      diagnose({recording_of_mjcf(arm(fault), desired_rad, 1.0, 60.0)},
               {recording_of_mjcf(arm(fault), desired_rad, 2.0, 40.0)}, plant_of_mjcf(arm({})), {});
  ASSERT_TRUE(report.ok()) << report.error().message;
  for (const char* id : kPlaces) {
    for (const auto* said : {&report->effects, &report->refitted})
      for (const NamedEffect& effect : *said) EXPECT_NE(effect.id, id) << effect.joint;
    for (const NotFound& silent : report->not_found) {
      if (silent.id != id) continue;
      EXPECT_NE(silent.not_testable_because.find("tolerance"), std::string::npos)
          << silent.joint << " " << id << ": " << silent.not_testable_because;
    }
  }
}

}  // namespace
}  // namespace ravencal::diagnose
