// SPDX-License-Identifier: Apache-2.0
//
// Merging truth with robot states, for any delay, motion, noise, rate and gap.
#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <set>

#include "core/constants.hpp"
#include "record/alignment.hpp"

namespace ravencal::quadrature_reader {
namespace {

constexpr double kRadPerCount = 7.853981633974483e-05;
constexpr double kSeconds = 60.0;

/// Three swings of random size, period and phase: up to some 20 deg/s.
struct Motion {
  double size[3];
  double rate_per_s[3];
  double phase[3];

  double operator()(double t_s) const {
    double x = 0.0;
    for (int i = 0; i < 3; ++i) x += size[i] * std::sin(rate_per_s[i] * t_s + phase[i]);
    return x;
  }
};

Motion any_motion(std::mt19937& generator) {
  const auto uniform = [&](double a, double b) {
    return std::uniform_real_distribution<double>(a, b)(generator);
  };
  Motion motion{};
  constexpr double kRates[3] = {0.6, 2.0, 6.0};
  for (int i = 0; i < 3; ++i) {
    motion.rate_per_s[i] = kRates[i] * uniform(0.7, 1.4);
    motion.size[i] = uniform(0.06, 0.2) / motion.rate_per_s[i];
    motion.phase[i] = uniform(0.0, 6.3);
  }
  return motion;
}

record::Recording empty(record::Role role) {
  record::Recording recording;
  recording.source = role == record::Role::kJointTruth ? "truth.db" : "robot.db";
  recording.channels = {{"x", "rad", role, "shoulder"}};
  return recording;
}

/// States at 100 Hz with noise, gain error and an error that depends on the position.
record::Recording robot_of(const Motion& motion, double error_rad, std::mt19937& generator) {
  record::Recording robot = empty(record::Role::kJointEstimate);
  // Five times the resolution of RAVEN-II's motor encoders at the shoulder.
  std::normal_distribution<double> noise(0.0, 6e-5);
  const auto rows = static_cast<Eigen::Index>(100.0 * kSeconds);
  robot.samples.resize(rows, 1);
  for (Eigen::Index row = 0; row < rows; ++row) {
    const double x = motion(0.01 * static_cast<double>(row));
    robot.t_ns.push_back(row * 10 * core::kNsPerMs);
    robot.samples(row, 0) = 0.97 * x + error_rad * std::sin(3.0 * x) + noise(generator);
  }
  return robot;
}

/// The driver's 1 kHz, or the authors' microcontroller: every 10.4 ms, stamped with some jitter.
record::Recording truth_of(const Motion& motion, double delay_s, bool slow,
                           std::mt19937& generator) {
  record::Recording truth = empty(record::Role::kJointTruth);
  std::normal_distribution<double> jitter(0.0, slow ? 0.5e-3 : 0.0);
  const double period_s = slow ? 0.0104 : 0.001;
  std::vector<double> values;
  for (double t = -1.0; t < kSeconds + 1.0; t += period_s) {
    const double stamp_s = t + delay_s + jitter(generator);
    const auto stamp_ns = static_cast<std::int64_t>(std::llround(1e9 * stamp_s));
    truth.t_ns.push_back(truth.t_ns.empty() ? stamp_ns : std::max(stamp_ns, truth.t_ns.back()));
    values.push_back(kRadPerCount * std::round(motion(t) / kRadPerCount));
  }
  truth.samples.resize(static_cast<Eigen::Index>(values.size()), 1);
  for (std::size_t i = 0; i < values.size(); ++i)
    truth.samples(static_cast<Eigen::Index>(i), 0) = values[i];
  return truth;
}

RC_GTEST_PROP(MergeProperty, RecoversAnyDelayAndSaysHowWell, ()) {
  std::mt19937 generator(*rc::gen::arbitrary<std::uint32_t>());
  const bool slow = *rc::gen::arbitrary<bool>();
  const double delay_s = 1e-5 * *rc::gen::inRange(-6000, 6001);
  // The robot's own error hides in the delay; 0.01 rad is what a bad arm has.
  const double robot_error_rad = *rc::gen::element(0.0, 0.002, 0.01);
  const Motion motion = any_motion(generator);
  const auto merged = record::merge_truth(robot_of(motion, robot_error_rad, generator),
                                          truth_of(motion, delay_s, slow, generator));
  RC_ASSERT(merged.ok());
  const double error_s = std::abs(merged->estimate->delay_s - delay_s);
  RC_LOG() << "delay " << delay_s << " error " << error_s << " sigma " << merged->estimate->sigma_s
           << " slow " << slow;
  // Noise is in the stated error: eight of it, and 0.02 ms for interpolation. An error that depends
  // on the position is not, where the frequencies of the motion are near whole ratios: it repeats
  // alike in every stretch of the recording, and only its size bounds it.
  if (robot_error_rad == 0.0) RC_ASSERT(error_s < 8.0 * merged->estimate->sigma_s + 2e-5);
  RC_ASSERT(error_s < 2e-4 + 0.1 * robot_error_rad);
  RC_ASSERT(merged->delay_s == merged->estimate->delay_s);
}

RC_GTEST_PROP(MergeProperty, GivesATruthWhereThereIsOneAndNowhereElse, ()) {
  std::mt19937 generator(*rc::gen::arbitrary<std::uint32_t>());
  const Motion motion = any_motion(generator);
  const record::Recording robot = robot_of(motion, 0.002, generator);
  record::Recording truth = truth_of(motion, 0.0, false, generator);
  const auto rows = static_cast<std::int64_t>(truth.rows());
  const auto from = *rc::gen::inRange<std::int64_t>(2000, rows - 4000);
  const auto length = *rc::gen::inRange<std::int64_t>(1, 2000);
  for (std::int64_t i = from; i < from + length; ++i)
    truth.samples(i, 0) = std::numeric_limits<double>::quiet_NaN();
  record::MergeOptions options;
  options.fixed_delay_s = 0.0;
  options.delay.largest_s = 2e-3;  // the estimate is not asked for here
  const auto merged = record::merge_truth(robot, truth, options);
  RC_ASSERT(merged.ok());
  const std::int64_t last_ns = truth.t_ns[static_cast<std::size_t>(from - 1)];
  const std::int64_t next_ns = truth.t_ns[static_cast<std::size_t>(from + length)];
  for (Eigen::Index row = 0; row < robot.rows(); ++row) {
    const std::int64_t t = robot.t_ns[static_cast<std::size_t>(row)];
    const double label = merged->recording.samples(row, 1);
    if (t >= last_ns && t < next_ns) {
      // On the edge of the gap the last good value may stand.
      RC_ASSERT(std::isnan(label) || t == last_ns);
    } else {
      RC_ASSERT(std::abs(label - motion(1e-9 * static_cast<double>(t))) < kRadPerCount);
    }
  }
}

}  // namespace
}  // namespace ravencal::quadrature_reader
