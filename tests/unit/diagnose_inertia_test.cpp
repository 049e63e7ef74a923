// SPDX-License-Identifier: Apache-2.0
//
// What an arm of four joints carries and where its links weigh: MuJoCo moves one whose tool is
// loaded, one of whose links has its centre of mass elsewhere, or all of them by little.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <string>

#include "diagnose/diagnose.hpp"
#include "diagnose_robot_pair.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Vector3d;

/// What the robot has beside its model.
struct Fault {
  double payload_kg = 0.0;
  Vector3d payload_m = Vector3d::Zero();  ///< in the wrist's frame
  Vector3d elbow_m = Vector3d::Zero();    ///< of the forearm's centre of mass
  double all_m = 0.0;                     ///< of every link's, along directions that differ
};

std::string spaced(const Vector3d& v) { return fmt::format("{} {} {}", v[0], v[1], v[2]); }

/// Two turns about the upright and two about axes across: yaw, shoulder, elbow, wrist.
std::string arm(const Fault& f) {
  const double d = f.all_m / std::sqrt(3.0);
  const std::string payload =
      f.payload_kg > 0.0
          ? fmt::format(
                R"(<body pos="{}"><inertial pos="0 0 0" mass="{}" diaginertia="5e-4 5e-4 5e-4"/></body>)",
                spaced(f.payload_m), f.payload_kg)
          : "";
  return fmt::format(
      R"(<mujoco model="arm">
  <compiler angle="radian"/>
  <option timestep="0.0005" gravity="0 0 -9.81"/>
  <worldbody>
    <body name="shoulder" pos="0 0 0.3">
      <inertial pos="{}" mass="3" diaginertia="0.02 0.02 0.01"/>
      <joint name="j1" axis="0 0 1" damping="1" armature="0.1"/>
      <body name="upper" pos="0 0 0.05">
        <inertial pos="{}" mass="2.5" diaginertia="0.02 0.02 0.004"/>
        <joint name="j2" axis="0 1 0" damping="1" armature="0.1"/>
        <body name="fore" pos="0.03 0 0.35">
          <inertial pos="{}" mass="1.8" diaginertia="0.004 0.012 0.012"/>
          <joint name="j3" axis="0 1 0" damping="1" armature="0.1"/>
          <body name="wrist" pos="0.32 0 0.04">
            <inertial pos="{}" mass="0.8" diaginertia="0.001 0.002 0.002"/>
            <joint name="j4" axis="1 0 0" damping="0.5" armature="0.05"/>
            <body name="flange" pos="0.1 0 0"/>
            {}
          </body>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator>
    <position joint="j1" kp="2000"/>
    <position joint="j2" kp="2000"/>
    <position joint="j3" kp="1500"/>
    <position joint="j4" kp="800"/>
  </actuator>
</mujoco>)",
      spaced(Vector3d(0.01, 0.02, -0.03) + Vector3d(d, -d, d)),
      spaced(Vector3d(0.01, -0.02, 0.16) + Vector3d(-d, d, d)),
      spaced(Vector3d(0.14, 0.015, 0.02) + Vector3d(d, d, -d) + f.elbow_m),
      spaced(Vector3d(0.05, 0.01, -0.01) + Vector3d(-d, -d, d)), payload);
}

double desired_rad(double t_s, int joint, double seed) {
  constexpr double kMiddle_rad[] = {0.0, 0.6, 0.4, 0.0}, kReach_rad[] = {1.0, 0.8, 1.0, 1.6};
  const double slow_hz = 0.09 + 0.011 * seed + 0.031 * joint;
  return kMiddle_rad[joint] + kReach_rad[joint] * two_sines(slow_hz, t_s, joint, seed);
}

class DiagnoseInertia : public ::testing::Test {
 protected:
  Report diagnosed(const Fault& fault) const {
    auto report = diagnose({recording_of_mjcf(arm(fault), desired_rad, 1.0, 60.0)},
                           {recording_of_mjcf(arm(fault), desired_rad, 2.0, 40.0)}, plant_, {});
    EXPECT_TRUE(report.ok()) << report.error().message;
    return std::move(*report);
  }

  static std::string names_in(const Report& report) {
    std::string out = report.verdict.text + " ";
    for (const NamedEffect& e : report.effects) out += fmt::format("{} {}; ", e.joint, e.id);
    return out;
  }

  const physics::Plant plant_ = plant_of_mjcf(arm({}));
};

Vector3d vector_of(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }

TEST_F(DiagnoseInertia, NamesAPayloadByMassAndPlaceAndNothingElse) {
  const Vector3d place_m(0.2, 0.03, -0.04);
  const Report report = diagnosed({.payload_kg = 0.7, .payload_m = place_m});
  ASSERT_EQ(report.effects.size(), 1U) << names_in(report);
  EXPECT_EQ(report.effects[0].id, "payload");
  const physics::Payload& found = report.improved.payload;
  EXPECT_NEAR(found.mass_kg, 0.7, 0.07);
  // The link's frame has axes of its own.
  const Vector3d flange = vector_of(plant_.payload.com_m);
  const double along = flange.dot(vector_of(found.com_m)) / flange.norm();
  EXPECT_NEAR(found.mass_kg * along, 0.7 * place_m[0], 0.2 * 0.7 * place_m.norm());
  EXPECT_NEAR(found.mass_kg * vector_of(found.com_m).norm(), 0.7 * place_m.norm(),
              0.2 * 0.7 * place_m.norm());
  EXPECT_EQ(report.effects[0].parameters.size(), 4U);
}

TEST_F(DiagnoseInertia, SaysACentreOfMassAsOne) {
  const Report report = diagnosed({.elbow_m = {0.0, 0.0, 0.03}});
  ASSERT_EQ(report.effects.size(), 1U) << names_in(report);
  EXPECT_EQ(report.effects[0].id, "centre_of_mass");
  EXPECT_EQ(report.effects[0].joint, "j3");
  EXPECT_TRUE(report.effects[0].out_of_tolerance);
  const Vector3d moved =
      vector_of(report.improved.joints[2].link.com_m) - vector_of(plant_.joints[2].link.com_m);
  EXPECT_NEAR(moved.norm(), 0.03, 0.006);
}

TEST_F(DiagnoseInertia, IsSilentOfACleanArmAndOfCentresWithinTheirTolerance) {
  for (const double all_m : {0.0, 0.006}) {
    const Report report = diagnosed({.all_m = all_m});
    EXPECT_TRUE(report.effects.empty()) << all_m << " " << names_in(report);
    // Undamped servos ring above the band, so that silence is no proof.
    EXPECT_EQ(report.verdict.kind, "not_testable") << names_in(report);
    EXPECT_TRUE(report.unexplained.empty()) << names_in(report);
  }
}

}  // namespace
}  // namespace ravencal::diagnose
