// SPDX-License-Identifier: Apache-2.0
//
// Friction and gaps are where the joint is: their loops follow it wherever other joints' cables
// move it, and not only its own drive. What those cables do is found with the loops, in turns.
#include "diagnose/channel/channel.hpp"
#include "diagnose/effects/shapes.hpp"
#include "physics/joint_error.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::VectorXd;

/// True for what another joint does to this one.
bool of_another(const EffectForm& form) {
  return !form.from().empty() && form.traits().moves_joint;
}

/// True for loops that follow the joint.
bool follows(const EffectForm& form) { return form.from().empty() && form.traits().follows_joint; }

/// What other joints add to this one's motion, by the plant and by what was found.
VectorXd moved_by_others(const ChannelFit& fit, const physics::Plant& plant) {
  const Series& s = *fit.series;
  VectorXd moved = VectorXd::Zero(s.rows());
  if (const auto index = plant.joint_index(s.joint))
    moved = physics::moved_by_others(plant.joints[*index], signals_of(s));
  for (std::size_t i = 0; i < fit.model.chosen.size(); ++i) {
    const Chosen& chosen = fit.model.chosen[i];
    const EffectForm& form = *fit.model.candidates[chosen.candidate]->form;
    if (of_another(form)) moved += form.columns(s, chosen.shape) * coefficients_of(fit, i);
  }
  return moved;
}

}  // namespace

double follow_others(ChannelFit& fit, const physics::Plant& plant) {
  Series& s = *fit.series;
  // A replay of the cable has the load instead.
  if ((s.stage != Stage::kTransmission && s.stage != Stage::kTracking) || replayed(s)) return 0.0;
  const VectorXd moved = moved_by_others(fit, plant);
  const VectorXd former =
      s.followed.size() > 0 ? VectorXd(s.followed - s.motion.q) : VectorXd::Zero(s.rows());
  const double larger = std::max(moved.norm(), former.norm());
  if (larger == 0.0) return 0.0;
  s.followed = s.motion.q + moved;
  return (moved - former).norm() / larger;
}

void settle_loops(ChannelFit& fit, const physics::Plant& plant) {
  constexpr int kRounds = 3;
  ChannelModel& model = fit.model;
  for (int round = 0; round < kRounds && follow_others(fit, plant) > 0.0; ++round) {
    for (Chosen& chosen : model.chosen) {
      const EffectForm& form = *model.candidates[chosen.candidate]->form;
      if (follows(form))
        chosen.columns = model.blocks.gather(form.columns(*fit.series, chosen.shape));
    }
    model.hold_nominal();
    fit.coefficients = joint_fit(model);
  }
}

}  // namespace ravencal::diagnose
