// SPDX-License-Identifier: Apache-2.0
//
// A recording as the model sees it: rows of one period (at most kWorkingRateHz), every signal at
// its joint, in rad and N m or m and N.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "physics/plant.hpp"
#include "physics/predict/predict.hpp"
#include "record/recording.hpp"

namespace ravencal::diagnose {

inline constexpr double kWorkingRateHz = 50.0;

/// One joint's signals; empty where they were not recorded, NaN where they were lost.
struct JointTrack {
  Eigen::VectorXd effort;   ///< of the drive
  Eigen::VectorXd truth;    ///< of the external encoder, or what followed the command
  Eigen::VectorXd desired;  ///< position of the motor that the controller wants, at the joint
  double quantum = 0.0;     ///< of the motor's encoder, at the joint
  /// Mean square of the effort about its mean, noise apart, sample by sample; 0 of rests.
  double effort_power = 0.0;
  /// `truth` is a measured position that followed the command. The motor is the command or, where
  /// the plant states the law by which it followed (ForcedMotion::followed), what was measured.
  bool tracking = false;
  /// Taken off `effort` and `truth` where another simulator is the baseline: what it predicts less
  /// what the given plant does. Empty: nothing.
  Eigen::VectorXd effort_shift, truth_shift;
};

/// A recorded load that may stretch cables.
struct RecordedLoad {
  std::string name;  ///< as ForcedMotion::load knows it
  std::string unit;
  std::string joint;  ///< on which it acts; empty: any
};

struct Track {
  double period_s = 0.0;
  double begins_s = 0.0;       ///< of the first row, in the recording
  Eigen::Index tent_rows = 1;  ///< half width of the filter
  /// Each row is the mean of a rest. No speed and no acceleration; the sign of `forced.motors.v`
  /// says from which side the rest was approached.
  bool at_rest = false;
  physics::ForcedMotion forced;
  std::vector<JointTrack> joints;  ///< as in the plant
  /// 1 where the drives were off or a signal was lost: no row within the filter's reach is used.
  std::vector<std::vector<char>> lost;  ///< [joint]
  std::vector<RecordedLoad> loads;      ///< without those from outside that the plant names
  std::size_t recording = 0;            ///< its place, held-out recordings last

  [[nodiscard]] Eigen::Index rows() const { return forced.t_s.size(); }
};

/// Rows from `from_s` to `to_s` of the recording. Signals that effects of the plant follow and
/// nobody recorded count as none. Error (kData): too few rows.
core::Result<Track> make_track(const record::Recording& recording, const physics::Plant& plant,
                               double from_s, double to_s);

}  // namespace ravencal::diagnose
