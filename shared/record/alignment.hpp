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

namespace ravencal::record {

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
/// likelihood with a gain and a noise of its own for each joint. The result contains the lag of the
/// joint behind the robot's estimate by play and friction, which cannot be told apart: some
/// milliseconds on a cable-driven arm at a few degrees per second, and outside sigma_s. Errors: too
/// little motion, opposite sign, unrelated motion, best fit at the edge of the search.
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
core::Result<ClockRelation> clock_relation(const Recording& recording);

/// Which clock stamped the robot's states.
enum class RobotClock {
  kFind,  ///< the one of these two under which the recordings overlap
  kSame,  ///< the one that stamped the truth
  kWall,  ///< CLOCK_REALTIME (ROS); the truth's clock_offset events relate it to the truth's
};

struct MergeOptions {
  RobotClock clock = RobotClock::kFind;
  std::int64_t truth_minus_robot_ns = 0;  ///< further known difference of the stamps
  DelayOptions delay;
  std::optional<double> fixed_delay_s;       ///< use this; the estimate is for comparison only
  std::int64_t longest_gap_ns = 50'000'000;  ///< no interpolation across more than this
};

struct MergedJoint {
  std::string name;
  std::int64_t rows_with_truth = 0;
};

struct Merged {
  Recording recording;   ///< the robot's rows with the truth channels and events added
  double delay_s = 0.0;  ///< by which the truth was shifted
  std::optional<DelayEstimate> estimate;  ///< absent if a delay was given and none can be estimated
  std::optional<ClockRelation> clock;     ///< absent if one clock stamped both
  std::vector<MergedJoint> joints;
  std::int64_t rows_with_truth = 0;  ///< rows in which every joint has its truth
};

/// The robot's recording with a channel `truth.JOINT` for each joint that has an estimate there and
/// a truth in `truth`, replacing any truth that it had. The truth is interpolated at each row's own
/// time; where it has a gap the row has none. The truth's events are added at the robot's times;
/// the event `merge` and meta describe the merge. Errors: no joint in common; the recordings do not
/// overlap; the delay cannot be estimated; no row has any truth.
core::Result<Merged> merge_truth(const Recording& robot, const Recording& truth,
                                 const MergeOptions& options = {});

}  // namespace ravencal::record
