// SPDX-License-Identifier: Apache-2.0
//
// Which rows of the training judge a model that was fitted to the others.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

namespace ravencal::choice {

/// The motion of a joint's rows.
struct Motion {
  Eigen::MatrixXd positions;  ///< [rows x positions], in any unit
  Eigen::MatrixXd speeds;     ///< [rows x joints], SI, >= 0; NaN where unknown
  Eigen::MatrixXd efforts;    ///< [rows x joints], SI, >= 0; NaN where unknown
};

/// Lists of rows that are held out in turn; a model that predicts some is fitted to all others.
struct HeldOut {
  /// First `parts` lists that hold every row once. Then, where the motion has such rows, the half
  /// that is farthest from the middle of the ranges of position, the faster half, and the half with
  /// the larger efforts: a robot moves beyond what it was calibrated on, and a model that bends
  /// away there must lose against one that does not.
  std::vector<std::vector<Eigen::Index>> lists;
  std::size_t parts = 0;
  bool by_recording = false;
};

/// Parts are whole recordings where there are two or more, because a recording has its own homing,
/// load and speed; else stretches of time, because neighbours resemble each other. `recording` is
/// that of each row.
HeldOut held_out_parts(std::span<const int> recording, const Motion& motion);

}  // namespace ravencal::choice
