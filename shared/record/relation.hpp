// SPDX-License-Identifier: Apache-2.0
//
// What the values of two columns say of each other.
#pragma once

#include <Eigen/Core>
#include <optional>

namespace ravencal::record {

/// Fewer rows say nothing of a relation.
inline constexpr Eigen::Index kFewestRows = 10;
/// A copy of a position correlates with it at least so far, and so does the integral of its
/// velocity.
inline constexpr double kCopyCorrelation = 0.98;
inline constexpr double kDerivativeCorrelation = 0.9;
/// Two positions of one joint correlate at least so far, however late the second follows.
inline constexpr double kSameMotion = 0.5;

/// y = offset + slope * x by least squares, over the rows where both are finite.
struct Line {
  double slope = 0.0, offset = 0.0;
  double correlation = 0.0;  ///< -1 to 1
};

/// Nothing where fewer than ten rows are left or one of the two does not change.
std::optional<Line> line_through(const Eigen::VectorXd& x, const Eigen::VectorXd& y);

/// The change of `position` against the integral of `velocity`, window by window: slope 1 where
/// both have the same unit and sign. Times in s.
std::optional<Line> derivative_line(const Eigen::VectorXd& t_s, const Eigen::VectorXd& position,
                                    const Eigen::VectorXd& velocity);

/// How much of an effort the motion of a joint explains by its weight, friction and inertia.
inline constexpr double kLeastExplained = 0.2;  ///< a smaller share says nothing
struct EffortFit {
  double share = 0.0;       ///< of the effort's variance, 0 to 1
  bool reversed = false;    ///< friction and inertia both have the negative sign
  double by_inertia = 0.0;  ///< share of the inertia alone
};
std::optional<EffortFit> effort_of_motion(const Eigen::VectorXd& t_s,
                                          const Eigen::VectorXd& position,
                                          const Eigen::VectorXd& effort);

/// True if one of the two moves before the other: their difference goes with the velocity.
bool leads(const Eigen::VectorXd& position, const Eigen::VectorXd& other);

/// True if a column is a linear function of some others, as a position that a controller computes
/// from its motors is. [rows, others]
bool computed_from(const Eigen::VectorXd& column, const Eigen::MatrixXd& others);

}  // namespace ravencal::record
