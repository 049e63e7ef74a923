// SPDX-License-Identifier: Apache-2.0
//
// What a model may hold: numbers that are always fitted within what a plant and a recording are
// good for, and candidates, each an effect that may be missing or a number that may be wrong. The
// only room that knows effects by name; their physics stands in shared/physics.
#pragma once

#include <cstddef>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "diagnose/model/likelihood.hpp"
#include "diagnose/model/parameter.hpp"

namespace ravencal::diagnose {

enum class CandidateKind {
  kEffect,  ///< physics that the plant lacks
  kNumber,  ///< a number of the plant that is beyond its tolerance
  kJump,    ///< at a moment that is searched for
  kTone,    ///< a sine in one channel, whose frequency is searched for
  kPulses,  ///< on and off in one channel, at moments that are searched for
  kShape,   ///< without a name
};

struct Candidate {
  std::string id;  ///< of the vocabulary; "unknown" for shapes without a name
  CandidateKind kind = CandidateKind::kEffect;
  std::size_t joint = 0;
  std::string from{};  ///< the joint that a coupling comes from
  /// Parameters in which it is linear where it is absent (all zero), and the others.
  std::vector<Parameter> sizes{};
  std::vector<Parameter> forms{};
  std::vector<std::vector<double>> starts{};  ///< values of the forms from which it is tried
  /// Of a wave: so many starts are orders of the plant, the others were searched for.
  std::optional<std::size_t> stated_orders{};
  /// Places of candidates of which a model that holds this one holds one as well; none: it stands
  /// alone.
  std::vector<std::size_t> behind{};
  std::optional<std::size_t> opens{};  ///< place of the number whose prior it opens; no sizes then
  Parameter opened{};                  ///< that number, with the open prior
  bool wrong_number = false;           ///< a parameter that the plant has, not physics it lacks
  bool constant = false;               ///< the same in every row: no form of it could be wrong
  std::string circumstance{};          ///< of a shape: what it depends on

  [[nodiscard]] std::size_t start_count() const { return forms.empty() ? 1 : starts.size(); }

  [[nodiscard]] bool unnamed() const {
    return kind == CandidateKind::kShape || kind == CandidateKind::kTone;
  }
  /// At moments or of a frequency that were searched for: no test by blocks applies.
  [[nodiscard]] bool searched() const {
    return kind == CandidateKind::kJump || kind == CandidateKind::kTone ||
           kind == CandidateKind::kPulses;
  }
  /// It holds or does not; how much of it is no question.
  [[nodiscard]] bool is_presence() const { return !sizes.empty() && !sizes.front().said; }
  /// What one recording has and another has not.
  [[nodiscard]] bool of_recording() const {
    return kind == CandidateKind::kJump || kind == CandidateKind::kPulses;
  }
  [[nodiscard]] bool beyond_plants() const { return unnamed() || of_recording(); }
};

struct Vocabulary {
  std::vector<Parameter> numbers;
  std::vector<Candidate> candidates;

  /// Among what is chosen is something that the candidate is behind, or it stands alone.
  [[nodiscard]] bool may_stand(std::size_t candidate, const std::set<std::size_t>& chosen) const;
};

/// Shapes are added to both likelihoods; `held_out` may be null.
Vocabulary vocabulary_of(const physics::Plant& plant, Likelihood& training, Likelihood* held_out);

}  // namespace ravencal::diagnose
