// SPDX-License-Identifier: Apache-2.0
//
// The virtual RAVEN as ROS's own programs see it, and `ravencal calibrate` and the tutorial on it.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>

#include "e2e/ros_rig.hpp"
#include "record/load.hpp"
#include "rt/rig.hpp"

namespace ravencal::test {
namespace {

namespace fs = std::filesystem;

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

/// Root mean square of true minus published elbow.
double elbow_error_deg(const fs::path& path) {
  const auto run = record::load_recording(path, {});
  EXPECT_TRUE(run.ok()) << run.error().message;
  const auto truth = *run->column("truth.elbow");
  const auto published = *run->column("jpos.elbow");
  double sum = 0.0;
  int rows = 0;
  for (Eigen::Index row = 0; row < run->rows(); ++row) {
    const double error = run->samples(row, truth) - run->samples(row, published);
    if (std::isnan(error)) continue;
    sum += error * error;
    ++rows;
  }
  EXPECT_GT(rows, 500);
  return std::sqrt(sum / std::max(rows, 1)) * 180.0 / M_PI;
}

/// The commands of the tutorial, in their order, as a reader pastes them.
std::string tutorial_script() {
  std::ifstream file(RAVENCAL_SOURCE_DIR "/tools/recording/ros/TUTORIAL.md");
  std::string script;
  bool inside = false;
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with("```")) {
      inside = line == "```sh test";
      continue;
    }
    if (inside) script += line + "\n";
  }
  return script;
}

TEST_F(RosRobot, DoesWhatTheTutorialSays) {
  const std::string script = tutorial_script();
  ASSERT_NE(script.find("ravencal calibrate"), std::string::npos);
  std::ofstream(folder_ / "tutorial.sh")
      << "set -eu\ntrap 'kill $(jobs -p) 2>/dev/null || true' EXIT\n"
      << "plants=" RAVENCAL_SOURCE_DIR "/tools/plants\nplugin=" RAVENCAL_PLUGIN_PATH "\n"
      << script;
  start_master();  // the reader's roscore
  EXPECT_EQ(run("timeout 3000 bash tutorial.sh", "tutorial.txt"), 0)
      << log("tutorial.txt") << log("robot.log");
  for (const char* made : {"evening1/model.onnx", "evening1/weights.blob", "evening1/report.html",
                           "evening1/train.html", "evening1/evaluate.json", "corrected.db"}) {
    EXPECT_TRUE(fs::exists(folder_ / made)) << made << "\n" << log("tutorial.txt");
  }
  EXPECT_NE(log("tutorial.txt").find("settings.weights"), std::string::npos);
  // The robot's own joints are several degrees off; those that it publishes now are not.
  EXPECT_GT(elbow_error_deg(folder_ / "evening1/test.db"), 5.0);
  EXPECT_LT(elbow_error_deg(folder_ / "corrected.db"), 2.0);
}

}  // namespace
}  // namespace ravencal::test
