// SPDX-License-Identifier: Apache-2.0
//
// Which samples of a recording each row of a track is the mean of.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "record/recording.hpp"

namespace ravencal::diagnose {

inline constexpr Eigen::Index kFewestTrackRows = 50;
/// Reach of a difference that tells motion from the encoder's counts, and the counts.
inline constexpr double kStillS = 0.04;
inline constexpr double kStillQuanta = 2.5;

struct Grid {
  double period_s = 0.0;
  double begins_s = 0.0;
  Eigen::VectorXd t_s;
  std::vector<char> fresh;
  std::vector<Eigen::Index> first;    ///< sample of each row of the track
  std::vector<Eigen::Index> samples;  ///< of each row
  bool at_rest = false;               ///< each row is a rest

  [[nodiscard]] Eigen::Index rows() const { return t_s.size(); }
  /// One past the last sample.
  [[nodiscard]] Eigen::Index end() const { return first.back() + samples.back(); }
};

/// Samples from `from_s` to `to_s` in rows of one period, at most kWorkingRateHz.
Grid grid_of(const record::Recording& recording, double from_s, double to_s);

/// A recorded position, and the least move in its unit that is no count of its encoder.
struct RecordedPosition {
  Eigen::Index column = 0;
  double least_move = 0.0;
};

/// One row per rest: samples that follow each other within a least move of the first, at which no
/// position moved. Nothing where there are too few rests, or where motion gives rows of
/// `period_s`.
std::optional<Grid> rests_of(const record::Recording& recording,
                             const std::vector<RecordedPosition>& positions, double period_s,
                             double from_s, double to_s);

}  // namespace ravencal::diagnose
