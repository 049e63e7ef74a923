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
#include "choice/held_out.hpp"

namespace ravencal::choice {

/// Penalty on the squared readout weights of scaled functions, over the mean squared error. Below
/// the least one weights grow until single precision shows; above the largest little is learned.
inline constexpr double kRidges[] = {1e-1, 1e-2, 1e-3, 1e-4, 1e-5};

/// Rows of one joint: those whose error is known.
struct JointRows {
  Eigen::MatrixXd scaled;  ///< [rows x offered inputs]
  Eigen::VectorXd errors;  ///< [rows], SI
  HeldOut held_out;
  std::vector<int> session;  ///< [rows], from 0; each has a constant of its own
  int sessions = 1;
};

/// A fit. Every session has a constant of its own, which no input tells: the weights are those of
/// the motion within a session, and the constant is the mean of the sessions' constants.
struct Readout {
  Eigen::VectorXd weights;          ///< [Basis::size()], SI; the last is the constant
  std::vector<double> of_sessions;  ///< constants of the sessions that have rows, SI
};

/// The constant of a session that a fit did not see.
enum class UnseenConstant {
  kLeftOut,  ///< taken from the list's own errors: motion is judged alone
  kMean      ///< the mean of the sessions that were seen, as the model has it on a new day
};

struct Trial {
  std::string name;  ///< e.g. "linear on positions and their memory"
  BasisSpec basis;
  double ridge = 0.0;
  /// [lists][rows of the list], prediction - error, SI: by the fit that did not see the list.
  std::vector<Eigen::VectorXd> left;
  /// By how much the mean of the draws may differ from that of endlessly many: standard deviation,
  /// SI, over the list in which it is largest; 0 for one draw.
  double left_to_chance = 0.0;
  double inside_rmse = 0.0;   ///< over the parts, SI
  double inside_error = 0.0;  ///< its standard error over the parts, SI
  double outside_rmse = 0.0;  ///< over the lists beyond, SI; NaN if there are none
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
Trial try_basis(std::string name, const BasisSpec& spec, const JointRows& rows,
                UnseenConstant unseen = UnseenConstant::kLeftOut);

/// The mean of all other rows as prediction: what bias removal does.
Trial try_bias(const JointRows& rows);

/// The basis fitted to all rows.
Readout fit_readout(const Basis& basis, double ridge, const JointRows& rows);

}  // namespace ravencal::choice
