// SPDX-License-Identifier: Apache-2.0
//
// Plants of robot models of others: what MuJoCo computes from the model, the plant computes as
// well.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include <filesystem>
#include <fstream>

#include "physics/plant_writer.hpp"
#include "physics/rigid_bodies.hpp"
#include "physics/robot_model/robot_file.hpp"
#include "physics/robot_model/tool_place.hpp"

namespace ravencal::physics {
namespace {

namespace fs = std::filesystem;
using Eigen::VectorXd;

/// Anchors off the bodies' origins, a body with two joints, one that no joint moves, full inertias,
/// references that are not zero, a branch.
constexpr const char* kArm = R"(<mujoco model="arm of others">
  <compiler angle="radian"/>
  <option gravity="0.3 0 -9.7"/>
  <asset><mesh name="cover" file="nowhere/cover.stl"/></asset>
  <worldbody>
    <body name="base" pos="0 0 0.4" quat="0.9 0.1 0.3 0">
      <inertial pos="0 0 0" mass="3" diaginertia="0.1 0.1 0.1"/>
      <body name="upper" pos="0.1 0.2 0.3" quat="0.7 0 0.2 0.1">
        <inertial pos="0.05 -0.02 0.1" mass="1.2" fullinertia="0.02 0.03 0.025 0.004 -0.003 0.002"/>
        <joint name="pan" axis="0 0.6 0.8" pos="0.01 0.02 -0.03" ref="0.4" damping="0.7"
               frictionloss="0.2" armature="0.05"/>
        <geom type="mesh" mesh="cover"/>
        <body name="cover" pos="0 0.1 0"><inertial pos="0.01 0 0" mass="0.3" diaginertia="1e-3 2e-3 2e-3"/></body>
        <body name="wrist" pos="0.3 0 0" quat="0.8 0.3 0 0.1">
          <inertial pos="0 0.03 0" mass="0.5" diaginertia="2e-3 3e-3 4e-3"/>
          <joint name="pitch" axis="1 0 0"/>
          <joint name="lift" type="slide" axis="0 1 1" ref="0.02" stiffness="5"/>
        </body>
        <body name="other" pos="0 0 0.2">
          <inertial pos="0.1 0 0" mass="0.4" diaginertia="1e-3 1e-3 1e-3"/>
          <joint name="roll" axis="0 0 1" pos="0 0.05 0"/>
        </body>
      </body>
    </body>
  </worldbody>
  <equality><joint joint1="roll" joint2="pan" polycoef="0 -0.5 0 0 0"/></equality>
  <actuator>
    <motor name="m" joint="pan" gear="3" ctrlrange="-1 1" forcelimited="true" forcerange="-2 2"/>
    <position name="p" joint="pitch" kp="40"/>
    <velocity name="v" joint="roll" kv="2"/>
    <motor name="second" joint="pan" gear="1"/>
  </actuator>
</mujoco>)";

class RobotModel : public ::testing::Test {
 protected:
  void SetUp() override {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  [[nodiscard]] fs::path write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
    return folder_ / name;
  }
  [[nodiscard]] core::Result<Plant> plant_of(const std::string& text) const {
    return load_plant(write("robot.xml", text));
  }
  [[nodiscard]] std::string refusal_of(const std::string& text) const {
    const auto plant = plant_of(text);
    return plant.ok() ? "none" : plant.error().message;
  }

  fs::path folder_ = fs::path(::testing::TempDir()) /
                     (std::string("robot_model_") +
                      ::testing::UnitTest::GetInstance()->current_test_info()->name());
};

std::string joined(const Plant& plant) { return fmt::format("{}", fmt::join(plant.notes, "\n")); }

TEST_F(RobotModel, MovesAsMujocoMovesIt) {
  const auto plant = plant_of(kArm);
  ASSERT_TRUE(plant.ok()) << plant.error().message;
  const auto robot = read_robot_file(folder_ / "robot.xml");
  ASSERT_TRUE(robot.ok());
  auto bodies = RigidBodies::create(*plant);
  ASSERT_TRUE(bodies.ok()) << bodies.error().message;
  mjModel* model = robot->model.get();
  mjData* data = mj_makeData(model);
  ASSERT_EQ(model->nv, 4);
  for (int k = 0; k < 10; ++k) {
    VectorXd q(4), v(4), a(4), wanted(4);
    q << 0.3 * k, 1.0 - 0.2 * k, 0.01 * k, -0.4 * k;
    v << 1.0, -0.2 * k, 0.1, 0.5 * k;
    a << -k, 2.0, 0.3 * k, 1.0;
    std::copy_n(q.data(), 4, data->qpos);
    std::copy_n(v.data(), 4, data->qvel);
    std::copy_n(a.data(), 4, data->qacc);
    mj_kinematics(model, data);
    mj_comPos(model, data);
    mj_comVel(model, data);
    mj_rne(model, data, 1, wanted.data());
    EXPECT_NEAR((bodies->efforts(q, v, a) - wanted).norm(), 0.0, 1e-9 * (1.0 + wanted.norm())) << k;
  }
  mj_deleteData(data);
}

TEST_F(RobotModel, GivesFrictionDrivesAndCouplings) {
  const auto plant = plant_of(kArm);
  ASSERT_TRUE(plant.ok()) << plant.error().message;
  ASSERT_EQ(plant->joints.size(), 4U);
  const Joint& pan = plant->joints[0];
  EXPECT_EQ(pan.name, "pan");
  EXPECT_EQ(pan.motor_inertia_kg_m2, 0.05);
  EXPECT_EQ(pan.parameter("viscous_friction", "damping"), 0.7);
  EXPECT_EQ(pan.parameter("coulomb_friction", "level"), 0.2);
  EXPECT_EQ(pan.parameter("saturation", "limit"), 6.0);
  EXPECT_EQ(pan.drive.gain, 3.0);
  ASSERT_TRUE(plant->joints[1].controller);
  EXPECT_EQ(plant->joints[1].controller->kp_n_m_per_rad, 40.0);
  EXPECT_EQ(plant->joints[2].kind, JointKind::kPrismatic);
  EXPECT_EQ(plant->coupling[3][0], -0.5);
  EXPECT_NE(joined(*plant).find("joint lift's spring of 5"), std::string::npos) << joined(*plant);
  EXPECT_NE(joined(*plant).find("actuator v"), std::string::npos) << joined(*plant);
  EXPECT_NE(joined(*plant).find("actuator second"), std::string::npos) << joined(*plant);
}

TEST_F(RobotModel, IsTheSamePlantOnceItWasWritten) {
  const auto plant = plant_of(kArm);
  ASSERT_TRUE(plant.ok());
  const auto again = parse_plant(plant_text(*plant), "again");
  ASSERT_TRUE(again.ok()) << again.error().message;
  auto first = RigidBodies::create(*plant), second = RigidBodies::create(*again);
  ASSERT_TRUE(first.ok() && second.ok());
  const VectorXd q = VectorXd::Constant(4, 0.3);
  EXPECT_NEAR((first->efforts(q, q, q) - second->efforts(q, q, q)).norm(), 0.0, 1e-9);
}

/// The arm with something more on its last link.
std::string with_tool(const std::string& tool) {
  std::string text = kArm;
  const std::string joint = R"(<joint name="roll" axis="0 0 1" pos="0 0.05 0"/>)";
  return text.insert(text.find(joint) + joint.size(), tool);
}

TEST_F(RobotModel, HangsAPayloadWhereTheUserSays) {
  const fs::path model = write("tool.xml", with_tool(R"(<site name="tip" pos="0.1 0.2 0.3"/>)"));
  auto plant = load_plant(model);
  const auto weighed = plant_of(with_tool(
      R"(<body pos="0.1 0.2 0.3"><inertial pos="0 0 0" mass="0.6" diaginertia="1e-9 1e-9 1e-9"/></body>)"));
  ASSERT_TRUE(plant.ok() && weighed.ok());
  ASSERT_TRUE(hang_payload_at("tip", model, *plant).ok());
  plant->payload.mass_kg = 0.6;
  auto hung = RigidBodies::create(*plant), wanted = RigidBodies::create(*weighed);
  ASSERT_TRUE(hung.ok() && wanted.ok());
  const VectorXd q = VectorXd::Constant(4, 0.3);
  EXPECT_NEAR((hung->efforts(q, q, q) - wanted->efforts(q, q, q)).norm(), 0.0, 1e-6);
  for (const char* elsewhere : {"tap", "wrist"}) {
    const core::Status refused = hang_payload_at(elsewhere, model, *plant);
    ASSERT_FALSE(refused.ok()) << elsewhere;
    EXPECT_NE(refused.error().message.find("roll"), std::string::npos);
    EXPECT_NE(refused.error().message.find("tip"), std::string::npos);
  }
}

/// Where the model says so, shapes weigh in the place of what the inertial says.
TEST_F(RobotModel, WeighsShapesWhereTheModelAsksForIt) {
  const auto mass_with = [&](const char* compiler) {
    const auto plant = plant_of(fmt::format(
        "<mujoco>{}<worldbody><body><joint name=\"j\"/><inertial pos=\"0 0 0\" mass=\"7\" "
        "diaginertia=\"1 1 1\"/><geom type=\"box\" size=\"0.5 0.5 0.5\" mass=\"2\"/></body>"
        "</worldbody></mujoco>",
        compiler));
    return plant.ok() ? plant->joints[0].link.mass_kg : -1.0;
  };
  EXPECT_EQ(mass_with(""), 7.0);
  EXPECT_EQ(mass_with("<compiler inertiafromgeom=\"true\"/>"), 2.0);
}

TEST_F(RobotModel, ListsWhatTheInstalledLibraryDoesNotKnow) {
  const auto plant = plant_of(
      "<mujoco><compiler fromthefuture=\"1\"/><option integrator=\"quantum\"/><worldbody><body>"
      "<joint name=\"j\" warp=\"9\"/><hologram/><geom type=\"sphere\" size=\"0.1\"/></body>"
      "</worldbody></mujoco>");
  ASSERT_TRUE(plant.ok()) << plant.error().message;
  for (const char* unknown : {"fromthefuture", "quantum", "warp", "hologram"})
    EXPECT_NE(joined(*plant).find(unknown), std::string::npos) << unknown << joined(*plant);
}

TEST_F(RobotModel, ReadsIncludedFilesAndUrdf) {
  (void)write("links.xml",
              "<mujocoinclude><body><joint name=\"j\"/><geom type=\"sphere\" size=\"0.1\"/></body>"
              "</mujocoinclude>");
  const auto included =
      plant_of("<mujoco><worldbody><include file=\"links.xml\"/></worldbody></mujoco>");
  ASSERT_TRUE(included.ok()) << included.error().message;
  EXPECT_EQ(included->joints[0].name, "j");
  const auto urdf = load_plant(write("robot.urdf", R"(<robot name="r"><link name="base"/>
    <link name="a"><inertial><origin xyz="0 0 -0.5"/><mass value="2"/>
      <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial>
      <visual><geometry><mesh filename="package://x/y.stl"/></geometry></visual></link>
    <joint name="swing" type="revolute"><parent link="base"/><child link="a"/><axis xyz="0 1 0"/>
      <limit lower="-1" upper="1" effort="5" velocity="2"/>
      <dynamics damping="0.3" friction="0.1"/></joint></robot>)"));
  ASSERT_TRUE(urdf.ok()) << urdf.error().message;
  EXPECT_EQ(urdf->joints[0].parameter("viscous_friction", "damping"), 0.3);
  EXPECT_EQ(urdf->joints[0].parameter("coulomb_friction", "level"), 0.1);
  auto bodies = RigidBodies::create(*urdf);
  ASSERT_TRUE(bodies.ok());
  const VectorXd zero = VectorXd::Zero(1);
  const double weight = bodies->efforts(VectorXd::Constant(1, 0.5), zero, zero)[0];
  EXPECT_NEAR(weight, 2.0 * 9.81 * 0.5 * std::sin(0.5), 1e-9);
}

TEST_F(RobotModel, SaysWhatIsWrongWithAModel) {
  const std::string body = "<geom type=\"sphere\" size=\"0.1\"/></body></worldbody></mujoco>";
  const std::pair<std::string, const char*> bad[] = {
      {"", "robot.xml"},
      {"no xml", "is not XML"},
      {"<mujoco><worldbody>", "is not XML"},
      {"<mujoco/>", "has no joint"},
      {"<sdf/>", "MuJoCo"},
      {"<mujoco><worldbody><body><joint name=\"b\" type=\"ball\"/>" + body, "joint 'b' is neither"},
      {"<mujoco><worldbody><body><freejoint name=\"f\"/>" + body, "has no joint"},
      {"<mujoco><worldbody><body><joint/></body></worldbody></mujoco>", "mass and inertia"},
      {"<mujoco><worldbody><body><joint axis=\"x\"/>" + body, "axis"},
      {"<mujoco><worldbody><include file=\"no.xml\"/></worldbody></mujoco>", "no.xml"},
      {"<mujoco><worldbody><include file=\"robot.xml\"/></worldbody></mujoco>", "includes itself"},
  };
  for (const auto& [text, words] : bad)
    EXPECT_NE(refusal_of(text).find(words), std::string::npos) << text << "\n" << refusal_of(text);
}

}  // namespace
}  // namespace ravencal::physics
