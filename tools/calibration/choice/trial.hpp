// SPDX-License-Identifier: Apache-2.0
//
// One candidate model of one joint, judged by what it predicts for the parts of the training that
// it was not fitted to.
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

#include "choice/basis.hpp"

namespace ravencal::choice {

/// Penalty on the squared readout weights of scaled functions, over the mean squared error. Below
/// the least one weights grow until single precision shows; above the largest little is learned.
inline constexpr double kRidges[] = {1e-1, 1e-2, 1e-3, 1e-4, 1e-5};

/// Rows of one joint: those whose error is known.
struct JointRows {
  Eigen::MatrixXd scaled;  ///< [rows x offered inputs]
  Eigen::VectorXd errors;  ///< [rows], SI
  /// Rows that are held out in turn. The last list holds the outermost rows, which are in the
  /// others as well; it may be empty.
  std::vector<std::vector<Eigen::Index>> held_out;
  std::vector<int> homing;  ///< [rows], from 0
  int homings = 1;
};

/// A fit. Every homing has a constant of its own, which no input tells: the weights are those of
/// the motion within a homing, and the constant is the mean of the homings' constants.
struct Readout {
  Eigen::VectorXd weights;         ///< [Basis::size()], SI; the last is the constant
  std::vector<double> of_homings;  ///< constants of the homings that have rows, SI
};

struct Trial {
  std::string name;  ///< e.g. "linear on positions and their memory"
  BasisSpec basis;
  double ridge = 0.0;
  /// [lists][rows of the list], prediction - error, SI: by the fit that did not see the list. A
  /// homing with rows outside of the list keeps its constant; that of any other is left out.
  std::vector<Eigen::VectorXd> left;
  double inside_rmse = 0.0;   ///< over all lists but the outermost rows, SI
  double outside_rmse = 0.0;  ///< of the outermost rows, SI; NaN if there are none
};

/// Mean squared error of every list that has rows, SI.
std::vector<double> mean_squares(std::span<const Eigen::VectorXd> left);

/// Of candidates with these mean squared errors per list, from the simplest on: the first whose
/// mean exceeds the least one by at most the standard error of their difference over the lists.
/// What the data cannot tell apart is decided for the simpler one, which bends less outside of the
/// training. (The rule of one standard error: Breiman et al., 1984, here for differences.) Every
/// list counts alike: its errors are divided by the least of a candidate.
std::size_t simplest_of_best(const std::vector<std::vector<double>>& candidates);

double mean_of(const std::vector<double>& values);
/// Of the mean; infinity for fewer than two values.
double standard_error(const std::vector<double>& values);

/// The trial of that rule's ridge, from the strongest on.
Trial try_basis(std::string name, const BasisSpec& spec, const JointRows& rows);

/// The mean of all other rows as prediction: what bias removal does.
Trial try_bias(const JointRows& rows);

/// The basis fitted to all rows.
Readout fit_readout(const Basis& basis, double ridge, const JointRows& rows);

}  // namespace ravencal::choice
