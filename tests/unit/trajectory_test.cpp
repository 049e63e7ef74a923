// SPDX-License-Identifier: Apache-2.0
#include "trajectory/trajectory.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>

namespace ravencal::trajectory {
namespace {

namespace fs = std::filesystem;

constexpr double kDeg = std::numbers::pi / 180.0;

fs::path temporary(const std::string& name) { return fs::path(testing::TempDir()) / name; }

Trajectory zigzag(ZigzagKind kind, int divisions) {
  ZigzagOptions options;
  options.kind = kind;
  options.divisions = divisions;
  auto made = make_zigzag(options);
  EXPECT_TRUE(made.ok());
  return std::move(made).value();
}

TEST(Zigzag, TakesAsLongAsTheAuthorsFollowerAtItsSpeedLimits) {
  // Estimated from the authors' generator and follower: x 223 s and 328 s, xy 161 s and 235 s.
  EXPECT_NEAR(zigzag(ZigzagKind::kX, 3).duration_s(), 223.0, 3.0);
  EXPECT_NEAR(zigzag(ZigzagKind::kX, 4).duration_s(), 328.0, 3.0);
  EXPECT_NEAR(zigzag(ZigzagKind::kXy, 3).duration_s(), 161.0, 3.0);
  EXPECT_NEAR(zigzag(ZigzagKind::kXy, 4).duration_s(), 235.0, 3.0);
  // The paper's five calibration files together: 21 minutes at most.
  double sum_s = 0.0;
  for (int divisions = 2; divisions <= 6; ++divisions) {
    sum_s += zigzag(ZigzagKind::kYz, divisions).duration_s();
  }
  EXPECT_NEAR(sum_s / 60.0, 21.0, 0.5);
}

TEST(Zigzag, SweepsAlongTheDirectionOfItsKindMostOfTheTime) {
  const Trajectory path = zigzag(ZigzagKind::kY, 4);
  double travel[3] = {};
  for (std::size_t i = 1; i < path.joints_ji.size(); ++i) {
    const Eigen::Vector3d change = path.joints_ji[i] - path.joints_ji[i - 1];
    travel[0] += std::abs(change[0]) / (40 * kDeg);
    travel[1] += std::abs(change[1]) / (55 * kDeg);
    travel[2] += std::abs(change[2]) / 0.09;
  }
  EXPECT_GT(travel[1], 4.0 * travel[0]);
  EXPECT_GT(travel[1], 4.0 * travel[2]);
}

TEST(Zigzag, RefusesSparsitiesAndKindsThatDoNotExist) {
  ZigzagOptions options;
  options.divisions = 0;
  EXPECT_FALSE(make_zigzag(options).ok());
  EXPECT_FALSE(zigzag_kind_from("yx").ok());
  EXPECT_EQ(*zigzag_kind_from("xyz"), ZigzagKind::kXyz);
}

TEST(RandomMotion, SpansTheWorkspaceAndDependsOnTheSeed) {
  for (const RandomMode mode : {RandomMode::kPaper, RandomMode::kCode}) {
    RandomOptions options;
    options.mode = mode;
    const auto one = make_random(options);
    options.seed = 2;
    const auto two = make_random(options);
    ASSERT_TRUE(one.ok() && two.ok());
    EXPECT_NE(one->joints_ji[5000], two->joints_ji[5000]);
    Eigen::Vector3d low = one->joints_ji[0];
    Eigen::Vector3d high = low;
    for (const auto& joints : one->joints_ji) {
      low = low.cwiseMin(joints);
      high = high.cwiseMax(joints);
    }
    EXPECT_GT(high[0] - low[0], 30 * kDeg);
    EXPECT_GT(high[1] - low[1], 35 * kDeg);
    EXPECT_GT(high[2] - low[2], 0.05);
  }
}

TEST(TrajectoryCsv, ReadsBackWhatItWrote) {
  const fs::path path = temporary("trajectory_round_trip.csv");
  fs::remove(path);
  const Trajectory written = zigzag(ZigzagKind::kYz, 2);
  ASSERT_TRUE(write_csv(written, path).ok());
  const auto read = read_csv(path);
  ASSERT_TRUE(read.ok()) << read.error().message;
  ASSERT_EQ(read->t_s.size(), written.t_s.size());
  for (std::size_t i = 0; i < read->t_s.size(); i += 97) {
    EXPECT_NEAR(read->t_s[i], written.t_s[i], 1e-9);
    EXPECT_LT((read->joints_ji[i] - written.joints_ji[i]).norm(), 1e-8);
  }
}

TEST(TrajectoryCsv, NamesLineAndColumnOfABadValue) {
  const fs::path path = temporary("trajectory_bad.csv");
  const auto error_of = [&](const std::string& text) {
    std::ofstream(path) << text;
    const auto read = read_csv(path);
    EXPECT_FALSE(read.ok());
    return read.ok() ? std::string() : read.error().message;
  };
  const std::string header = "t_s,shoulder_rad,elbow_rad,insertion_m\n";
  EXPECT_NE(
      error_of(header + "0,1,2,0.4\n0.01,1,nan,0.4\n").find(":3: column 3 (elbow_rad): 'nan'"),
      std::string::npos);
  EXPECT_NE(error_of(header + "0,1,2\n").find(":2:"), std::string::npos);
  EXPECT_NE(error_of(header + "0,1,2,0.4\n0,1,2,0.4\n").find("does not rise"), std::string::npos);
  EXPECT_NE(error_of("a,b\n").find("header"), std::string::npos);
  EXPECT_NE(error_of("").find("two rows"), std::string::npos);
}

TEST(Trajectory, IsLinearBetweenSamplesAndHeldOutside) {
  Trajectory line;
  line.t_s = {0.0, 1.0};
  line.joints_ji = {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(2, 4, 6)};
  EXPECT_EQ(line.at(0.5), Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(line.at(-1.0), Eigen::Vector3d(0, 0, 0));
  EXPECT_EQ(line.at(9.0), Eigen::Vector3d(2, 4, 6));
}

}  // namespace
}  // namespace ravencal::trajectory
