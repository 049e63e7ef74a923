// SPDX-License-Identifier: Apache-2.0
#include "diagnose/report/causes.hpp"

#include <algorithm>
#include <array>

#include "diagnose/findings/words.hpp"
#include "diagnose/report/suggest.hpp"
#include "physics/effects/effect_spec.hpp"

namespace ravencal::diagnose {
namespace {

/// A thing of the robot that makes several effects of the vocabulary.
struct Family {
  std::string_view name, sentence;
  bool of_arm;  ///< one for all joints
  std::array<std::string_view, 6> ids;
};

constexpr std::array<Family, 3> kFamilies = {{
    {"load on the arm",
     "the arm carries other masses than the plant's",
     true,
     {"payload", "gravity", "inertia_error", "", "", ""}},
    {"friction of the drive",
     "motor and gearbox rub otherwise than the plant's",
     false,
     {"coulomb_friction", "viscous_friction", "stribeck_friction", "presliding",
      "asymmetric_friction", "load_dependent_friction"}},
    {"delay", "one signal is late against the others", true, {"delay", "", "", "", "", ""}},
}};

/// What the simulation cannot run yet has no sentence there.
struct Word {
  std::string_view id, sentence;
};
constexpr std::array<Word, 8> kWords = {{
    {"slip", "the cable slips on its pulley"},
    {"lost_counts", "the encoder loses counts"},
    {"quantisation", "the encoder resolves less than the plant's"},
    {"flexible_mode", "the joint swings behind its drive"},
    {"controller_gain", "the controller's gain is not the plant's"},
    {"effort_offset", "a constant effort acts on the drive"},
    {"input_disturbance", "pulses reach the drive that the controller did not send"},
    {"unknown", "the mismatch is real, and no effect of the vocabulary explains it"},
}};

const Family* family_of(std::string_view id) {
  const auto it = std::find_if(kFamilies.begin(), kFamilies.end(), [id](const Family& f) {
    return std::find(f.ids.begin(), f.ids.end(), id) != f.ids.end();
  });
  return it == kFamilies.end() ? nullptr : &*it;
}

std::string sentence_of(std::string_view id) {
  if (const auto* spec = physics::find_effect_spec(id)) return std::string(spec->sentence);
  const auto it =
      std::find_if(kWords.begin(), kWords.end(), [id](const Word& w) { return w.id == id; });
  return it == kWords.end() ? "" : std::string(it->sentence);
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
  cause.sentence = family != nullptr ? std::string(family->sentence) : sentence_of(effect.id);
  // A payload bends every joint; a clock is late for each that shows it.
  if (effect.id == "payload") cause.joints = joints_seen(report, effect.stage);
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
  if (all([](const NamedEffect& e) { return e.id == "unknown"; })) return "no_name";
  if (all([](const NamedEffect& e) { return e.out_of_tolerance; })) return "out_of_tolerance";
  return all([](const NamedEffect& e) { return e.ambiguous_with.empty(); }) ? "named" : "tied";
}

void add_partings(const NamedEffect& effect, std::vector<Parting>& partings) {
  for (const std::string& rival : effect.ambiguous_with) {
    Parting parting{effect.id, rival, effect.separate_by, std::nullopt};
    if (const auto cheapest = cheapest_parting(effect.id, rival)) {
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

Abscissa abscissa_of(std::string_view id) {
  constexpr std::array kBySpeed = {
      "viscous_friction", "coulomb_friction", "stribeck_friction", "asymmetric_friction", "delay",
      "torque_constant"};
  constexpr std::array kByLoad = {"compliance", "load_dependent_friction", "hysteresis",
                                  "joint_friction"};
  constexpr std::array kByTime = {"thermal_drift", "slip",          "lost_counts",
                                  "creep",         "homing_offset", "input_disturbance"};
  const auto is_in = [id](const auto& ids) {
    return std::find(ids.begin(), ids.end(), id) != ids.end();
  };
  if (is_in(kBySpeed)) return Abscissa::kSpeed;
  if (is_in(kByLoad)) return Abscissa::kLoad;
  return is_in(kByTime) ? Abscissa::kTime : Abscissa::kPosition;
}

}  // namespace ravencal::diagnose
