// SPDX-License-Identifier: Apache-2.0
#include "diagnose/diagnose.hpp"

#include "diagnose/report/write_report.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>

#include "diagnose_generator.hpp"

namespace {

using namespace ravencal;
using generator::HiddenPhysics;
using generator::Scene;

physics::Plant plant_of(const std::string& effects = {}) {
  auto plant = physics::parse_plant(generator::plant_text(effects), "test plant");
  EXPECT_TRUE(plant.ok()) << (plant.ok() ? "" : plant.error().message);
  return plant.value();
}

diagnose::Report run(const HiddenPhysics& hidden, const Scene& scene = {},
                     const std::string& effects = {}, unsigned threads = 1) {
  diagnose::Options options;
  options.threads = threads;
  auto report = diagnose::diagnose({generator::make_recording(hidden, scene)}, {},
                                   plant_of(effects), options);
  EXPECT_TRUE(report.ok()) << (report.ok() ? "" : report.error().message);
  return report.value();
}

std::string names_in(const diagnose::Report& report) {
  std::string names;
  for (const auto& e : report.effects) names += e.joint + "/" + e.stage + "/" + e.id + " ";
  return names + report.verdict.text;
}

const diagnose::NamedEffect* find(const diagnose::Report& report, const std::string& id) {
  const auto it = std::find_if(report.effects.begin(), report.effects.end(), [&](const auto& e) {
    return e.id == id || std::find(e.ambiguous_with.begin(), e.ambiguous_with.end(), id) !=
                             e.ambiguous_with.end();
  });
  return it == report.effects.end() ? nullptr : &*it;
}

struct Recovery {
  const char* id;
  HiddenPhysics hidden;
  double value;  ///< of the first parameter
};

class Names : public ::testing::TestWithParam<Recovery> {};

TEST_P(Names, TheConcealedEffectWithItsValue) {
  const diagnose::Report report = run(GetParam().hidden);
  const auto* effect = find(report, GetParam().id);
  ASSERT_NE(effect, nullptr) << names_in(report);
  EXPECT_EQ(report.effects.size(), 1U) << names_in(report);
  EXPECT_EQ(effect->joint, "one");
  ASSERT_FALSE(effect->parameters.empty());
  const bool itself = effect->id == GetParam().id;  // a look-alike has a number of its own
  EXPECT_NEAR(itself ? effect->parameters.front().value : GetParam().value, GetParam().value,
              0.1 * std::abs(GetParam().value));
  EXPECT_LT(effect->held_out_after, effect->held_out_before);
  EXPECT_FALSE(report.mismatch.empty());
  EXPECT_LE(effect->p_value, 0.01);
}

INSTANTIATE_TEST_SUITE_P(Diagnose, Names,
                         ::testing::Values(Recovery{"homing_offset", {.offset_rad = 0.02}, 0.02},
                                           Recovery{"gain_error", {.gain = 0.01}, 0.01},
                                           Recovery{"coupling", {.coupling = -0.02}, -0.02},
                                           Recovery{"backlash", {.gap_half_rad = 0.004}, 0.004},
                                           Recovery{"delay", {.delay_s = 0.03}, 0.03},
                                           Recovery{"slip", {.slip_rad = 0.004}, 0.004},
                                           Recovery{"coulomb_friction", {.coulomb_n_m = 0.5}, 0.5},
                                           Recovery{
                                               "viscous_friction", {.viscous_n_m_s = 6.0}, 6.0}),
                         [](const auto& test) { return std::string(test.param.id); });

TEST(Diagnose, FindsTwoEffectsThatActTogether) {
  const diagnose::Report report = run({.coupling = 0.02, .gap_half_rad = 0.004});
  EXPECT_NE(find(report, "coupling"), nullptr) << names_in(report);
  EXPECT_NE(find(report, "backlash"), nullptr) << names_in(report);
  EXPECT_EQ(report.effects.size(), 2U) << names_in(report);
}

/// Encoders have arbitrary zeros; however far off, they hide nothing.
TEST(Diagnose, FindsAGapBesideAZeroThatIsFarOff) {
  const diagnose::Report report = run({.offset_rad = 3.0, .gap_half_rad = 0.004});
  EXPECT_NE(find(report, "homing_offset"), nullptr) << names_in(report);
  EXPECT_NE(find(report, "backlash"), nullptr) << names_in(report);
  EXPECT_EQ(report.effects.size(), 2U) << names_in(report);
}

TEST(Diagnose, StaysSilentWhereNothingIsLeftOut) {
  int alarms = 0;
  for (std::uint64_t seed = 1; seed <= 15; ++seed) {
    const diagnose::Report report = run({}, {.seed = seed, .duration_s = 240.0});
    if (report.verdict.kind != "nothing_left_out") {
      ++alarms;
      ADD_FAILURE_AT(__FILE__, 0) << "seed " << seed << ": " << names_in(report);
    }
  }
  EXPECT_EQ(alarms, 0);
}

TEST(Diagnose, TakesAParameterWithinItsToleranceForNoFinding) {
  const diagnose::Report report =
      run({.coulomb_n_m = 0.53}, {},
          "\n[[joint.effect]]\nid = \"coulomb_friction\"\nlevel_n_m = 0.5\n");
  EXPECT_EQ(report.verdict.kind, "nothing_left_out") << names_in(report);
}

TEST(Diagnose, CallsAParameterOutOfItsToleranceThatAndNotPhysics) {
  const diagnose::Report report = run(
      {.coulomb_n_m = 0.8}, {}, "\n[[joint.effect]]\nid = \"coulomb_friction\"\nlevel_n_m = 0.5\n");
  EXPECT_EQ(report.verdict.kind, "parameter_out_of_tolerance") << names_in(report);
  const auto* effect = find(report, "coulomb_friction");
  ASSERT_NE(effect, nullptr);
  EXPECT_NEAR(effect->parameters.front().value, 0.8, 0.05);
}

/// An effect that the held-out recording lacks has no name, and what it leaves is said.
TEST(Diagnose, NamesNothingThatItsHeldOutRecordingLacks) {
  const auto fitted = generator::make_recording({.delay_s = 0.03}, {});
  const auto shown = generator::make_recording({}, {.seed = 2});
  const auto report = diagnose::diagnose({fitted}, {shown}, plant_of(), {});
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_EQ(find(*report, "delay"), nullptr) << names_in(*report);
  for (const auto& figure : report->held_out) EXPECT_EQ(figure.after, figure.before);
}

TEST(Diagnose, SaysUnknownOfWhatItsVocabularyLacks) {
  const diagnose::Report report = run({.bump_rad = 0.004});
  EXPECT_FALSE(report.unexplained.empty()) << names_in(report);
}

TEST(Diagnose, SaysWhatCannotBeSeenWithoutATruth) {
  const diagnose::Report report = run({}, {.with_truth = false});
  const auto it = std::find_if(report.not_found.begin(), report.not_found.end(), [](const auto& n) {
    return n.id == "backlash" && n.joint == "one";
  });
  ASSERT_NE(it, report.not_found.end());
  EXPECT_FALSE(it->detection_limit.has_value());
  EXPECT_NE(it->not_testable_because.find("joint_truth"), std::string::npos)
      << it->not_testable_because;
}

/// A word of the vocabulary, where it shows, and what keeps a recording of the generator from
/// showing it though that was recorded; empty: it has a limit there.
struct Word {
  const char* id;
  enum { kTruth, kEffort, kCommand } shows_in;
  const char* because = "";
};
constexpr Word kWords[] = {
    {"homing_offset", Word::kTruth},
    {"gain_error", Word::kTruth},
    {"coupling", Word::kTruth},
    {"compliance", Word::kTruth, "the load on this joint never changes"},
    {"backlash", Word::kTruth},
    {"joint_friction", Word::kTruth, "the plant's cable does not yield"},
    {"hysteresis", Word::kTruth},
    {"creep", Word::kTruth, "the load on this joint never changes"},
    {"eccentricity", Word::kTruth, "not one period of any pulley"},
    {"slip", Word::kTruth},
    {"delay", Word::kTruth},
    {"lost_counts", Word::kTruth},
    {"quantisation", Word::kTruth, "leaves no steps of an encoder"},
    {"thermal_drift", Word::kTruth},
    {"coulomb_friction", Word::kEffort},
    {"viscous_friction", Word::kEffort},
    {"stribeck_friction", Word::kEffort},
    {"presliding", Word::kEffort, "no dry friction"},
    {"asymmetric_friction", Word::kEffort},
    {"load_dependent_friction", Word::kEffort, "the load is not known"},
    {"torque_constant", Word::kEffort},
    {"torque_ripple", Word::kEffort, "not one period of any pulley"},
    {"effort_offset", Word::kEffort},
    {"saturation", Word::kEffort, "record the desired position"},
    {"inertia_error", Word::kEffort},
    {"gravity", Word::kEffort, "the load is not known"},
    {"centre_of_mass", Word::kEffort, "where its joints stand"},
    {"payload", Word::kEffort, "where a payload would hang"},
    {"link_length", Word::kEffort, "where its joints stand"},
    {"link_axial", Word::kEffort, "where its joints stand"},
    {"link_across", Word::kEffort, "where its joints stand"},
    {"joint_zero", Word::kEffort, "where its joints stand"},
    {"flexible_mode", Word::kEffort, "below 3 Hz"},
    {"controller_gain", Word::kCommand, "lacks the command's inputs"},
    {"input_disturbance", Word::kCommand, "lacks the command's inputs"},
};

/// How often the report names it or says that it does not; `silent`: the last of the latter.
std::ptrdiff_t entries_of(const diagnose::Report& report, const std::string& joint,
                          const std::string& id, const diagnose::NotFound*& silent) {
  silent = nullptr;
  std::ptrdiff_t count =
      std::count_if(report.effects.begin(), report.effects.end(),
                    [&](const auto& e) { return e.id == id && e.joint == joint; });
  for (const diagnose::NotFound& n : report.not_found) {
    if (n.id != id || n.joint != joint) continue;
    silent = &n;
    ++count;
  }
  return count;
}

TEST(Diagnose, SpeaksOfEveryWordOfItsVocabularyOnEveryJoint) {
  const diagnose::NotFound* silent = nullptr;
  for (const Scene& scene : {Scene{}, Scene{.with_truth = false}, Scene{.with_torque = false}}) {
    const diagnose::Report report = run({.coulomb_n_m = 0.5}, scene);
    EXPECT_EQ(report.effects.size() + report.not_found.size(), 2 * std::size(kWords));
    for (const Word& word : kWords) {
      SCOPED_TRACE(
          fmt::format("{}, truth {}, torque {}", word.id, scene.with_truth, scene.with_torque));
      EXPECT_EQ(entries_of(report, "one", word.id, silent), 1);
      if (silent == nullptr) {
        EXPECT_TRUE(scene.with_torque) << "named without the effort that shows it";
        EXPECT_STREQ(word.id, "coulomb_friction");
        continue;
      }
      const bool recorded = word.shows_in == Word::kCommand ||
                            (word.shows_in == Word::kTruth ? scene.with_truth : scene.with_torque);
      const std::string because = recorded                        ? word.because
                                  : word.shows_in == Word::kTruth ? "no joint_truth was recorded"
                                                                  : "no drive effort was recorded";
      EXPECT_EQ(silent->detection_limit.has_value(), because.empty());
      EXPECT_GT(silent->detection_limit.value_or(1.0), 0.0);
      EXPECT_EQ(silent->not_testable_because.empty(), because.empty());
      EXPECT_NE(silent->not_testable_because.find(because), std::string::npos)
          << silent->not_testable_because;
      // Of the other joint nothing but the estimate was recorded.
      ASSERT_EQ(entries_of(report, "two", word.id, silent), 1);
      ASSERT_NE(silent, nullptr);
      EXPECT_FALSE(silent->detection_limit.has_value());
      EXPECT_NE(silent->not_testable_because.find(word.shows_in == Word::kCommand
                                                      ? word.because
                                                      : "too few of this joint's positions"),
                std::string::npos)
          << silent->not_testable_because;
    }
  }
}

TEST(Diagnose, SpeaksOfEveryWordThatThePlantHas) {
  const std::string in_plant =
      "\n[[joint.effect]]\nid = \"coulomb_friction\"\nlevel_n_m = 0.5\n"
      "\n[[joint.effect]]\nid = \"presliding\"\ndisplacement_rad = 0.001\n"
      "\n[[joint.effect]]\nid = \"compliance\"\nstiffness_n_m_per_rad = 400.0\n"
      "damping_n_m_s_per_rad = 1.0\n"
      "\n[[joint.effect]]\nid = \"thermal_drift\"\nwander_rad = 0.0005\ntime_s = 1000.0\n";
  const diagnose::Report report = run({.coulomb_n_m = 0.5}, {}, in_plant);
  const diagnose::NotFound* silent = nullptr;
  for (const Word& word : kWords) {
    EXPECT_GE(entries_of(report, "one", word.id, silent), 1) << word.id;
    EXPECT_TRUE(silent == nullptr ||
                silent->detection_limit.has_value() != !silent->not_testable_because.empty())
        << word.id << ": a limit or a reason";
  }
}

struct Limit {
  const char* name;
  const char* id;
  double HiddenPhysics::*size;
  HiddenPhysics hidden;  ///< what the plant has
  const char* in_plant;
};

class Limits : public ::testing::TestWithParam<Limit> {};

// A limit that is too low promises what is not seen; one that is too high warns of nothing.
TEST_P(Limits, AreWhereAnEffectBeginsToBeNamed) {
  const Limit& limit = GetParam();
  const diagnose::Report silent = run(limit.hidden, {}, limit.in_plant);
  const auto it =
      std::find_if(silent.not_found.begin(), silent.not_found.end(), [&](const auto& n) {
        return n.id == limit.id && n.joint == "one" && n.detection_limit.has_value();
      });
  ASSERT_NE(it, silent.not_found.end());
  const auto named_at = [&](double times) {
    HiddenPhysics more = limit.hidden;
    more.*limit.size += times * *it->detection_limit;
    const diagnose::Report report = run(more, {}, limit.in_plant);
    return find(report, limit.id) != nullptr;
  };
  EXPECT_TRUE(named_at(1.5)) << *it->detection_limit;
  EXPECT_FALSE(named_at(0.5)) << *it->detection_limit;
}

constexpr const char* kCoulombInPlant =
    "\n[[joint.effect]]\nid = \"coulomb_friction\"\nlevel_n_m = 0.5\n";
constexpr const char* kViscousInPlant =
    "\n[[joint.effect]]\nid = \"viscous_friction\"\ndamping_n_m_s_per_rad = 5.0\n";

INSTANTIATE_TEST_SUITE_P(
    Diagnose, Limits,
    ::testing::Values(Limit{"offset", "homing_offset", &HiddenPhysics::offset_rad, {}, ""},
                      Limit{"gain", "gain_error", &HiddenPhysics::gain, {}, ""},
                      Limit{"coupling", "coupling", &HiddenPhysics::coupling, {}, ""},
                      Limit{"backlash", "backlash", &HiddenPhysics::gap_half_rad, {}, ""},
                      Limit{"delay", "delay", &HiddenPhysics::delay_s, {}, ""},
                      Limit{"coulomb", "coulomb_friction", &HiddenPhysics::coulomb_n_m, {}, ""},
                      Limit{"viscous", "viscous_friction", &HiddenPhysics::viscous_n_m_s, {}, ""},
                      Limit{"viscous_beside_a_number",
                            "viscous_friction",
                            &HiddenPhysics::viscous_n_m_s,
                            {.coulomb_n_m = 0.5},
                            kCoulombInPlant},
                      Limit{"coulomb_beside_a_number",
                            "coulomb_friction",
                            &HiddenPhysics::coulomb_n_m,
                            {.viscous_n_m_s = 5.0},
                            kViscousInPlant}),
    [](const auto& test) { return std::string(test.param.name); });

TEST(Diagnose, GivesTheSameBytesOnAnyNumberOfThreads) {
  const HiddenPhysics hidden{.gain = 0.01, .coulomb_n_m = 0.4};
  const std::string one = diagnose::report_json(run(hidden, {.duration_s = 200.0}, {}, 1));
  EXPECT_EQ(one, diagnose::report_json(run(hidden, {.duration_s = 200.0}, {}, 4)));
  EXPECT_EQ(one, diagnose::report_json(run(hidden, {.duration_s = 200.0}, {}, 1)));
}

TEST(Diagnose, WritesTheSchemaThatOthersRead) {
  const auto json = nlohmann::json::parse(diagnose::report_json(run({.gain = 0.01})));
  EXPECT_EQ(json.at("schema"), 1);
  for (const char* key : {"kind", "text", "false_alarm_rate"})
    EXPECT_TRUE(json.at("verdict").contains(key)) << key;
  for (const char* key : {"mismatch", "effects", "held_out", "unexplained", "not_found"})
    EXPECT_TRUE(json.at(key).is_array()) << key;
  const auto& effect = json.at("effects").at(0);
  for (const char* key :
       {"id", "joint", "stage", "parameters", "evidence", "ambiguous_with", "separate_by"})
    EXPECT_TRUE(effect.contains(key)) << key;
  for (const char* key :
       {"held_out_before", "held_out_after", "unit", "p_value", "size", "invariance_spread"})
    EXPECT_TRUE(effect.at("evidence").contains(key)) << key;
  for (const auto& entry : json.at("not_found"))
    EXPECT_NE(entry.contains("detection_limit"), entry.contains("not_testable_because"))
        << entry.dump();
}

TEST(Diagnose, NamesNoFalseEffectWhenTheNoiseRemembers) {
  // Neighbouring samples of this noise agree for half a second to fifteen: tests that count samples
  // as observations alarm on every such recording.
  const diagnose::Report report = run({}, {.seed = 77, .noise = 4.0});
  EXPECT_EQ(report.verdict.kind, "nothing_left_out") << names_in(report);
}

}  // namespace
