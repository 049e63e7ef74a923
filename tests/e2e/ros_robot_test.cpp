// SPDX-License-Identifier: Apache-2.0
//
// The virtual RAVEN as ROS's own programs see it.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "e2e/ros_rig.hpp"
#include "rt/rig.hpp"

namespace ravencal::test {
namespace {

class RosRobot : public RosRig {
 protected:
  /// One value of a topic, by Debian's rostopic.
  double echo(const std::string& field) {
    EXPECT_EQ(
        run("timeout 600 rostopic echo -n 1 -p " + field + " | tail -1 | cut -d, -f2", "echo.txt"),
        0);
    return std::strtod(log("echo.txt").c_str(), nullptr);
  }
};

TEST_F(RosRobot, HasTheControllersTopicsAndTheirTypes) {
  start_master();
  start_robot("--homed");
  const std::pair<const char*, const char*> kTypes[] = {
      {"/ravenstate", "raven_2/raven_state"},
      {"/operating_state", "crtk_msgs/operating_state"},
      {"/arm2/operating_state", "crtk_msgs/operating_state"},
      {"/arm1/measured_js", "sensor_msgs/JointState"},
      {"/arm1/measured_cp", "geometry_msgs/TransformStamped"},
      {"/arm1/setpoint_js", "sensor_msgs/JointState"},
      {"/ext_jpos", "sensor_msgs/JointState"},
  };
  std::string command = "for t in";
  std::string expected;
  for (const auto& [topic, type] : kTypes) {
    command += std::string(" ") + topic;
    expected += std::string(type) + "\n";
  }
  EXPECT_EQ(run(command + "; do rostopic type $t; done", "types.txt"), 0);
  EXPECT_EQ(log("types.txt"), expected);
  // Debian's own message classes read them: the md5 is right. Joint 2 at home, metres for joint 3.
  EXPECT_NEAR(echo("/arm2/measured_js/position[1]"), M_PI / 2.0, 0.03);
  EXPECT_NEAR(echo("/arm2/measured_js/position[2]"), 0.40, 0.005);
  EXPECT_LT(std::abs(echo("/arm1/measured_cp/transform/translation/x")), 0.2);
  // The pose on arm2 is mech[0]'s, turned into CRTK's frame: (x, y, z) -> (-y, -z, x). setpoint_cp
  // of arm1 is mech[0]'s as well, and not turned. With brakes on, both are the same pose.
  const double along = echo("/arm2/measured_cp/transform/translation/z");
  EXPECT_NEAR(along, echo("/arm1/setpoint_cp/transform/translation/x"), 1e-4);
  EXPECT_NEAR(echo("/arm2/measured_cp/transform/translation/x"),
              -echo("/arm1/setpoint_cp/transform/translation/y"), 1e-4);
  EXPECT_EQ(echo("/arm1/setpoint_js/position[1]"), 0.0) << "read where nobody writes it";
  EXPECT_NEAR(echo("/ext_jpos/position[1]"), M_PI / 2.0 - 0.13, 0.1);
  EXPECT_EQ(run("ravencal-ros run --check --stale-s 20", "check.txt"), 0);
  EXPECT_NE(log("check.txt").find("states at 1000 Hz"), std::string::npos) << log("check.txt");
}

TEST_F(RosRobot, PublishesTheJointsThatThePluginCorrected) {
  model::CalibrationModel model =
      make_model({plain("jpos.shoulder"), plain("jpos.elbow"), plain("jpos.insertion")}, {});
  model.origin.arm = model::Arm::kGold;
  model.layers[0].weights.setZero();
  model.layers[0].biases.setZero();
  model.input.mean = Eigen::Vector3d(0.6, 1.5, 0.38);
  model.input.scale = Eigen::Vector3d(0.6, 0.8, 0.1);
  model.input_min = model.input.mean - model.input.scale;
  model.input_max = model.input.mean + model.input.scale;
  start_master();
  start_robot(fmt::format("--homed --speed 4 --plugin {} --weights {}", RAVENCAL_PLUGIN_PATH,
                          write_weights(model, "robot.blob").string()));
  const double correction = -0.05;  // of make_model's elbow
  EXPECT_TRUE(wait_until([&] {
    return std::abs(echo("/arm2/measured_js/position[1]") - (M_PI / 2.0 + correction)) < 0.01;
  })) << log("echo.txt");
}

TEST_F(RosRobot, SaysWhatItNeeds) {
  EXPECT_EQ(run("ravencal-ros robot --plant missing.toml"), 3);
  EXPECT_EQ(run(fmt::format("ravencal-ros robot --plant {}/tools/plants/raven2.toml --weights a",
                            RAVENCAL_SOURCE_DIR)),
            2);
  EXPECT_EQ(run(fmt::format("ravencal-ros robot --plant {}/tools/plants/raven2.toml --wait-s 0.2",
                            RAVENCAL_SOURCE_DIR)),
            4);
  EXPECT_NE(log("log.txt").find("start roscore"), std::string::npos) << log("log.txt");
}

}  // namespace
}  // namespace ravencal::test
