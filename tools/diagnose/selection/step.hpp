// SPDX-License-Identifier: Apache-2.0
//
// Steps of the truth at one moment: a slipped cable, or counts that an encoder lost. A step is
// looked for locally, in two windows before and after each moment, and must be twice what the same
// recording shows at 99 % of all other moments: slow wander then raises no alarm. How few moments
// are independent of each other counts as well: among ten, one is often twice as far as the rest.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "diagnose/fit/blocks.hpp"

namespace ravencal::diagnose {

struct Step {
  Eigen::Index row = 0;  ///< of the series: first row after the step
  double t_s = 0.0;
  double size = 0.0;
  double deviation = 0.0;   ///< one standard error of the size
  double ratio = 0.0;       ///< to the 99 % quantile elsewhere
  double p_value = 1.0;     ///< chance of such a step anywhere in noise like that elsewhere
  Eigen::Index window = 0;  ///< rows by which the step may be misplaced
};

/// `residual` at the training rows; `correlation_rows`: how far its noise resembles itself.
std::vector<Step> find_steps(const Series& series, const Blocks& blocks,
                             const Eigen::VectorXd& residual, double correlation_rows);

/// Size from which a step in that residual is found nine times in ten; none where too little of it
/// hangs together.
std::optional<double> least_step(const Series& series, const Blocks& blocks,
                                 const Eigen::VectorXd& residual, double correlation_rows);

/// Chance that noise whose deviation is known from `independent` values exceeds `t` of those
/// deviations at any of as many places: Student's tail by Wallace's normal (Annals of Mathematical
/// Statistics 1959), times the places, which overlapping windows double.
double chance_anywhere(double t, double independent);

/// 1 from the step on until its recording or episode ends, else 0.
Eigen::VectorXd step_column(const Series& series, const Step& step);

}  // namespace ravencal::diagnose
