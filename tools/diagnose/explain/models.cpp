// SPDX-License-Identifier: Apache-2.0
#include "diagnose/explain/models.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "diagnose/findings/policy.hpp"

namespace ravencal::diagnose {
namespace {

std::vector<Routing> routings_of(const Model& model, const Likelihood& training) {
  std::vector<Routing> out;
  const physics::Plant& plant = training.base().plant;
  const std::vector<const Parameter*> free = model.free();
  for (std::size_t k = 0; k < free.size(); ++k) {
    const Parameter& share = *free[k];
    if (share.reaches != Reaches::kRouting) continue;
    Routing routing{plant.joints[share.joint].name, "unknown"};
    const auto i = static_cast<Eigen::Index>(k);
    const double deviation = std::sqrt(model.judgement.covariance(i, i));
    routing.link = 0.5 * std::erfc((0.5 - share.value()) / (deviation * std::sqrt(2.0)));
    routing.drive = 1.0 - routing.link;
    if (routing.link >= kCredible) routing.through = physics::through_word(physics::Through::kLink);
    if (routing.drive >= kCredible)
      routing.through = physics::through_word(physics::Through::kDrive);
    out.push_back(std::move(routing));
  }
  for (std::size_t j = 0; j < plant.joints.size(); ++j) {
    const physics::Joint& joint = plant.joints[j];
    if (!joint.coupling_through || !physics::coupled(plant, j)) continue;
    const bool link = *joint.coupling_through == physics::Through::kLink;
    out.push_back({joint.name, std::string(physics::through_word(*joint.coupling_through)), true,
                   link ? 1.0 : 0.0, link ? 0.0 : 1.0});
  }
  return out;
}

/// A plant says one way of a cable that other joints move; where it says none, it means their
/// drives. False: there is no such cable.
bool take_ways(const std::vector<Routing>& routings, const physics::Plant& plant, Model& model) {
  bool any = false;
  for (Parameter& share : model.numbers) {
    if (share.reaches != Reaches::kRouting) continue;
    for (const Routing& r : routings)
      if (r.joint == plant.joints[share.joint].name) share.x = r.link >= kCredible ? 1.0 : 0.0;
    share.held = any = true;
  }
  return any;
}

/// False: the plant says them already.
bool say_ways(const std::vector<Routing>& routings, physics::Plant& plant) {
  bool any = false;
  for (const Routing& routing : routings) {
    for (const physics::Through through : {physics::Through::kLink, physics::Through::kDrive}) {
      if (routing.through != physics::through_word(through)) continue;
      std::optional<physics::Through>& said =
          plant.joints[*plant.joint_index(routing.joint)].coupling_through;
      any = any || said != through;
      said = through;
    }
  }
  return any;
}

/// Of the names that are not certain in the fitted model, or do not show in the written one or pay
/// there on motion that no fit saw, the one that gains least on it.
std::optional<std::size_t> least_worth(const Model& fitted, const Model& written,
                                       const Likelihood& training, const Vocabulary& vocabulary,
                                       const Search& search) {
  std::optional<std::size_t> least;
  double least_gain = 0.0;
  for (const std::size_t c : written.chosen) {
    Model less = without(written, vocabulary, c);
    fit(training, less);
    const bool paid = vocabulary.candidates[c].searched() || search.pays(written, less);
    if (paid && search.certain(fitted, written, c) && search.shows(written, less, c)) continue;
    const double gain = search.unseen_gain(written, less);
    if (least && gain >= least_gain) continue;
    least_gain = gain;
    least = c;
  }
  return least;
}

bool changes_plant(const Model& model, const Vocabulary& vocabulary) {
  return std::any_of(model.chosen.begin(), model.chosen.end(),
                     [&](std::size_t c) { return !vocabulary.candidates[c].beyond_plants(); });
}

/// The best model as a plant has it: no plant holds a shape without a name or part of a cable's
/// way, so numbers and effects are fitted without any.
Model plain_of(const Model& best, const Likelihood& training, const Vocabulary& vocabulary) {
  Model plain = best;
  for (const std::size_t c : best.chosen)
    if (vocabulary.candidates[c].unnamed()) plain = without(plain, vocabulary, c);
  const bool ways = take_ways(routings_of(best, training), training.base().plant, plain);
  if (ways || plain.chosen.size() < best.chosen.size()) fit(training, plain);
  return plain;
}

/// Without the moves of numbers that do not pay on motion that no fit saw, joint by joint: first of
/// its drive and cable, then of its link, which is seen through these alone. Where nothing is named
/// that a plant holds, none is kept.
Model with_what_pays(const Model& plain, const Likelihood& training, const Vocabulary& vocabulary,
                     const Search& search) {
  const std::set<std::size_t> opened = opened_by(plain, vocabulary);
  const auto moves = [&](std::size_t n) {
    return plain.numbers[n].in_plant && !plain.numbers[n].held && !opened.contains(n);
  };
  Model kept = plain;
  for (std::size_t n = 0; n < kept.numbers.size(); ++n)
    if (moves(n)) kept.numbers[n].hold_at_plant();
  fit(training, kept);
  if (!changes_plant(plain, vocabulary)) return kept;
  for (std::size_t joint = 0; joint < training.base().plant.joints.size(); ++joint) {
    for (const bool of_link : {false, true}) {
      Model more = kept;
      for (std::size_t n = 0; n < more.numbers.size(); ++n) {
        const Parameter& p = more.numbers[n];
        if (moves(n) && p.joint == joint && (p.reaches == Reaches::kLinkLoad) == of_link)
          more.numbers[n].held = false;
      }
      if (more.free().size() == kept.free().size()) continue;
      fit(training, more);
      if (search.pays(more, kept)) kept = std::move(more);
    }
  }
  return kept;
}

/// With the shapes that no plant holds, which take what the plain model leaves.
Model written_as(const Model& best, const Model& plain, const Likelihood& training,
                 const Vocabulary& vocabulary) {
  Model written = best;
  for (const std::size_t c : best.chosen)
    if (!vocabulary.candidates[c].unnamed() && !plain.chosen.contains(c))
      written = without(written, vocabulary, c);
  written.numbers = plain.numbers;
  for (const auto& [c, parameters] : plain.effects) written.effects[c] = parameters;
  if (plain.chosen.size() == written.chosen.size()) return written;
  Model shapes = written;
  for (Parameter& p : shapes.numbers) p.held = true;
  for (const auto& [c, parameters] : plain.effects)
    for (Parameter& p : shapes.effects[c]) p.held = true;
  fit(training, shapes);
  for (const std::size_t c : written.chosen)
    if (vocabulary.candidates[c].unnamed()) written.effects[c] = shapes.effects[c];
  return written;
}

std::string way_note(const Routing& r) {
  if (std::max(r.link, r.drive) >= kCredible) {
    return fmt::format(
        "joint {}'s cable was taken to follow the {}s of the joints that move it, {:.1f} % likely "
        "by these recordings; the plant does not say",
        r.joint, r.through, 100.0 * std::max(r.link, r.drive));
  }
  return fmt::format(
      "the plant does not say whether joint {}'s cable follows the links or the drives of the "
      "joints that move it, and these recordings do not tell (links {:.0f} %, drives {:.0f} %)",
      r.joint, 100.0 * r.link, 100.0 * r.drive);
}

}  // namespace

std::set<std::size_t> opened_by(const Model& model, const Vocabulary& vocabulary) {
  std::set<std::size_t> out;
  for (const std::size_t c : model.chosen)
    if (vocabulary.candidates[c].opens) out.insert(*vocabulary.candidates[c].opens);
  return out;
}

physics::Plant plant_of(const Model& model, const Likelihood& training) {
  physics::Plant plant = model.state_for(training).plant;
  plant.hash = 0;  // no file has these bytes
  for (const Parameter& share : model.numbers)
    if (share.reaches == Reaches::kRouting && share.held && share.x == 1.0)
      plant.joints[share.joint].coupling_through = physics::Through::kLink;
  return plant;
}

Models models_of(const physics::Plant& given, const Likelihood& training,
                 const Vocabulary& vocabulary, const Search& search) {
  const Model& best = search.best();
  Model fitted = plain_of(best, training, vocabulary);
  Model moved, kept;
  // A name that does not pay in the plant that is written is none, whatever it did beside shapes.
  for (std::optional<std::size_t> dropped;;) {
    judge(training, 0.0, fitted);
    moved = fitted;
    hold_uncertain(training, opened_by(fitted, vocabulary), moved);
    kept = with_what_pays(moved, training, vocabulary, search);
    dropped = least_worth(fitted, kept, training, vocabulary, search);
    if (!dropped) break;
    fitted = without(fitted, vocabulary, *dropped);
    fit(training, fitted);
  }
  judge(training, 0.0, moved);
  Model written = written_as(best, kept, training, vocabulary);
  judge(training, 0.0, written);
  Models out{given, training,          vocabulary,       search,
             best,  std::move(fitted), std::move(moved), std::move(written),
             given};
  if (changes_plant(out.written, vocabulary)) out.improved = plant_of(out.written, training);
  if (say_ways(routings_of(best, training), out.improved)) out.improved.hash = 0;
  return out;
}

Growth growth_of(const Models& models) {
  const Vocabulary& vocabulary = models.vocabulary;
  // What no plant can hold is there from the start: it must not bend the numbers.
  std::vector<std::size_t> in_plants;
  Model growing = models.written;
  for (const std::size_t c : models.written.chosen) {
    if (vocabulary.candidates[c].beyond_plants()) continue;
    in_plants.push_back(c);
    growing = without(growing, vocabulary, c);
  }
  fit(models.training, growing);
  judge(models.training, 0.0, growing);
  Growth out{in_plants.empty() ? models.improved : plant_of(growing, models.training), {}};
  for (const std::size_t c : in_plants) {
    const Candidate& candidate = vocabulary.candidates[c];
    Model less = without(models.written, vocabulary, c);
    less.judgement = models.written.judgement;
    growing.chosen.insert(c);
    if (candidate.opens) {
      less.numbers[*candidate.opens] = vocabulary.numbers[*candidate.opens];
      growing.numbers[*candidate.opens] = models.written.numbers[*candidate.opens];
    } else {
      growing.effects[c] = models.written.effects.at(c);
    }
    out.steps.push_back(
        {candidate.id, models.given.joints[candidate.joint].name, candidate.from,
         c == in_plants.back() ? models.improved : plant_of(growing, models.training),
         plant_of(less, models.training)});
  }
  return out;
}

void add_routings(const Models& models, Report& report) {
  report.routings = routings_of(models.best, models.training);
  for (const Routing& routing : report.routings)
    if (!routing.by_plant) report.notes.push_back(way_note(routing));
}

}  // namespace ravencal::diagnose
