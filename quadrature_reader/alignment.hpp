// SPDX-License-Identifier: Apache-2.0
//
// Puts true joint positions (from the encoders' recording) beside the robot's states (from its own
// recording): relates the two clocks, estimates the transport delay between the two paths from
// their velocities, and interpolates the truth at each state's own time. Knows no device.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "record/recording.hpp"

namespace ravencal::quadrature_reader {

/// Positions of joints over time, e.g. a recording's columns. NaN: unknown.
struct Track {
  std::span<const std::int64_t> t_ns;                       ///< never decreasing
  std::vector<Eigen::Ref<const Eigen::VectorXd>> position;  ///< one per joint, SI, length of t_ns
};

struct DelayEstimate {
  double delay_s =
      0.0;  ///< truth stamps are this much later than the robot's; truth(t + delay) fits robot(t)
  double sigma_s = 0.0;      ///< standard error, from leaving out stretches of the recording
  double correlation = 0.0;  ///< of the velocities at that delay, best joint
};

struct DelayOptions {
  double largest_s = 0.1;  ///< search within +- this
};

/// The delay at which the increments of both tracks fit best, all joints together: maximum
/// likelihood with a gain and a noise of its own for each joint. Compliance or friction that makes
/// the robot's estimate lead or lag the joint is part of the result; it cannot be told apart.
/// Errors: too little motion, opposite sign, unrelated motion, best fit at the edge of the search.
core::Result<DelayEstimate> estimate_delay(const Track& robot, const Track& truth,
                                           std::span<const std::string> joints,
                                           const DelayOptions& options = {});

/// CLOCK_REALTIME - CLOCK_MONOTONIC as a line through a recording's clock_offset events.
struct ClockRelation {
  std::int64_t reference_ns = 0;  ///< monotonic instant of offset_ns
  std::int64_t offset_ns = 0;
  double drift_ppm = 0.0;
  double residual_ns = 0.0;  ///< largest distance of an event from the line

  [[nodiscard]] std::int64_t realtime_of(std::int64_t monotonic_ns) const;
};

/// Error if the recording has no such events, or the wall clock was stepped (residual above 1 ms).
core::Result<ClockRelation> clock_relation(const record::Recording& recording);

struct MergeOptions {
  bool robot_uses_realtime = false;  ///< robot stamps are CLOCK_REALTIME (ROS on the same machine)
  std::int64_t truth_minus_robot_ns = 0;  ///< further known difference of the stamps
  DelayOptions delay;
  std::optional<double> fixed_delay_s;       ///< use this instead of estimating
  std::int64_t longest_gap_ns = 50'000'000;  ///< no interpolation across more than this
};

struct Merged {
  record::Recording recording;  ///< the robot's rows with the truth channels added
  DelayEstimate delay;
  std::optional<ClockRelation> clock;
  std::int64_t rows_with_truth = 0;  ///< rows in which every joint has its truth
};

/// Errors: no joint has both an estimate in `robot` and a truth in `truth`; the delay cannot be
/// estimated; the recordings do not overlap.
core::Result<Merged> merge_truth(const record::Recording& robot, const record::Recording& truth,
                                 const MergeOptions& options = {});

}  // namespace ravencal::quadrature_reader
