// SPDX-License-Identifier: Apache-2.0
#include "diagnose/model/model.hpp"

namespace ravencal::diagnose {

namespace {

template <typename Pointer, typename OfModel>
std::vector<Pointer> free_of(OfModel& model) {
  std::vector<Pointer> all;
  for (auto& number : model.numbers)
    if (!number.held) all.push_back(&number);
  for (auto& [candidate, parameters] : model.effects)
    for (auto& parameter : parameters)
      if (!parameter.held) all.push_back(&parameter);
  return all;
}

}  // namespace

std::vector<Parameter*> Model::free() { return free_of<Parameter*>(*this); }

std::vector<const Parameter*> Model::free() const { return free_of<const Parameter*>(*this); }

double Model::prior() const {
  double sum = 0.0;
  for (const Parameter* parameter : free()) sum += parameter->penalty();
  return sum;
}

namespace {

State state_of(const Model& model, State state, bool own_recordings) {
  const auto apply = [&](const Parameter& parameter) {
    if (own_recordings || !parameter.recording) parameter.apply(state);
  };
  for (const Parameter& number : model.numbers)
    if (!number.is_plants()) apply(number);
  for (const auto& [candidate, parameters] : model.effects)
    for (const Parameter& parameter : parameters) apply(parameter);
  return state;
}

}  // namespace

State Model::state_for(const Likelihood& training) const {
  return state_of(*this, training.base(), true);
}

State Model::state_elsewhere(const Likelihood& other) const {
  return state_of(*this, other.base(), false);
}

}  // namespace ravencal::diagnose
