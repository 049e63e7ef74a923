// SPDX-License-Identifier: Apache-2.0
#include "diagnose/findings/experiments.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>

#include "diagnose/findings/words.hpp"

namespace ravencal::diagnose {
namespace {

/// After MISMATCH's menu of separating experiments.
constexpr std::array<Experiment, 11> kMenu = {{
    {Probe::kLoaded, "repeat the same motion with 500 g on the tool", 4, Exercise::kLoaded},
    {Probe::kSpeeds, "repeat the same motion at a third and at three times the speed", 6,
     Exercise::kSpeeds},
    {Probe::kHolds, "hold a loaded pose for three minutes, then the opposite one", 7,
     Exercise::kHolds},
    {Probe::kReversals, "reversals of 0.05, 0.2, 1 and 5 degrees around three poses, slowly", 5,
     Exercise::kReversals},
    {Probe::kOneByOne, "move every other joint alone over its range while this one holds", 4,
     Exercise::kOneByOne},
    {Probe::kHomings, "home twice more and record a minute each time", 4},
    {Probe::kWarm, "record again after an hour of motion", 65},
    {Probe::kPressed, "press the joint to and fro by hand, or with torque pulses below breakaway",
     3},
    {Probe::kWholeRange, "pass the whole range slowly both ways ten times, at 1 kHz", 8,
     Exercise::kWholeRange},
    {Probe::kPulses, "torque pulses and fast stops, recorded at 1 kHz", 3},
    {Probe::kWeighed, "weigh the tool and check the plant's masses and drive constants", 2},
}};

/// The cheapest of the menu that is `wanted`.
template <typename Wanted>
const Experiment* cheapest(Wanted&& wanted) {
  const Experiment* best = nullptr;
  for (const Experiment& e : kMenu) {
    if (wanted(e) && (best == nullptr || e.minutes < best->minutes)) best = &e;
  }
  return best;
}

bool answers(std::string_view id, const Experiment& experiment) {
  return contains(words_for(id).probes, experiment.probe);
}

}  // namespace

const Experiment* cheapest_parting(std::string_view id, std::string_view rival) {
  return cheapest([&](const Experiment& e) { return answers(id, e) != answers(rival, e); });
}

const Experiment* cheapest_test(std::string_view id) {
  return cheapest([&](const Experiment& e) { return answers(id, e); });
}

std::string experiment_that_parts(std::string_view id, const std::vector<std::string>& rivals) {
  std::vector<std::string> parting;
  for (const std::string& rival : rivals) {
    if (const Experiment* e = cheapest_parting(id, rival))
      add_once(parting, std::string(e->experiment));
  }
  if (parting.empty()) return std::string(words_for(id).separate_by);
  return fmt::format("{}", fmt::join(parting, "; "));
}

}  // namespace ravencal::diagnose
