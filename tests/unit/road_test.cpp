// SPDX-License-Identifier: Apache-2.0
//
// From edge to label on the digital twin: its encoder edges are replayed through the driver, homed
// from the hard stops and merged with the controller's states.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>

#include "physics/plant.hpp"
#include "quadrature_reader/logger.hpp"
#include "record/alignment.hpp"
#include "record/load.hpp"
#include "simulation/session.hpp"

namespace ravencal {
namespace {

namespace fs = std::filesystem;
namespace qr = quadrature_reader;
constexpr std::array kJoints = {"shoulder", "elbow", "insertion"};

class Road : public testing::Test {
 protected:
  /// One session, simulated once for all tests.
  static void SetUpTestSuite() {
    folder_ = fs::temp_directory_path() / fmt::format("ravencal_road_{}", ::getpid());
    fs::create_directories(folder_);
    const auto plant = physics::load_plant(source("tools/plants/raven2.toml"));
    ASSERT_TRUE(plant.ok());
    trajectory::RandomOptions motion;
    motion.duration_s = 60.0;
    simulation::SessionOptions options;
    options.edges = folder_ / "edges.db";
    options.on_truth = [](std::int64_t t_ns, const Eigen::Vector3d& joints) {
      true_joints_[t_ns] = joints;
    };
    const auto summary =
        simulation::record_session(*plant, *trajectory::make_random(motion), folder_ / "robot.db",
                                   options, [](double) { return true; });
    ASSERT_TRUE(summary.ok()) << summary.error().message;
    auto config = qr::load_config(source("quadrature_reader/encoders.toml"));
    ASSERT_TRUE(config.ok()) << config.error().message;
    qr::replay_instead(*config, folder_ / "edges.db", 0.0);
    qr::LoggerOptions logger_options;
    logger_options.home = true;
    auto logger = qr::Logger::create(*config, folder_ / "truth.db", logger_options);
    ASSERT_TRUE(logger.ok()) << logger.error().message;
    ASSERT_TRUE((*logger)->run([] { return false; }, [](const qr::LoggerStatus&) {}).ok());
    EXPECT_FALSE((*logger)->failed());
  }
  static void TearDownTestSuite() {
    fs::remove_all(folder_);
    true_joints_.clear();
  }
  static std::string source(const std::string& path) {
    return std::string(RAVENCAL_SOURCE_DIR) + "/" + path;
  }
  static record::Recording load(const char* name) {
    auto recording = record::load_recording(folder_ / name, {});
    EXPECT_TRUE(recording.ok()) << (recording.ok() ? "" : recording.error().message);
    return std::move(recording).value();
  }

  static inline fs::path folder_;
  static inline std::map<std::int64_t, Eigen::Vector3d> true_joints_;
};

TEST_F(Road, LabelsAreTheTwinsJointToACountBesideTheHomedZero) {
  record::MergeOptions options;
  options.fixed_delay_s = 0.0;  // edges are stamped where they happen
  const auto merged = record::merge_truth(load("robot.db"), load("truth.db"), options);
  ASSERT_TRUE(merged.ok()) << merged.error().message;
  ASSERT_TRUE(merged->clock) << "the encoders ran on a clock of their own";
  EXPECT_GE(merged->rows_with_truth, merged->recording.rows() - 3);
  // Resolution, and how far the zero may be off: what a stop's seat and yielding amount to.
  const std::array counts = {2.0 * M_PI / 80'000.0, 2.0 * M_PI / 80'000.0, 5e-6};
  const std::array zero = {0.005, 0.005, 0.0003};
  for (std::size_t j = 0; j < kJoints.size(); ++j) {
    const auto column = *merged->recording.column(record::Role::kJointTruth, kJoints[j]);
    std::vector<double> errors;
    for (Eigen::Index row = 0; row < merged->recording.rows(); ++row) {
      const double label = merged->recording.samples(row, column);
      if (std::isnan(label)) continue;
      const auto at = true_joints_.find(merged->recording.t_ns[static_cast<std::size_t>(row)]);
      ASSERT_NE(at, true_joints_.end());
      errors.push_back(label - at->second[static_cast<Eigen::Index>(j)]);
    }
    auto sorted = errors;
    std::sort(sorted.begin(), sorted.end());
    const double median = sorted[sorted.size() / 2];
    double worst = 0.0;
    for (const double error : errors) worst = std::max(worst, std::abs(error - median));
    fmt::print("{}: zero off by {:.3g}, labels within {:.2f} counts of the true joint\n",
               kJoints[j], median, worst / counts[j]);
    EXPECT_LT(std::abs(median), zero[j]) << kJoints[j];
    EXPECT_LT(worst, counts[j]) << kJoints[j];
  }
}

TEST_F(Road, ADelayOfTheTruthIsFoundToAFifthOfAMillisecond) {
  const record::Recording robot = load("robot.db");
  record::Recording truth = load("truth.db");
  const auto before = record::merge_truth(robot, truth);
  ASSERT_TRUE(before.ok()) << before.error().message;
  for (const double delay_ms : {7.3, -12.4, 31.0}) {
    record::Recording late = truth;
    for (auto& t : late.t_ns) t += std::llround(1e6 * delay_ms);
    const auto after = record::merge_truth(robot, late);
    ASSERT_TRUE(after.ok()) << after.error().message;
    // The cables' own lag is in both.
    EXPECT_NEAR(after->estimate->delay_s - before->estimate->delay_s, 1e-3 * delay_ms, 2e-4);
  }
}

TEST_F(Road, HomingIsInTheMergedRecordingAtTheRobotsTime) {
  record::MergeOptions options;
  options.fixed_delay_s = 0.0;
  const auto merged = record::merge_truth(load("robot.db"), load("truth.db"), options);
  ASSERT_TRUE(merged.ok());
  std::int64_t robot_homed_ns = 0;
  int found = 0;
  for (const auto& event : merged->recording.events) {
    if (event.kind != "homing") continue;
    if (event.detail == "1") {
      robot_homed_ns = event.t_ns;
    } else {
      ++found;
      EXPECT_GT(event.t_ns, 0);
      EXPECT_LT(event.t_ns, 20'000'000'000) << "the twin's clock begins at 0";
      EXPECT_NE(event.detail.find("\"confidence\""), std::string::npos);
    }
  }
  EXPECT_GT(robot_homed_ns, 0);
  EXPECT_EQ(found, 3);
}

}  // namespace
}  // namespace ravencal
