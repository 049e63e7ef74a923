// SPDX-License-Identifier: Apache-2.0
//
// One joint's drive of one plant, on its own along recordings: from recorded states on it moves
// under the recorded effort, or under a controller that follows the recorded desired position.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <functional>
#include <optional>
#include <vector>

#include "diagnose/model/likelihood.hpp"
#include "physics/predict/run_drive.hpp"

namespace ravencal::diagnose {

class PlantDrive {
 public:
  /// Both must outlive it.
  PlantDrive(const physics::Plant& plant, const Likelihood& rows, std::size_t joint);

  /// Sums over rows after the first of each window.
  struct Errors {
    double squares = 0.0, magnitudes = 0.0, rows = 0.0;

    void add(double error) {
      squares += error * error;
      magnitudes += std::abs(error);
      rows += 1.0;
    }
    [[nodiscard]] double rms() const { return std::sqrt(squares / rows); }
    [[nodiscard]] double mean() const { return magnitudes / rows; }
  };

  /// In windows of that length under the recorded effort.
  [[nodiscard]] Errors under_effort(double window_s);
  /// Over whole stretches.
  [[nodiscard]] Errors under(const physics::ServoLaw& law);
  /// Errors of the positions under the recorded effort, rad or m: [window][row after the first].
  [[nodiscard]] std::vector<Eigen::VectorXd> windows_under_effort(double window_s);

 private:
  struct Window {
    Eigen::Index first = 0, last = 0;
  };
  using AddWindow = std::function<void(const Eigen::VectorXd& errors)>;

  [[nodiscard]] std::vector<Window> windows_of(const Track& track, const Eigen::VectorXd& driven_by,
                                               double least_s, double longest_s) const;
  void run(const std::optional<physics::ServoLaw>& law, double window_s, const AddWindow& add);
  void run(std::size_t recording, const std::vector<Window>& windows, const AddWindow& add);
  [[nodiscard]] physics::DriveLoad load_along(std::size_t recording,
                                              const Eigen::VectorXd& side) const;
  [[nodiscard]] Eigen::VectorXd asked_of_motor(std::size_t recording,
                                               const physics::Plant& plant) const;

  const physics::Plant& plant_;
  const Likelihood& rows_;
  std::size_t joint_;
  double least_presliding_ = 0.0;
  physics::RunningDrive drive_;
};

}  // namespace ravencal::diagnose
