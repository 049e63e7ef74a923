// SPDX-License-Identifier: Apache-2.0
//
// Noise of one channel: white noise beside an Ornstein-Uhlenbeck process (slow wander of encoders,
// friction, temperature), turned into white noise of deviation 1 by the innovations of a Kalman
// filter. Rows that are not used are missing observations.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace ravencal::diagnose {

struct NoiseModel {
  double time_s = 0.5;       ///< of the process
  double white_ratio = 1.0;  ///< variance of the white noise over that of the process
  double deviation = 1.0;    ///< of an innovation whose variance is the process's
};

/// Rows of one recording in one channel.
struct NoiseRows {
  std::vector<char> used;
  std::vector<double> doubt;  ///< further variance of a row, over that of the process
  double period_s = 0.0;
  std::vector<char> fresh;
};

class Whitener {
 public:
  Whitener() = default;
  Whitener(const NoiseRows& rows, const NoiseModel& noise);

  /// Innovations of `x` in deviations, of the used rows in their order.
  void apply(const Eigen::VectorXd& x, Eigen::Ref<Eigen::VectorXd> out) const;
  /// The signal of which these are the innovations, at the used rows; elsewhere what is expected.
  [[nodiscard]] Eigen::VectorXd undo(const Eigen::Ref<const Eigen::VectorXd>& innovations) const;
  /// Sum over used rows of the log of an innovation's deviation, that of the model apart.
  [[nodiscard]] double log_scale() const;

 private:
  double keep_ = 0.0;  ///< of the process from one row to the next
  double deviation_ = 1.0;
  std::vector<double> gain_, weight_;  ///< weight 0: not used
  std::vector<char> fresh_;
};

/// Restricted maximum likelihood, a constant per recording apart, over a grid of time and ratio,
/// the scale by a Student t of 4 degrees of freedom. `least_share`: the scale is at least that
/// share of the innovations' RMS. `longest_s`: of the process.
NoiseModel estimate_noise(const std::vector<const NoiseRows*>& rows,
                          const std::vector<const Eigen::VectorXd*>& residuals, double least_share,
                          double longest_s);

}  // namespace ravencal::diagnose
