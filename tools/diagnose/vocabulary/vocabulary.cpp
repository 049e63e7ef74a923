// SPDX-License-Identifier: Apache-2.0
#include "diagnose/vocabulary/vocabulary.hpp"

#include <algorithm>

#include "diagnose/vocabulary/candidates.hpp"

namespace ravencal::diagnose {
namespace {

void close_all(const std::vector<Candidate>& candidates, std::vector<Parameter>& numbers) {
  for (const Candidate& candidate : candidates)
    if (candidate.opens) close(numbers[*candidate.opens]);
}

}  // namespace

bool Vocabulary::may_stand(std::size_t candidate, const std::set<std::size_t>& chosen) const {
  const std::vector<std::size_t>& behind = candidates[candidate].behind;
  return behind.empty() || std::any_of(behind.begin(), behind.end(),
                                       [&](std::size_t c) { return chosen.contains(c); });
}

Vocabulary vocabulary_of(const physics::Plant& plant, Likelihood& training, Likelihood* held_out) {
  std::vector<Scales> scales;
  for (std::size_t j = 0; j < plant.joints.size(); ++j)
    scales.push_back(scales_of(plant, j, training));
  Vocabulary out;
  for (const Scales& s : scales) add_numbers(plant, s, training.tracks().size(), out.numbers);
  add_centres(plant, scales, training, out.numbers);
  for (std::size_t j = 0; j < plant.joints.size(); ++j) {
    add_effects(plant, scales, j, training.tracks().size(), out.candidates);
    add_geometry(plant, scales[j], out.numbers, out.candidates);
    add_wrong_numbers(plant, scales[j], out.numbers, out.candidates);
    add_shapes(scales[j], training, held_out, out.candidates);
  }
  const bool weighs =
      std::any_of(scales.begin(), scales.end(), [](const Scales& s) { return s.weight; });
  if (weighs) add_payload(plant, scales, out.candidates);
  close_all(out.candidates, out.numbers);
  return out;
}

}  // namespace ravencal::diagnose
