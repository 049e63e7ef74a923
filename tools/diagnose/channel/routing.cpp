// SPDX-License-Identifier: Apache-2.0
#include "diagnose/channel/routing.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "diagnose/effects/effect_kind.hpp"
#include "diagnose/effects/routing.hpp"
#include "diagnose/findings/policy.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using physics::Through;

constexpr std::string_view kUndecided = "unknown";

/// Stretch by the found stiffness of the joint's cable, over that by the plant's. The column of a
/// relative change of stiffness takes stretch away.
double stretch_factor(const ChannelFit& fit) {
  const auto of_spring = [&](std::size_t term) {
    const NominalTerm& t = fit.nominal->terms[term];
    return !t.form_only && traits_of(t.id).cable == CablePart::kSpring;
  };
  double change = 0.0;
  for (std::size_t t = 0; t < fit.nominal->terms.size(); ++t)
    if (of_spring(t)) change += fit.coefficients[static_cast<Index>(t) + 1];
  for (std::size_t i = 0; i < fit.model.chosen.size(); ++i) {
    const auto term = fit.model.candidates[fit.model.chosen[i].candidate]->form->nominal_term();
    if (term && of_spring(*term)) change += coefficients_of(fit, i)[0];
  }
  return std::max(1.0 - change, 0.0);
}

/// The model with the shares of that joint's cable at one end. All that links pass on is known as
/// weights and stiffnesses are.
ChannelModel pinned(const ChannelFit& fit, std::string_view joint, Through through) {
  ChannelModel model = fit.model;
  const double loads = stretch_factor(fit);
  for (std::size_t t = 0; t < fit.nominal->terms.size(); ++t) {
    const NominalTerm& term = fit.nominal->terms[t];
    if (routed_joint(term, model.series->joint) != joint) continue;
    // Half of it is in the prediction, and a column is the other half.
    auto column = model.free_base.col(static_cast<Index>(t) + 1);
    if (through == Through::kDrive) {
      model.free_target += column;
      column.setZero();
      continue;
    }
    const double whole = 2.0 * (term.parameter == kLoadShare ? loads : 1.0);
    model.free_target -= (whole - 1.0) * column;
    column *= whole;
    model.precision[static_cast<Index>(t) + 1] *=
        std::pow(model.tolerance[t] / kUnstatedTolerance, 2);
    model.tolerance[t] = kUnstatedTolerance;
    model.limit[t] = kBeyondTolerance * kUnstatedTolerance;
  }
  model.hold_nominal();
  return model;
}

bool shows(const ChannelFit& fit, std::string_view joint) {
  return std::any_of(fit.nominal->terms.begin(), fit.nominal->terms.end(),
                     [&](const NominalTerm& term) {
                       return routed_joint(term, fit.model.series->joint) == joint;
                     });
}

/// Links, drives, or something else in their place: physics that the plant lacks.
Routing decided(const std::string& joint, const std::vector<NamedChannel>& fits) {
  std::array<double, 3> score = {0.0, 0.0, kMissingCost};
  bool seen = false;
  for (const NamedChannel& named : fits) {
    if (!named.fit || !shows(*named.fit, joint)) continue;
    seen = true;
    const double unit = noise_unit(named.fit->model);
    score[0] += penalised_score(pinned(*named.fit, joint, Through::kLink), unit);
    score[1] += penalised_score(pinned(*named.fit, joint, Through::kDrive), unit);
    score[2] += penalised_score(named.fit->model, unit);
  }
  const double least = *std::min_element(score.begin(), score.end());
  double sum = 0.0;
  for (double& s : score) sum += s = seen ? std::exp(-0.5 * (s - least)) : 1.0;
  Routing out{joint, std::string(kUndecided), false, score[0] / sum, score[1] / sum};
  if (out.link >= kCredible) out.through = through_word(Through::kLink);
  if (out.drive >= kCredible) out.through = through_word(Through::kDrive);
  return out;
}

/// Without its mean over each recording.
VectorXd without_means(const Series& series, VectorXd x) {
  for (Index first = 0, last = 0; first < x.size(); first = last) {
    const int recording = series.recording[static_cast<std::size_t>(first)];
    while (last < x.size() && series.recording[static_cast<std::size_t>(last)] == recording) ++last;
    auto own = x.segment(first, last - first);
    own.array() -= own.mean();
  }
  return x;
}

/// Its cable carries that as well. Returns by how much more it stretches.
VectorXd carry(const Carried& part, Series& series) {
  const VectorXd before = series.cable_motion().stretch;
  series.weight = with(series.weight, part.weight);
  series.payload_per_kg = with(series.payload_per_kg, part.payload_per_kg);
  series.inertial = with(series.inertial, part.moving);
  CableMotion motion = series.cable_motion();
  series.transmitted = std::move(motion.tension);
  return motion.stretch - before;
}

/// Of what parts a joint's truth from its estimate, more is its cable's stretch.
void pass_on(const std::string& joint, const VectorXd& stretch, SeriesSet& set) {
  for (Series& series : set.series) {
    for (Inherited& part : series.inherited) {
      if (part.from != joint) continue;
      const VectorXd more = without_means(series, -part.factor * stretch);
      part.stretch += more;
      part.rest -= more;
    }
  }
}

}  // namespace

bool admits_both(const Series& series) {
  return !series.carried.empty() ||
         std::any_of(series.inherited.begin(), series.inherited.end(),
                     [](const Inherited& part) { return !part.through; });
}

std::vector<Routing> routings_of(const SeriesSet& set, const std::vector<NamedChannel>& fits,
                                 const physics::Plant& plant) {
  std::vector<Routing> out;
  for (std::size_t j = 0; j < plant.joints.size(); ++j) {
    const physics::Joint& joint = plant.joints[j];
    const bool recorded =
        std::any_of(set.series.begin(), set.series.end(), [&](const Series& series) {
          return series.stage == Stage::kTransmission && series.joint == joint.name;
        });
    if (!recorded || !physics::coupled(plant, j)) continue;
    if (!joint.coupling_through) {
      out.push_back(decided(joint.name, fits));
      continue;
    }
    const bool link = *joint.coupling_through == Through::kLink;
    out.push_back({joint.name, std::string(through_word(*joint.coupling_through)), true,
                   link ? 1.0 : 0.0, link ? 0.0 : 1.0});
  }
  return out;
}

std::vector<char> route(const std::vector<Routing>& routings, SeriesSet& set) {
  std::vector<char> changed(set.series.size(), 0);
  for (const Routing& routing : routings) {
    if (routing.by_plant || routing.through == kUndecided) continue;
    const bool link = routing.through == through_word(Through::kLink);
    for (std::size_t i = 0; i < set.series.size(); ++i) {
      Series& series = set.series[i];
      for (Inherited& part : series.inherited) {
        if (series.joint != routing.joint) continue;
        part.through = link ? Through::kLink : Through::kDrive;
        changed[i] = 1;
      }
      const auto by_it = [&](const Carried& part) { return part.from == routing.joint; };
      for (const Carried& part : series.carried)
        if (link && by_it(part)) pass_on(series.joint, carry(part, series), set);
      if (std::erase_if(series.carried, by_it) > 0) changed[i] = 1;
    }
  }
  return changed;
}

std::string sentence_for(const Routing& routing) {
  if (routing.by_plant) return {};
  if (routing.through == kUndecided)
    return fmt::format(
        "the plant does not say whether joint {}'s cable follows the links or the drives of the "
        "joints that move it, and these recordings do not tell (links {:.0f} %, drives {:.0f} %): "
        "nothing was named that either explains",
        routing.joint, 100.0 * routing.link, 100.0 * routing.drive);
  return fmt::format(
      "joint {}'s cable was taken to follow the {}s of the joints that move it, {:.1f} % likely by "
      "these recordings; the plant does not say",
      routing.joint, routing.through, 100.0 * std::max(routing.link, routing.drive));
}

}  // namespace ravencal::diagnose
