// SPDX-License-Identifier: Apache-2.0
//
// The controller's arithmetic against recordings of real RAVEN-II robots. Both files call the
// insertion's unit cm, but hold what the controller publishes: metres times 180/pi.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

#include "physics/raven_controller.hpp"
#include "physics/raven_kinematics.hpp"

namespace ravencal::physics {
namespace {

namespace fs = std::filesystem;

constexpr double kDeg = std::numbers::pi / 180.0;

/// Rows of numbers after the header; empty if the file is not there.
std::vector<std::vector<double>> read_rows(const fs::path& path) {
  std::ifstream file(path);
  std::vector<std::vector<double>> rows;
  std::string line;
  std::getline(file, line);
  while (std::getline(file, line)) {
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream fields(line);
    std::vector<double> row;
    for (double value = 0.0; fields >> value;) row.push_back(value);
    rows.push_back(std::move(row));
  }
  return rows;
}

TEST(RealRaven, JointsFollowFromMotorsThroughTheCoupling) {
  const fs::path path = fs::path(RAVENCAL_DATA_DIR) / "raven2_uiuc/raven2_joint123.csv";
  const auto rows = read_rows(path);
  if (rows.empty()) GTEST_SKIP() << "no recording at " << path;
  const auto plant = load_plant(fs::path(RAVENCAL_SOURCE_DIR) / "tools/plants/raven2.toml");
  ASSERT_TRUE(plant.ok()) << plant.error().message;
  ASSERT_GT(rows.size(), 10'000U);
  double worst_deg = 0.0;
  double worst_m = 0.0;
  for (const auto& row : rows) {
    const Eigen::Vector3d motors(row[4] * kDeg, row[5] * kDeg, row[6] * kDeg);
    const Eigen::Vector3d joints = joints_from_motors(*plant, motors);
    worst_deg = std::max(
        {worst_deg, std::abs(joints[0] / kDeg - row[1]), std::abs(joints[1] / kDeg - row[2])});
    worst_m = std::max(worst_m, std::abs(joints[2] - row[3] * kDeg));
  }
  RecordProperty("worst_deg", std::to_string(worst_deg));
  // float32 of a joint near 100 deg is good to 4e-6 deg; motors near 52 000 deg to 4e-3 deg / 121.
  EXPECT_LT(worst_deg, 5e-5);
  EXPECT_LT(worst_m, 5e-7);
}

TEST(RealRaven, ToolPositionFollowsFromJointsThroughTheKinematics) {
  const fs::path path = fs::path(RAVENCAL_DATA_DIR) / "raven2_uw/raven2_uw_track.csv";
  const auto rows = read_rows(path);
  if (rows.empty()) GTEST_SKIP() << "no recording at " << path;
  ASSERT_GT(rows.size(), 1000U);
  double worst_um = 0.0;
  for (const auto& row : rows) {
    SlotVector joints{};
    for (const std::size_t slot : {0U, 1U, 4U, 5U, 6U, 7U}) joints[slot] = row[1 + slot] * kDeg;
    joints[2] = row[3] * kDeg;
    const ToolPose pose = forward_kinematics(Arm::kGold, joints);
    for (std::size_t i = 0; i < 3; ++i) {
      worst_um = std::max(worst_um, std::abs(pose.position_um[i] - row[17 + i]));
    }
  }
  RecordProperty("worst_um", std::to_string(worst_um));
  EXPECT_LE(worst_um, 2.0);
}

}  // namespace
}  // namespace ravencal::physics
