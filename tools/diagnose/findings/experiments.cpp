// SPDX-License-Identifier: Apache-2.0
#include "diagnose/findings/experiments.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <utility>

#include "diagnose/findings/words.hpp"

namespace ravencal::diagnose {
namespace {

/// After MISMATCH's menu of separating experiments.
constexpr std::array<Experiment, 12> kMenu = {{
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
    {Probe::kNone, "repeat the same motion twice: what does not repeat is noise", 5},
}};

/// What changes a circumstance that shapes without a name depend on (vocabulary/shapes.cpp). A
/// warm-up and a drift have both time and another circumstance, so that time is looked for first.
constexpr std::array<std::pair<std::string_view, Probe>, 5> kChanges = {{
    {"time", Probe::kWarm},
    {"position", Probe::kWholeRange},
    {"speed", Probe::kSpeeds},
    {"load", Probe::kLoaded},
    {"effort", Probe::kLoaded},
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

const Experiment& experiment_over(std::string_view circumstance) {
  Probe probe = Probe::kNone;
  for (const auto& [word, changes] : kChanges) {
    if (circumstance.find(word) == std::string_view::npos) continue;
    probe = changes;
    break;
  }
  return *std::find_if(kMenu.begin(), kMenu.end(),
                       [&](const Experiment& e) { return e.probe == probe; });
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
