// SPDX-License-Identifier: Apache-2.0
#include "diagnose/report/causes.hpp"

#include <algorithm>
#include <array>

#include "diagnose/findings/effect_words.hpp"
#include "diagnose/findings/experiments.hpp"
#include "diagnose/findings/words.hpp"

namespace ravencal::diagnose {
namespace {

/// A thing of the robot that makes several effects of the vocabulary.
struct Family {
  Origin origin;
  std::string_view name, sentence;
  bool of_arm;  ///< one for all joints
};

constexpr std::array<Family, 3> kFamilies = {{
    {Origin::kArmLoad, "load on the arm", "the arm carries other masses than the plant's", true},
    {Origin::kDriveFriction, "friction of the drive",
     "motor and gearbox rub otherwise than the plant's", false},
    {Origin::kClock, "delay", "one signal is late against the others", true},
}};

const Family* family_of(std::string_view id) {
  const Origin origin = words_for(id).origin;
  const auto it = std::find_if(kFamilies.begin(), kFamilies.end(),
                               [origin](const Family& f) { return f.origin == origin; });
  return it == kFamilies.end() ? nullptr : &*it;
}

/// Joints whose channel of that stage was looked at.
std::vector<std::string> joints_seen(const Report& report, const std::string& stage) {
  std::vector<std::string> joints;
  for (const LookedAt& looked : report.looked_at) {
    if (looked.stage == stage) add_once(joints, looked.joint);
  }
  return joints;
}

Cause begin_cause(const Report& report, const NamedEffect& effect, const Family* family) {
  Cause cause;
  cause.name = family != nullptr ? std::string(family->name) : words_of(effect.id);
  cause.sentence = family != nullptr ? std::string(family->sentence)
                                     : std::string(words_for(effect.id).sentence());
  // A payload bends every joint; a clock is late for each that shows it.
  if (words_for(effect.id).on_tool) cause.joints = joints_seen(report, effect.stage);
  return cause;
}

bool belongs(const Cause& cause, const NamedEffect& effect, const Family* family) {
  const std::string name = family != nullptr ? std::string(family->name) : words_of(effect.id);
  const bool of_arm = family != nullptr && family->of_arm;
  return cause.name == name && (of_arm || cause.joints.front() == effect.joint);
}

std::string status_of(const Report& report, const Cause& cause) {
  const auto all = [&](auto&& holds) {
    return std::all_of(cause.effects.begin(), cause.effects.end(),
                       [&](std::size_t i) { return holds(report.effects[i]); });
  };
  if (all([](const NamedEffect& e) { return e.id == kUnknown; })) return "no_name";
  if (all([](const NamedEffect& e) { return e.out_of_tolerance; })) return "out_of_tolerance";
  return all([](const NamedEffect& e) { return e.ambiguous_with.empty(); }) ? "named" : "tied";
}

void add_partings(const NamedEffect& effect, std::vector<Parting>& partings) {
  for (const std::string& rival : effect.ambiguous_with) {
    Parting parting{effect.id, rival, effect.separate_by, std::nullopt};
    if (const Experiment* cheapest = cheapest_parting(effect.id, rival)) {
      parting.experiment = cheapest->experiment;
      parting.minutes = cheapest->minutes;
    }
    partings.push_back(std::move(parting));
  }
}

}  // namespace

std::vector<Cause> causes_of(const Report& report) {
  std::vector<Cause> causes;
  for (std::size_t i = 0; i < report.effects.size(); ++i) {
    const NamedEffect& effect = report.effects[i];
    const Family* family = family_of(effect.id);
    auto cause = std::find_if(causes.begin(), causes.end(),
                              [&](const Cause& c) { return belongs(c, effect, family); });
    if (cause == causes.end())
      cause = causes.insert(causes.end(), begin_cause(report, effect, family));
    add_once(cause->joints, effect.joint);
    cause->effects.push_back(i);
    add_partings(effect, cause->partings);
  }
  for (Cause& cause : causes) cause.status = status_of(report, cause);
  return causes;
}

}  // namespace ravencal::diagnose
