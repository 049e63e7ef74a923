// SPDX-License-Identifier: Apache-2.0
#include "physics/predict/run_drive.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "physics/plant_effort.hpp"

namespace ravencal::physics {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// One of the steps from a row to the next.
struct Substep {
  Index row;
  double number, of;
  double dt_s;
};

double between(const VectorXd& values, Index row, double share) {
  return (1.0 - share) * values[row] + share * values[row + 1];
}

struct Asked {
  double effort, velocity;
};

/// Moves the drive on under its law; gives what that asked for where the step begins. The effort
/// acts there, between a velocity of half a step before and one of half a step after, so that their
/// mean is the one that belongs to it: half a step of damping looks like inertia.
Asked step_under_law(const RunningDrive& drive, const DriveSignals& signals, const Substep& step,
                     DriveState<double>& state) {
  const VectorXd& desired = signals.desired;
  const bool off = !signals.off.empty() && signals.off[static_cast<std::size_t>(step.row)] != 0;
  const double wanted = between(desired, step.row, step.number / step.of);
  const double wanted_velocity =
      drive.law->desired_rate != 0.0
          ? (desired[step.row + 1] - desired[step.row]) / (step.dt_s * step.of)
          : 0.0;
  const double held = drive.load.at(state.position, step.row);
  const DriveState<double> before = state;
  const double ahead =
      drive.law->effort_ahead(wanted - before.position, before.velocity, wanted_velocity);
  step_drive(drive.numbers, ahead, held, step.dt_s, state, drive.law->half_rate());
  Asked asked{0.0, 0.5 * (before.velocity + state.velocity)};
  const double effort = ahead - drive.law->half_rate() * state.velocity;
  asked.effort = off ? 0.0 : drive.limited(drive.law->limited(effort));
  if (asked.effort == effort) return asked;
  state = before;
  step_drive(drive.numbers, asked.effort, held, step.dt_s, state);
  asked.velocity = 0.5 * (before.velocity + state.velocity);
  return asked;
}

void step_under_effort(const RunningDrive& drive, const DriveSignals& signals, const Substep& step,
                       DriveState<double>& state) {
  const bool off = !signals.off.empty() && signals.off[static_cast<std::size_t>(step.row)] != 0;
  const double effort = between(signals.effort, step.row, (step.number + 0.5) / step.of);
  step_drive(drive.numbers, off ? 0.0 : drive.limited(effort),
             drive.load.at(state.position, step.row), step.dt_s, state);
}

}  // namespace

double DriveLoad::at(double position, Index row) const {
  const double along = recorded.size() > 0 && std::isfinite(recorded[row]) ? recorded[row] : 0.0;
  if (sine == 0.0 && cosine == 0.0) return along;
  return along + sine * std::sin(position) + cosine * std::cos(position);
}

std::optional<DriveLoad> pendulum_load(const Plant& plant) {
  if (plant.joints.size() != 1 || plant.joints[0].kind != JointKind::kRevolute ||
      plant.joints[0].external_load)
    return std::nullopt;
  const VectorXd quarter = (VectorXd(2) << 0.5 * std::numbers::pi, 0.0).finished();
  const VectorXd effort = holding_efforts(plant, {quarter}).front();
  if (effort.size() == 0) return std::nullopt;
  return DriveLoad{{}, effort[0], effort[1]};
}

double RunningDrive::limited(double effort) const {
  return effort_limit > 0.0 ? std::clamp(effort, -effort_limit, effort_limit) : effort;
}

Index run_drive(const RunningDrive& drive, const DriveSignals& signals, Index first, Index last,
                DriveRun& out) {
  DriveState<double> state{signals.position[first], signals.velocity[first],
                           signals.bristle[first]};
  for (Index i = first; i < last; ++i) {
    // The state a run starts from is as it was recorded, lost values included.
    if (i > first && !std::isfinite(state.position)) return i;
    out.position[i] = state.position;
    out.velocity[i] = state.velocity;
    if (i + 1 == signals.t_s.size()) break;
    const double dt_s = signals.t_s[i + 1] - signals.t_s[i];
    const double steps = std::max(1.0, std::ceil(dt_s / drive.longest_step_s - 1e-6));
    // Nobody asks where the last row's step leads; behind it may be a gap of a day.
    const double taken = i + 1 < last ? steps : 1.0;
    for (double k = 0.0; k < taken; ++k) {
      const Substep step{i, k, steps, dt_s / steps};
      if (!drive.law) {
        step_under_effort(drive, signals, step, state);
        continue;
      }
      const Asked asked = step_under_law(drive, signals, step, state);
      if (k > 0.0) continue;
      out.effort[i] = asked.effort;
      out.velocity[i] = asked.velocity;
    }
  }
  return last;
}

}  // namespace ravencal::physics
