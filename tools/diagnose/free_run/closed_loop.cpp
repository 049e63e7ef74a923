// SPDX-License-Identifier: Apache-2.0
#include "diagnose/free_run/closed_loop.hpp"

#include <algorithm>
#include <cmath>

#include "diagnose/channel/channel.hpp"

namespace ravencal::diagnose {

using Eigen::Index;

namespace {

constexpr Index kLeastRows = 100;

/// Largest magnitude of the command if it stands there repeatedly: the drive's limit.
double limit_of(const Series& command, Index first, Index last) {
  const double most = command.y.segment(first, last - first).cwiseAbs().maxCoeff();
  int there = 0;
  for (Index i = first; i < last; ++i)
    there += std::abs(command.y[i]) >= most * (1.0 - 1e-9) ? 1 : 0;
  return there >= 5 ? most : 0.0;
}

}  // namespace

ServoLaw recorded_law(const Series& command, Index first, Index last) {
  Series seen = command;
  std::fill(seen.held_out.begin(), seen.held_out.end(), 0);
  const Eigen::Vector3d gains = recorded_gains(seen, first, last);
  ServoLaw law{gains[0], -gains[1], gains[2], limit_of(command, first, last)};
  // A velocity that hardly moves the command is noise of the fit.
  const double scale = std::abs(law.position) * command.position_error.cwiseAbs().mean();
  if (std::abs(law.rate) * command.measured_rate.cwiseAbs().mean() < 0.02 * scale) law.rate = 0.0;
  if (std::abs(law.desired_rate) * command.desired_rate.cwiseAbs().mean() < 0.02 * scale)
    law.desired_rate = 0.0;
  return law;
}

ServoLaw plant_law(const physics::Joint& joint, const ServoLaw& recorded) {
  ServoLaw law = physics::servo_law(joint).value_or(ServoLaw{});
  const bool fed_forward = recorded.desired_rate > 0.5 * std::abs(recorded.rate);
  law.desired_rate = fed_forward ? law.rate : 0.0;
  law.limit = recorded.limit;
  return law;
}

std::vector<FreeRunWindow> closed_loop_stretches(const Series& s) {
  const bool held_out = s.any_held_out();
  std::vector<FreeRunWindow> stretches;
  Index first = 0;
  for (Index i = 0; i <= s.rows(); ++i) {
    const auto n = static_cast<std::size_t>(i);
    const bool usable = i < s.rows() && s.valid[n] != 0 && (!held_out || s.held_out[n] != 0);
    if (usable && s.fresh[n] == 0) continue;
    if (i - first >= kLeastRows) stretches.push_back({first, i});
    first = usable ? i : i + 1;
  }
  return stretches;
}

std::vector<double> closed_loop_errors(const FreeRun& run, const Series& command,
                                       const physics::DriveNumbers<double>& numbers,
                                       const ServoLaw& law, const FreeRunWindow& stretch) {
  const Series& s = run.series();
  physics::DriveState<double> state{s.motion.q[stretch.first], s.motion.v[stretch.first],
                                    run.side(stretch.first)};
  std::vector<double> errors;
  for (Index i = stretch.first; i + 1 < stretch.last; ++i) {
    const double dt_s = s.t_s[i + 1] - s.t_s[i];
    const int steps = std::max(1, static_cast<int>(std::ceil(dt_s / kFreeRunStepS - 1e-6)));
    for (int k = 0; k < steps; ++k) {
      const double share = (k + 0.5) / steps;
      const auto between = [&](Index row) { return s.motion.q[row] + command.position_error[row]; };
      const double desired = (1.0 - share) * between(i) + share * between(i + 1);
      const double desired_rate =
          (1.0 - share) * command.desired_rate[i] + share * command.desired_rate[i + 1];
      const double effort = law.effort(desired - state.position, state.velocity, desired_rate);
      physics::step_drive(numbers, effort, run.load(numbers, state.position, i), dt_s / steps,
                          state);
    }
    errors.push_back(state.position - s.motion.q[i + 1]);
  }
  return errors;
}

}  // namespace ravencal::diagnose
