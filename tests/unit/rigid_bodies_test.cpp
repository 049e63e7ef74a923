// SPDX-License-Identifier: Apache-2.0
//
// Rigid bodies of plants that state their frames, against closed forms.
#include "physics/rigid_bodies.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <filesystem>
#include <functional>

#include "physics/arm_dynamics.hpp"
#include "physics/plant_effort.hpp"
#include "physics/plant_writer.hpp"

namespace ravencal::physics {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

Plant double_pendulum() {
  auto plant =
      load_plant(std::filesystem::path(RAVENCAL_SOURCE_DIR) / "tools/plants/double_pendulum.toml");
  EXPECT_TRUE(plant.ok()) << plant.error().message;
  return *plant;
}

/// Two links that hang (Spong, Robot Modeling and Control, 2nd ed., 6.4, angles from the vertical).
Vector2d closed_form(const Plant& plant, const Vector2d& q, const Vector2d& v, const Vector2d& a) {
  const Link& one = plant.joints[0].link;
  const Link& two = plant.joints[1].link;
  const double l = plant.joints[1].frame->position_m[0];
  const double r1 = one.com_m[0], r2 = two.com_m[0];
  const double i1 = one.inertia_kg_m2[2] + one.mass_kg * r1 * r1;
  const double i2 = two.inertia_kg_m2[2] + two.mass_kg * r2 * r2;
  const double c = two.mass_kg * l * r2 * std::cos(q[1]);
  const double s = two.mass_kg * l * r2 * std::sin(q[1]);
  const double g = plant.robot.gravity_m_per_s2[0];
  const double m11 = i1 + i2 + two.mass_kg * l * l + 2.0 * c;
  const double elbow_weight = two.mass_kg * g * r2 * std::sin(q[0] + q[1]);
  return {m11 * a[0] + (i2 + c) * a[1] - s * (2.0 * v[0] * v[1] + v[1] * v[1]) +
              (one.mass_kg * r1 + two.mass_kg * l) * g * std::sin(q[0]) + elbow_weight,
          (i2 + c) * a[0] + i2 * a[1] + s * v[0] * v[0] + elbow_weight};
}

TEST(RigidBodies, OfADoublePendulumAreTheClosedForm) {
  const Plant plant = double_pendulum();
  auto bodies = RigidBodies::create(plant);
  ASSERT_TRUE(bodies.ok()) << bodies.error().message;
  for (int k = 0; k < 20; ++k) {
    const Vector2d q(0.3 * k, -0.7 * k), v(1.0 - 0.2 * k, 0.5 * k), a(2.0 * k - 9.0, 11.0 - k);
    const VectorXd got = bodies->efforts(q, v, a);
    EXPECT_NEAR((got - closed_form(plant, q, v, a)).norm(), 0.0, 1e-9) << k;
    const VectorXd of_unit =
        closed_form(plant, q, {0, 0}, {1, 0}) - closed_form(plant, q, {0, 0}, {0, 0});
    EXPECT_NEAR((bodies->mass_matrix(q).col(0) - of_unit).norm(), 0.0, 1e-9) << k;
  }
}

/// The frames of a RAVEN arm after its Denavit-Hartenberg table.
Plant raven_with_frames(Arm arm) {
  auto plant = load_plant(std::filesystem::path(RAVENCAL_SOURCE_DIR) / "tools/plants/raven2.toml");
  EXPECT_TRUE(plant.ok());
  const DhTable& dh = dh_table(arm);
  for (std::size_t j = 0; j < 3; ++j) {
    const Eigen::Quaterniond turn(
        Eigen::AngleAxisd(dh.alpha_rad[j], Eigen::Vector3d::UnitX()) *
        Eigen::AngleAxisd(dh.theta_offset_rad[j], Eigen::Vector3d::UnitZ()));
    Frame frame;
    if (j > 0) frame.carried_by = plant->joints[j - 1].name;
    frame.position_m = {dh.a_m[j], -std::sin(dh.alpha_rad[j]) * dh.d_m[j],
                        std::cos(dh.alpha_rad[j]) * dh.d_m[j]};
    frame.rotation = {turn.w(), turn.x(), turn.y(), turn.z()};
    plant->joints[j].frame = frame;
  }
  plant->payload.mass_kg = 0.4;
  return *plant;
}

TEST(RigidBodies, OfARavenAreTheTwinsOwn) {
  for (const Arm arm : {Arm::kGold, Arm::kGreen}) {
    const Plant plant = raven_with_frames(arm);
    ArmDynamics twin(plant, arm, true);
    auto bodies = RigidBodies::create(plant);
    ASSERT_TRUE(bodies.ok()) << bodies.error().message;
    for (int k = 0; k < 20; ++k) {
      const Vector3d q(0.1 * k, 1.0 + 0.05 * k, 0.3 + 0.01 * k), v(1.0 - 0.1 * k, 0.2 * k, 0.1),
          a(2.0 - k, 0.5 * k, 1.0);
      const Vector3d wanted = twin.gravity(q) + twin.coriolis(q, v) + twin.mass_matrix(q) * a;
      EXPECT_NEAR((bodies->efforts(q, v, a) - wanted).norm(), 0.0, 1e-9 * (1.0 + wanted.norm()));
      EXPECT_NEAR((bodies->mass_matrix(q) - twin.mass_matrix(q)).norm(), 0.0, 1e-9);
      const VectorXd by_numbers = bodies->efforts_per_number(q, v, a) * inertial_numbers(plant);
      EXPECT_NEAR((by_numbers - wanted).norm(), 0.0, 1e-9 * (1.0 + wanted.norm()));
    }
  }
}

/// Bodies without mass weigh nothing, and efforts are linear in the masses.
TEST(RigidBodies, TakeMassesAndMomentsThatNoSolidHas) {
  Plant plant = double_pendulum();
  plant.joints[0].link = {};
  plant.joints[1].link.mass_kg = 0.0;
  plant.joints[1].link.inertia_kg_m2 = {0.0, 0.0, 0.25};
  auto bodies = RigidBodies::create(plant);
  ASSERT_TRUE(bodies.ok()) << bodies.error().message;
  const VectorXd effort = bodies->efforts(Vector2d(0.4, 0.2), Vector2d(1, 2), Vector2d(0, 2));
  EXPECT_NEAR(effort[0], 0.5, 1e-12);
  EXPECT_NEAR(effort[1], 0.5, 1e-12);
}

/// The library has a short way for bodies that slide along the axes.
TEST(RigidBodies, ThatSlideHaveThePlantsMass) {
  Plant plant = double_pendulum();
  for (Joint& joint : plant.joints) joint.kind = JointKind::kPrismatic;
  plant.joints[1].frame->axis = {1.0, 0.0, 0.0};
  auto bodies = RigidBodies::create(plant);
  ASSERT_TRUE(bodies.ok()) << bodies.error().message;
  const Eigen::MatrixXd mass = bodies->mass_matrix(Vector2d(0.1, 0.2));
  EXPECT_NEAR(mass(0, 0), 0.5594 + 0.6043, 1e-12);
  EXPECT_NEAR(mass(1, 1), 0.6043, 1e-12);
  EXPECT_NEAR(mass(0, 1), 0.0, 1e-12);
}

TEST(RigidBodies, OfATreeAnswerInThePlantsOrder) {
  Plant plant = double_pendulum();
  Joint twin = plant.joints[1];
  twin.name = "other elbow";
  twin.link.mass_kg = 0.0;
  twin.link.inertia_kg_m2 = {};
  plant.joints.push_back(twin);
  plant.coupling.assign(3, std::vector<double>(3, 0.0));
  auto bodies = RigidBodies::create(plant);
  ASSERT_TRUE(bodies.ok()) << bodies.error().message;
  const VectorXd effort =
      bodies->efforts(Vector3d(0.4, 0.2, 0.1), Vector3d(1, 2, 3), Vector3d(1, 2, 3));
  const Vector2d wanted = closed_form(plant, Vector2d(0.4, 0.2), Vector2d(1, 2), Vector2d(1, 2));
  EXPECT_NEAR((effort.head(2) - wanted).norm(), 0.0, 1e-9);
  EXPECT_NEAR(effort[2], 0.0, 1e-12);
}

TEST(RigidBodies, AreReadBackAsTheyWereWritten) {
  const Plant plant = raven_with_frames(Arm::kGold);
  const auto again = parse_plant(plant_text(plant), "again");
  ASSERT_TRUE(again.ok()) << again.error().message;
  for (std::size_t j = 0; j < 3; ++j) {
    EXPECT_EQ(again->joints[j].frame->carried_by, plant.joints[j].frame->carried_by);
    for (std::size_t k = 0; k < 4; ++k)
      EXPECT_NEAR(again->joints[j].frame->rotation[k], plant.joints[j].frame->rotation[k], 1e-12);
  }
}

/// No geometry is taken for granted: the same arm without frames weighs nothing, and says so.
TEST(RigidBodies, OfAPlantThatStatesNoFramesWeighNothing) {
  Plant plant = double_pendulum();
  const std::vector<VectorXd> tilted(2, VectorXd::Constant(1, 0.5));
  EXPECT_FALSE(lacks_geometry(plant));
  EXPECT_GT(holding_efforts(plant, tilted)[0][0], 1.0);
  for (Joint& joint : plant.joints) joint.frame.reset();
  EXPECT_TRUE(lacks_geometry(plant));
  EXPECT_EQ(holding_efforts(plant, tilted)[0].size(), 0);
}

TEST(RigidBodies, NeedAWholeGeometry) {
  const auto flaw = [](const std::function<void(Plant&)>& spoil) {
    Plant plant = double_pendulum();
    spoil(plant);
    const auto read = parse_plant(plant_text(plant), "spoilt");
    return read.ok() ? std::string("none") : read.error().message;
  };
  EXPECT_EQ(flaw([](Plant&) {}), "none");
  EXPECT_NE(flaw([](Plant& p) { p.joints[1].frame.reset(); }).find("all joints need one"),
            std::string::npos);
  EXPECT_NE(flaw([](Plant& p) { p.joints[0].frame->carried_by = "elbow"; }).find("no joint before"),
            std::string::npos);
  EXPECT_NE(flaw([](Plant& p) { p.joints[0].frame->axis = {}; }).find("axis must not be zero"),
            std::string::npos);
}

}  // namespace
}  // namespace ravencal::physics
