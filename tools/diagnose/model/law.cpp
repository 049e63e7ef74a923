// SPDX-License-Identifier: Apache-2.0
//
// What the law of a joint's controller asks for along a recording.
#include <algorithm>
#include <cmath>
#include <limits>

#include "diagnose/findings/policy.hpp"
#include "diagnose/model/likelihood.hpp"
#include "diagnose/model/pulses.hpp"
#include "diagnose/track/filter.hpp"
#include "physics/predict/smoother.hpp"
#include "physics/servo_law.hpp"

namespace ravencal::diagnose {

using Eigen::Index;
using Eigen::VectorXd;

VectorXd Likelihood::command_of(const State& state, std::size_t recording,
                                std::size_t joint) const {
  const Track& track = tracks_[recording];
  const VectorXd& desired = track.joints[joint].desired;
  const auto law = physics::servo_law(state.plant.joints[joint]);
  if (!law || desired.size() == 0) return {};
  const physics::Motion& motor = track.forced.motors[joint];
  const LawCircumstances& seen = state.laws[joint];
  VectorXd command =
      law->position * (desired - motor.q) +
      law->rate * (seen.desired_rate * first_difference(desired, track.period_s) - motor.v);
  if (seen.age_s != 0.0) command -= seen.age_s * first_difference(command, track.period_s);
  if (law->limit > 0.0) command = command.cwiseMax(-law->limit).cwiseMin(law->limit);
  return command;
}

void Likelihood::settle_law(std::size_t joint) {
  const auto left_with = [&](double desired_rate) {
    base_.laws[joint].desired_rate = desired_rate;
    double left = 0.0;
    for (std::size_t r = 0; r < tracks_.size(); ++r) {
      const VectorXd command = command_of(base_, r, joint);
      const VectorXd& effort = tracks_[r].joints[joint].effort;
      if (command.size() == 0 || effort.size() == 0) continue;
      for (Index i = 0; i < effort.size(); ++i)
        if (const double off = effort[i] - command[i];
            std::isfinite(off) && tracks_[r].lost[joint][static_cast<std::size_t>(i)] == 0)
          left += off * off;
    }
    return left;
  };
  const double without = left_with(0.0);
  if (without < left_with(1.0)) base_.laws[joint].desired_rate = 0.0;
}

bool Likelihood::law_made_the_commands(std::size_t joint) const {
  ByRecording recorded(tracks_.size()), asked(tracks_.size()), left(tracks_.size());
  for (std::size_t r = 0; r < tracks_.size(); ++r) {
    const VectorXd command = command_of(base_, r, joint);
    const VectorXd& effort = tracks_[r].joints[joint].effort;
    if (command.size() == 0 || effort.size() == 0) continue;
    recorded[r] = tent(physics::without_gaps(effort), tracks_[r].tent_rows);
    asked[r] = tent(physics::without_gaps(command), tracks_[r].tent_rows);
    for (Index i = 0; i < recorded[r].size(); ++i)
      if (tracks_[r].lost[joint][static_cast<std::size_t>(i)] != 0)
        recorded[r][i] = asked[r][i] = 0;
    left[r] = recorded[r] - asked[r];
  }
  // Pulses that reach the drive may be greater than what the law asks for.
  const std::optional<Pulses> pulses = pulses_in(tracks_, joint, left);
  double least = std::numeric_limits<double>::infinity(), most = 0.0;
  for (std::size_t r = 0; r < tracks_.size(); ++r) {
    if (recorded[r].size() == 0) continue;
    if (pulses)
      recorded[r] -=
          pulses->size * tent(share_on(tracks_[r], pulses->on_s[r]), tracks_[r].tent_rows);
    const double gain = asked[r].dot(recorded[r]) / std::max(1e-300, asked[r].squaredNorm());
    const double unexplained = (recorded[r] - gain * asked[r]).squaredNorm();
    if (!(unexplained <= (1.0 - kLeastExplained) * recorded[r].squaredNorm())) return false;
    least = std::min(least, gain);
    most = std::max(most, gain);
  }
  return most > 0.0 && most <= kMostGainRatio * least;
}

}  // namespace ravencal::diagnose
