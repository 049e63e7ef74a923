// SPDX-License-Identifier: Apache-2.0
//
// Sizes of a set of the cable's effects, all together through one replay.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "diagnose/selection/cable_members.hpp"

namespace ravencal::diagnose {

/// Fits all numbers of a set together with the linear terms of the model, on a thinned replay.
class CableFit {
 public:
  /// `rest`: the model without any member of the family; must outlive the object.
  explicit CableFit(const ChannelModel& rest);

  [[nodiscard]] CableSubset fit(const std::vector<const CableMember*>& members) const;

  /// The set with its numbers moved from where they are to where they fit best.
  [[nodiscard]] CableSubset improved(CableSubset start) const;

  /// RMS of what the linear terms alone leave.
  [[nodiscard]] double left() const { return left_; }

 private:
  class Cost;

  [[nodiscard]] Eigen::VectorXd change(const CableNumbers& cable) const;
  /// Coefficients of the linear terms within their limits, and what they leave.
  [[nodiscard]] Eigen::VectorXd linear_fit(const Eigen::VectorXd& y) const;
  [[nodiscard]] double error_of(const Eigen::VectorXd& change) const;

  const Series& series_;
  Eigen::VectorXd t_s_, motor_, weight_, inertial_;
  std::vector<char> fresh_;
  std::vector<Eigen::Index> used_;  ///< thinned rows that are fitted
  Eigen::MatrixXd linear_;          ///< at those rows
  Eigen::VectorXd precision_;
  Eigen::VectorXd target_;
  Eigen::MatrixXd normal_;  ///< of the linear terms
  Eigen::VectorXd limit_;   ///< of their coefficients
  Eigen::VectorXd nominal_stretch_;
  double left_ = 0.0;
};

}  // namespace ravencal::diagnose
