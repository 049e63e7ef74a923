// SPDX-License-Identifier: Apache-2.0
//
// What the search found, as the parts of a report take it.
#pragma once

#include <cstdint>
#include <functional>
#include <set>
#include <vector>

#include "diagnose/explain/view.hpp"
#include "diagnose/findings/findings.hpp"
#include "diagnose/search/search.hpp"

namespace ravencal::diagnose {

struct Models {
  const physics::Plant& given;
  const Likelihood& training;
  const Vocabulary& vocabulary;
  const Search& search;
  const Model& best;        ///< of the search: probabilities come from it
  Model fitted;             ///< what a plant can hold of it, fitted alone: intervals come from it
  Model moved;              ///< without numbers that the rows do not move: it raises the alarm
  Model written;            ///< without those whose moves do not pay either: values come from it
  physics::Plant improved;  ///< of `written`: the given one where nothing is named
};

/// A named effect that a plant can hold.
struct GrowthStep {
  std::string id, joint, from;
  physics::Plant grown;    ///< the refitted plant with the effects up to this one
  physics::Plant without;  ///< the improved plant without this one; its other numbers stay
};

/// How the given plant becomes the improved one.
struct Growth {
  physics::Plant refitted;  ///< the given plant with its numbers refitted, without any effect
  std::vector<GrowthStep> steps;
};

Growth growth_of(const Models& models);

/// `search` has run; all must outlive the result.
Models models_of(const physics::Plant& given, const Likelihood& training,
                 const Vocabulary& vocabulary, const Search& search);

/// Places of the numbers that a model opens.
std::set<std::size_t> opened_by(const Model& model, const Vocabulary& vocabulary);

/// The plant that a model describes, whatever circumstances its recordings have.
physics::Plant plant_of(const Model& model, const Likelihood& training);

/// Named effects with values, intervals and probabilities, shapes without a name, and numbers that
/// moved within their tolerance. `rows`: those of the view.
void add_effects(const Models& models, const View& view, Report& report);

/// Every fitted number and effect of a drive that its free run tells, by equation error and by free
/// run, and a note where the two differ by more than they are uncertain by: the model's laws are
/// then not the robot's, whatever the values.
void add_two_estimates(const Models& models, Report& report);

/// Of the parameter's value: deviation by which the forms of laws differ, of which no model has the
/// robot's own. A relative change is one of the whole number.
double deviation_of_form(const Parameter& parameter);

/// Which way each cable runs that other joints move, and a note of each of which the plant does not
/// say it.
void add_routings(const Models& models, Report& report);

/// Every word of the vocabulary that is not named, with its limit or why there is none; and the
/// candidates of the last screen.
void add_not_found(const Models& models, Report& report);
void add_candidates(const Models& models, std::uint64_t seed, Report& report);

/// How often the search names something in recordings in which nothing is left out: share of
/// `placebos` in which it finds anything. A placebo has the motion of the training recordings, what
/// the given plant with its refitted numbers predicts, and the innovations of the best model, whose
/// signs are drawn anew for each block. `go_on`: told the share that is done; false ends it.
double false_alarm_rate(const Models& models, int placebos, std::uint64_t seed,
                        const std::function<bool(double share)>& go_on);

}  // namespace ravencal::diagnose
