// SPDX-License-Identifier: Apache-2.0
//
// Delay, clocks and merge of a robot's states with the encoders' truth.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "core/constants.hpp"
#include "record/alignment.hpp"

namespace ravencal::record {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr double kRadPerCount = 7.853981633974483e-05;

double smooth_motion(double t_s) {
  return 0.3 * std::sin(0.9 * t_s) + 0.1 * std::sin(2.3 * t_s + 1.0) + 0.02 * std::sin(7.1 * t_s);
}

/// A triangle wave of 20 deg/s, as the paper's zig-zags.
double zigzag(double t_s) {
  const double phase = std::fmod(t_s, 3.0);
  return 0.349 * (phase < 1.5 ? phase : 3.0 - phase);
}

record::Recording one_joint(record::Role role, const std::string& name, std::int64_t period_ns,
                            double seconds, const std::function<double(double)>& position) {
  record::Recording recording;
  recording.source = name + ".db";
  recording.channels = {{name, "rad", role, "shoulder"}};
  const auto rows = static_cast<Eigen::Index>(1e9 * seconds / static_cast<double>(period_ns));
  recording.samples.resize(rows, 1);
  for (Eigen::Index row = 0; row < rows; ++row) {
    const std::int64_t t = 5'000'000'000'000 + row * period_ns;
    recording.t_ns.push_back(t);
    recording.samples(row, 0) = position(1e-9 * static_cast<double>(row * period_ns));
  }
  return recording;
}

/// The robot's belief: motion with noise and an error that depends on position and direction.
record::Recording robot_of(double (*motion)(double), unsigned seed,
                           std::int64_t period_ns = 10 * core::kNsPerMs) {
  auto noise = [generator = std::mt19937(seed),
                normal = std::normal_distribution<double>(0.0, 1e-4)](double t) mutable {
    (void)t;
    return normal(generator);
  };
  return one_joint(record::Role::kJointEstimate, "estimate", period_ns, 60.0,
                   [=](double t) mutable {
                     return 1.02 * motion(t) + 0.01 * std::sin(3.0 * motion(t)) + 0.05 + noise(t);
                   });
}

/// The encoder at 1 kHz, quantised, with stamps that are `delay_s` late.
record::Recording truth_of(double (*motion)(double), double delay_s) {
  return one_joint(record::Role::kJointTruth, "truth", core::kNsPerMs, 60.0, [=](double t) {
    return kRadPerCount * std::round(motion(t - delay_s) / kRadPerCount);
  });
}

TEST(Alignment, RecoversADelayOf7300MicrosecondsTo200) {
  for (unsigned seed = 0; seed < 5; ++seed) {
    for (auto* motion : {smooth_motion, zigzag}) {
      const auto merged = merge_truth(robot_of(motion, seed), truth_of(motion, 7.3e-3));
      ASSERT_TRUE(merged.ok()) << merged.error().message;
      EXPECT_NEAR(merged->estimate->delay_s, 7.3e-3, 0.2e-3);
      EXPECT_LT(merged->estimate->sigma_s, 0.1e-3);
      // The stated uncertainty is honest: five standard errors, and 0.02 ms for interpolation.
      EXPECT_LT(std::abs(merged->estimate->delay_s - 7.3e-3),
                5.0 * merged->estimate->sigma_s + 2e-5);
    }
  }
}

TEST(Alignment, RecoversNegativeDelaysAndWorksAtAKilohertz) {
  const auto merged =
      merge_truth(robot_of(smooth_motion, 1, core::kNsPerMs), truth_of(smooth_motion, -31.7e-3));
  ASSERT_TRUE(merged.ok()) << merged.error().message;
  EXPECT_NEAR(merged->estimate->delay_s, -31.7e-3, 0.2e-3);
}

TEST(Alignment, InterpolatesTheTruthAtTheStatesOwnTime) {
  const auto robot = robot_of(smooth_motion, 3);
  const auto merged = merge_truth(robot, truth_of(smooth_motion, 7.3e-3));
  ASSERT_TRUE(merged.ok()) << merged.error().message;
  const auto truth = merged->recording.column(record::Role::kJointTruth, "shoulder");
  ASSERT_TRUE(truth);
  EXPECT_EQ(merged->recording.t_ns, robot.t_ns);
  for (Eigen::Index row = 10; row + 10 < merged->recording.rows(); ++row) {
    const double t = 0.01 * static_cast<double>(row);
    // Quantisation, and 0.2 ms at up to 0.8 rad/s.
    EXPECT_NEAR(merged->recording.samples(row, *truth), smooth_motion(t), kRadPerCount + 1.6e-4);
  }
  EXPECT_EQ(merged->recording.events.front().kind, "merge");
}

TEST(Alignment, KeepsWhatWasAssumedOfBoth) {
  Recording robot = robot_of(smooth_motion, 3), truth = truth_of(smooth_motion, 7.3e-3);
  robot.meta["assumed_channels"] = "estimate";
  truth.meta["assumed_channels"] = "counts, truth";
  EXPECT_EQ(merge_truth(robot, truth)->recording.meta.at("assumed_channels"),
            "estimate, truth.shoulder");
  robot.meta.clear();
  EXPECT_EQ(merge_truth(robot, truth)->recording.meta.at("assumed_channels"), "truth.shoulder");
  truth.meta["assumed_channels"] = "counts";
  EXPECT_FALSE(merge_truth(robot, truth)->recording.meta.contains("assumed_channels"));
}

TEST(Alignment, LeavesRowsWithoutTruthEmpty) {
  auto truth = truth_of(smooth_motion, 0.0);
  truth.samples.block(20'000, 0, 1000, 1).setConstant(kNone);
  const auto merged = merge_truth(robot_of(smooth_motion, 3), truth);
  ASSERT_TRUE(merged.ok()) << merged.error().message;
  const auto column = *merged->recording.column(record::Role::kJointTruth, "shoulder");
  EXPECT_TRUE(std::isnan(merged->recording.samples(2050, column)));
  EXPECT_FALSE(std::isnan(merged->recording.samples(1990, column)));
  EXPECT_NEAR(static_cast<double>(merged->rows_with_truth), 5900.0, 5.0);
}

TEST(Alignment, DoesNotInterpolateAcrossAGap) {
  auto truth = truth_of(smooth_motion, 0.0);
  truth.t_ns.erase(truth.t_ns.begin() + 20'000, truth.t_ns.begin() + 21'000);
  record::SampleMatrix samples(59'000, 1);
  samples << truth.samples.topRows(20'000), truth.samples.bottomRows(39'000);
  truth.samples = samples;
  const auto merged = merge_truth(robot_of(smooth_motion, 3), truth);
  ASSERT_TRUE(merged.ok()) << merged.error().message;
  EXPECT_TRUE(std::isnan(merged->recording.samples(
      2050, *merged->recording.column(record::Role::kJointTruth, "shoulder"))));
}

TEST(Alignment, RelatesTheClocksWithTheirDrift) {
  const auto robot = robot_of(smooth_motion, 3);
  auto truth = truth_of(smooth_motion, 0.0);
  // The wall clock is far off and runs 40 ppm fast: 2.4 ms over the minute.
  const std::int64_t offset = 1'795'000'000'000'000'000;
  for (int i = 0; i <= 6; ++i) {
    const std::int64_t t = truth.t_ns.front() + i * 10'000 * core::kNsPerMs;
    truth.events.push_back(
        {t, "clock_offset",
         "{\"minus_monotonic_ns\":" + std::to_string(offset + i * 400'000) + "}"});
  }
  record::Recording walled = robot;
  for (auto& t : walled.t_ns) t += offset + (t - robot.t_ns.front()) / 25'000;
  MergeOptions options;
  options.clock = RobotClock::kWall;
  const auto merged = merge_truth(walled, truth, options);
  ASSERT_TRUE(merged.ok()) << merged.error().message;
  EXPECT_NEAR(merged->clock->drift_ppm, 40.0, 0.01);
  EXPECT_NEAR(merged->estimate->delay_s, 0.0, 0.1e-3);
}

TEST(Alignment, RefusesAClockThatWasStepped) {
  auto truth = truth_of(smooth_motion, 0.0);
  for (int i = 0; i <= 6; ++i) {
    truth.events.push_back(
        {truth.t_ns.front() + i * 10'000 * core::kNsPerMs, "clock_offset",
         "{\"minus_monotonic_ns\":" + std::to_string(i < 3 ? 0 : 50 * core::kNsPerMs) + "}"});
  }
  const auto relation = clock_relation(truth);
  ASSERT_FALSE(relation.ok());
  EXPECT_NE(relation.error().message.find("stepped"), std::string::npos);
}

TEST(Alignment, NamesWhatIsWrong) {
  const auto robot = robot_of(smooth_motion, 3);
  auto opposite = truth_of(smooth_motion, 0.0);
  opposite.samples *= -1.0;
  auto error = merge_truth(robot, opposite);
  ASSERT_FALSE(error.ok());
  EXPECT_NE(error.error().message.find("opposite"), std::string::npos) << error.error().message;

  error = merge_truth(robot, truth_of([](double t) { return std::sin(5.7 * t * t); }, 0.0));
  ASSERT_FALSE(error.ok());
  EXPECT_NE(error.error().message.find("same motion"), std::string::npos) << error.error().message;

  error = merge_truth(robot, truth_of([](double) { return 0.3; }, 0.0));
  ASSERT_FALSE(error.ok()) << "a joint at rest tells no delay";

  auto not_homed = truth_of(smooth_motion, 0.0);
  not_homed.samples.setConstant(std::numeric_limits<double>::quiet_NaN());
  error = merge_truth(robot, not_homed);
  ASSERT_FALSE(error.ok());
  EXPECT_NE(error.error().message.find("--home"), std::string::npos) << error.error().message;

  auto elsewhere = truth_of(smooth_motion, 0.0);
  for (auto& t : elsewhere.t_ns) t += 3'600'000 * core::kNsPerMs;
  error = merge_truth(robot, elsewhere);
  ASSERT_FALSE(error.ok());
  EXPECT_NE(error.error().message.find("overlap"), std::string::npos);

  error = merge_truth(robot, truth_of(smooth_motion, 0.3));
  ASSERT_FALSE(error.ok()) << "beyond the search";
}

TEST(Alignment, CarriesTheTruthsEventsToTheRobotsTime) {
  const auto robot = robot_of(smooth_motion, 3);
  auto truth = truth_of(smooth_motion, 0.0);
  const std::int64_t shift = 3'600'000 * core::kNsPerMs;
  const auto at = truth.t_ns.front() + 2000 * core::kNsPerMs;
  truth.events = {{at + shift, "rehoming",
                   R"({"joint":"shoulder","from_ns":)" + std::to_string(at + shift - 5) +
                       R"(,"to_ns":)" + std::to_string(at + shift) + "}"},
                  {at + shift, "notice", "words"}};
  for (auto& t : truth.t_ns) t += shift;
  for (const std::int64_t t : {truth.t_ns.front(), truth.t_ns.back()})
    truth.events.push_back(
        {t, "clock_offset", "{\"minus_monotonic_ns\":" + std::to_string(-shift) + "}"});
  MergeOptions options;  // the clock is found: only one of the two lets them overlap
  options.fixed_delay_s = 7e-3;
  const auto merged = merge_truth(robot, truth, options);
  ASSERT_TRUE(merged.ok()) << merged.error().message;
  EXPECT_EQ(merged->delay_s, 7e-3);
  const auto& events = merged->recording.events;
  ASSERT_EQ(events.size(), 3U) << "clock_offset events have done their work";
  EXPECT_EQ(events[0].kind, "merge");
  EXPECT_NE(events[0].detail.find("\"delay\":\"given\""), std::string::npos);
  EXPECT_EQ(events[1].kind, "rehoming");
  EXPECT_EQ(events[1].t_ns, at - 7 * core::kNsPerMs);
  EXPECT_NE(events[1].detail.find("\"to_ns\":" + std::to_string(at - 7 * core::kNsPerMs)),
            std::string::npos)
      << events[1].detail;
  EXPECT_EQ(events[2].detail, "words");
  EXPECT_EQ(merged->recording.meta.at("merge.delay"), "given");
}

TEST(Alignment, AsksWhereBothClocksWouldFit) {
  const auto robot = robot_of(smooth_motion, 3);
  auto truth = truth_of(smooth_motion, 0.0);
  for (const std::int64_t t : {truth.t_ns.front(), truth.t_ns.back()})
    truth.events.push_back({t, "clock_offset", R"({"minus_monotonic_ns":1000000000})"});
  const auto merged = merge_truth(robot, truth);
  ASSERT_FALSE(merged.ok());
  EXPECT_NE(merged.error().message.find("which clock"), std::string::npos);
  MergeOptions options;
  options.clock = RobotClock::kSame;
  EXPECT_TRUE(merge_truth(robot, truth, options).ok());
}

TEST(Alignment, TakesTheWallTimeOfAnImportedCsvFromItsFirstStamp) {
  auto robot = robot_of(smooth_motion, 3);
  auto truth = truth_of(smooth_motion, 0.0);
  const std::int64_t wall = 1'700'000'000'000'000'000;
  for (const std::int64_t t : {truth.t_ns.front(), truth.t_ns.back()})
    truth.events.push_back(
        {t, "clock_offset", "{\"minus_monotonic_ns\":" + std::to_string(wall) + "}"});
  // The importer counts from the first row and keeps its stamp.
  const std::int64_t first = robot.t_ns.front();
  for (auto& t : robot.t_ns) t -= first;
  robot.meta["origin.time"] = std::to_string(1e-9 * static_cast<double>(wall + first));
  const auto merged = merge_truth(robot, truth);
  ASSERT_TRUE(merged.ok()) << merged.error().message;
  EXPECT_NEAR(merged->estimate->delay_s, 0.0, 0.1e-3);
}

}  // namespace
}  // namespace ravencal::record
