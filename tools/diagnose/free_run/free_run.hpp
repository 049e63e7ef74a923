// SPDX-License-Identifier: Apache-2.0
//
// The judge: the drive of a plant runs free, from the measured state at the start of each window,
// and is asked where it ends up; under the recorded effort, or with the controller in the loop.
// Equation error screens and fits; an effect that does not help here is statistics only. Cable and
// motor move as one body (physics/drive_model.hpp).
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <vector>

#include "diagnose/series/series.hpp"
#include "physics/drive_model.hpp"
#include "physics/plant.hpp"

namespace ravencal::diagnose {

inline constexpr double kFreeRunWindowS = 1.0;
inline constexpr double kFreeRunStepS = 1e-3;  ///< longest step of the integration

/// Which rows the windows cover.
enum class FreeRunRows { kTraining, kHeldOut };

/// Rows [first, last).
struct FreeRunWindow {
  Eigen::Index first = 0;
  Eigen::Index last = 0;
};

/// Whole windows of `length_s` on valid rows of one episode, end to end.
std::vector<FreeRunWindow> free_run_windows(const Series& series, FreeRunRows rows,
                                            double length_s = kFreeRunWindowS);

/// What one joint's drive needs besides its numbers: signals and the shape of its load.
class FreeRun {
 public:
  /// `drive` must outlive the object. `found_load`: effort that posture takes beyond the plant's
  /// weight, a row each; empty if none.
  FreeRun(const Series& drive, const physics::Plant& plant, const Eigen::VectorXd& found_load = {});

  /// False if the plant lacks the joint or the recording its effort.
  [[nodiscard]] bool possible() const { return possible_; }

  /// Numbers of that plant's joint, as this series sees them.
  [[nodiscard]] physics::DriveNumbers<double> numbers(const physics::Plant& plant) const;

  /// Positions that the drive predicts at the window's samples but the first, under the recorded
  /// effort. `visit(row, position)`.
  template <typename T, typename Visit>
  void run(const physics::DriveNumbers<T>& n, const FreeRunWindow& w, Visit&& visit) const;

  /// Effort that holds the link at `position`.
  template <typename T>
  [[nodiscard]] T load(const physics::DriveNumbers<T>& n, const T& position,
                       Eigen::Index row) const;

  [[nodiscard]] double limit() const { return limit_; }
  [[nodiscard]] double side(Eigen::Index row) const { return side_[row]; }
  [[nodiscard]] const Series& series() const { return *series_; }

 private:
  const Series* series_;
  bool possible_ = false;
  bool pendulum_ = false;  ///< weight follows the position; otherwise it is a signal
  double sine_ = 0.0;      ///< of the pendulum's holding effort at the nominal weight
  double cosine_ = 0.0;
  double limit_ = 0.0;    ///< of the effort; 0: none
  Eigen::VectorXd side_;  ///< direction of motion, held at rest
  /// Found load, and effort of friction behind cables that does not turn with this motor: other
  /// joints', and its own while others move the joint against it.
  Eigen::VectorXd beyond_;
};

/// Errors of position (rad or m) over those windows, one list per window.
std::vector<std::vector<double>> free_run_errors(const FreeRun& run,
                                                 const physics::DriveNumbers<double>& numbers,
                                                 const std::vector<FreeRunWindow>& windows);

/// Root mean square over all of them; negative if there are none.
double rms_of(const std::vector<std::vector<double>>& errors);

// ------------------------------------------------------------------------------------------------

template <typename T>
T FreeRun::load(const physics::DriveNumbers<T>& n, const T& position, Eigen::Index row) const {
  using std::cos;
  using std::sin;
  if (pendulum_)
    return n.weight_scale * (sine_ * sin(position) + cosine_ * cos(position)) + beyond_[row];
  return n.weight_scale * (series_->weight.size() > 0 ? series_->weight[row] : 0.0) + beyond_[row];
}

template <typename T, typename Visit>
void FreeRun::run(const physics::DriveNumbers<T>& n, const FreeRunWindow& w, Visit&& visit) const {
  const Series& s = *series_;
  physics::DriveState<T> state{T(s.motion.q[w.first]), T(s.motion.v[w.first]), T(side_[w.first])};
  for (Eigen::Index i = w.first; i + 1 < w.last; ++i) {
    const double dt_s = s.t_s[i + 1] - s.t_s[i];
    const int steps = std::max(1, static_cast<int>(std::ceil(dt_s / kFreeRunStepS - 1e-6)));
    const double h = dt_s / steps;
    for (int k = 0; k < steps; ++k) {
      const double share = (k + 0.5) / steps;
      double effort = (1.0 - share) * s.recorded[i] + share * s.recorded[i + 1];
      if (limit_ > 0.0) effort = std::clamp(effort, -limit_, limit_);
      physics::step_drive(n, T(effort), load(n, state.position, i), h, state);
    }
    visit(i + 1, state.position);
  }
}

}  // namespace ravencal::diagnose
