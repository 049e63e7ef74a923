// SPDX-License-Identifier: Apache-2.0
//
// What `diagnose` says holds for the plant that it writes: figures, limits, numbers that
// stay as they were. The same report on any number of threads.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "diagnose/diagnose.hpp"
#include "diagnose/explain/models.hpp"
#include "diagnose/explain/view.hpp"
#include "diagnose/report/write_report.hpp"
#include "diagnose/search/screen.hpp"
#include "diagnose/search/search.hpp"
#include "diagnose/track/tracks.hpp"
#include "diagnose_pendulum.hpp"
#include "physics/plant_writer.hpp"

namespace ravencal::diagnose {
namespace {

const std::string kViscous = R"(
  [[joint.effect]]
  id = "viscous_friction"
  damping_n_m_s_per_rad = 0.6
)";

Report report_of(const physics::Plant& robot, const physics::Plant& given, unsigned seed = 1,
                 const Options& options = {}) {
  auto explained =
      diagnose({recording_of(robot, seed)}, {recording_of(robot, seed + 1)}, given, options);
  EXPECT_TRUE(explained.ok()) << (explained.ok() ? "" : explained.error().message);
  return std::move(*explained);
}

const HeldOut& figure(const Report& report, const std::string& metric) {
  const auto at = std::find_if(report.held_out.begin(), report.held_out.end(),
                               [&](const HeldOut& h) { return h.metric == metric; });
  EXPECT_NE(at, report.held_out.end()) << metric;
  return *at;
}

TEST(DiagnoseExplain, SaysOfThePlantThatItWritesWhatThatPlantPredicts) {
  const physics::Plant robot = plant_of(kViscous);
  const physics::Plant given = plant_of("");
  const Report report = report_of(robot, given);
  const auto written = physics::parse_plant(physics::plant_text(report.improved), "written.toml");
  ASSERT_TRUE(written.ok()) << written.error().message;
  auto tracks = make_tracks({recording_of(robot, 1)}, {recording_of(robot, 2)}, given, {});
  ASSERT_TRUE(tracks.ok()) << tracks.error().message;
  const Likelihood fitted(given, std::move(tracks->training));
  const Likelihood shown(given, std::move(tracks->held_out), &fitted);
  const View view = view_of(given, *written, shown, true);
  for (std::size_t c = 0; c < shown.channels().size(); ++c) {
    const Channel& channel = shown.channels()[c];
    const HeldOut& said =
        figure(report, channel.kind == ChannelKind::kDrive ? "effort_rmse" : "position_rmse");
    EXPECT_DOUBLE_EQ(said.before, rms(channel, view.before[c]));
    EXPECT_NEAR(said.after, rms(channel, view.after[c]), 1e-9 * said.after);
  }
  EXPECT_LT(figure(report, "effort_rmse").after, 0.3 * figure(report, "effort_rmse").before);
}

TEST(DiagnoseExplain, LeavesANumberThatTheRecordingsDoNotMoveAsItIs) {
  const physics::Plant given = plant_of("");
  const Report report = report_of(given, given);
  EXPECT_TRUE(report.effects.empty());
  // Chance moves one number in twenty.
  EXPECT_LE(report.refitted.size(), 1U);
  if (report.refitted.empty()) {
    EXPECT_EQ(report.improved.joints[0].effects, given.joints[0].effects);
    EXPECT_EQ(report.improved.joints[0].link, given.joints[0].link);
  }
}

TEST(DiagnoseExplain, NamesAnEffectAboveItsLimitAndNoneFarBelow) {
  const physics::Plant given = plant_of("");
  const Report silent = report_of(given, given);
  const auto limit = std::find_if(silent.not_found.begin(), silent.not_found.end(),
                                  [](const NotFound& n) { return n.id == "viscous_friction"; });
  ASSERT_NE(limit, silent.not_found.end());
  ASSERT_TRUE(limit->detection_limit.has_value()) << limit->not_testable_because;
  const auto named_at = [&](double times) {
    const physics::Plant robot = plant_of(
        "  [[joint.effect]]\n  id = \"viscous_friction\"\n"
        "  damping_n_m_s_per_rad = " +
        std::to_string(times * *limit->detection_limit) + "\n");
    const Report report = report_of(robot, given);
    return std::any_of(report.effects.begin(), report.effects.end(),
                       [](const NamedEffect& e) { return e.id == "viscous_friction"; });
  };
  EXPECT_TRUE(named_at(1.5)) << *limit->detection_limit;
  EXPECT_FALSE(named_at(0.3)) << *limit->detection_limit;
}

TEST(DiagnoseExplain, SaysNothingOfAnEffectThatTheWrittenModelLacks) {
  const physics::Plant given = plant_of("");
  auto tracks = make_tracks({recording_of(plant_of(kViscous), 1)}, {}, given, {});
  ASSERT_TRUE(tracks.ok()) << tracks.error().message;
  Likelihood training(given, std::move(tracks->training));
  Vocabulary vocabulary = vocabulary_of(given, training, nullptr);
  Search search(training, nullptr, vocabulary, Options().alpha, 0);
  search.run([] { return true; });
  Models models = models_of(given, training, vocabulary, search);
  const auto named = std::find_if(
      models.written.effects.begin(), models.written.effects.end(), [&](const auto& effect) {
        return vocabulary.candidates[effect.first].id == "viscous_friction";
      });
  ASSERT_NE(named, models.written.effects.end());
  models.written = without(models.written, vocabulary, named->first);
  Report report;
  add_effects(models, view_of(given, models.improved, training, false), report);
  for (const NamedEffect& effect : report.effects) EXPECT_NE(effect.id, "viscous_friction");
}

TEST(DiagnoseExplain, SpeaksOfEveryWordOnce) {
  const Report report = report_of(plant_of(kViscous), plant_of(""));
  EXPECT_EQ(report.effects.size() + report.not_found.size(), 35U);
  for (const NotFound& n : report.not_found)
    EXPECT_NE(n.detection_limit.has_value(), !n.not_testable_because.empty()) << n.id;
}

TEST(DiagnoseExplain, GivesTheSameReportOnAnyNumberOfThreads) {
  const physics::Plant robot = plant_of(kViscous);
  Options options;
  options.placebos = 2;
  const std::string one = report_json(report_of(robot, plant_of(""), 1, options));
  options.threads = 3;
  EXPECT_EQ(one, report_json(report_of(robot, plant_of(""), 1, options)));
}

TEST(DiagnoseExplain, FindsNothingInPlacebosOfWhiteNoise) {
  Options options;
  options.placebos = 5;
  const Report report = report_of(plant_of(kViscous), plant_of(""), 1, options);
  ASSERT_TRUE(report.verdict.false_alarm_rate.has_value());
  EXPECT_EQ(*report.verdict.false_alarm_rate, 0.0);
  EXPECT_EQ(report.verdict.placebos, 5);
}

TEST(DiagnoseExplain, StopsWhenItIsTold) {
  Options options;
  options.look = [](double, std::string_view) { return false; };
  const physics::Plant plant = plant_of("");
  const auto stopped = diagnose({recording_of(plant, 1)}, {}, plant, options);
  ASSERT_FALSE(stopped.ok());
  EXPECT_EQ(stopped.error().code, core::ErrorCode::kUsage);
}

/// A constant effort is no slow noise, however brief the recording.
TEST(DiagnoseExplain, NamesAConstantOfTheDriveInABriefRecording) {
  const std::string uneven = R"(
  [[joint.effect]]
  id = "asymmetric_friction"
  level_difference_n_m = 0.3
)";
  const physics::Plant robot = plant_of(uneven);
  record::Recording brief = recording_of(robot, 1);
  constexpr Index kBriefRows = 1250;
  brief.t_ns.resize(kBriefRows);
  brief.samples.conservativeResize(kBriefRows, Eigen::NoChange);
  const auto explained = diagnose({brief}, {recording_of(robot, 2)}, plant_of(""), {});
  ASSERT_TRUE(explained.ok()) << explained.error().message;
  ASSERT_EQ(explained->effects.size(), 1U);
  EXPECT_EQ(explained->effects[0].id, "asymmetric_friction");
  EXPECT_NEAR(explained->effects[0].parameters[0].value, 0.3, 0.06);
}

physics::Plant servoed_plant() {
  physics::Plant plant = plant_of("");
  physics::Controller controller;
  controller.kp_n_m_per_rad = 1.0;
  plant.joints[0].controller = controller;
  return plant;
}

/// With a desired position of which the plant's law, times `gain`, makes the recorded effort.
record::Recording servoed(const physics::Plant& plant, record::Recording r, double gain) {
  const physics::Joint& joint = plant.joints[0];
  const double law = gain * joint.reduction * joint.reduction / joint.gearbox_ratio;
  r.channels.push_back({"desired", "rad", Role::kDesiredPosition, "one"});
  r.samples.conservativeResize(Eigen::NoChange, 4);
  r.samples.col(3) = r.samples.col(0) / joint.reduction +
                     r.samples.col(1) * (joint.reduction / joint.gearbox_ratio) / law;
  return r;
}

/// What is recorded is what was asked of the drive; what the motion needed stayed just below the
/// limit there.
TEST(DiagnoseExplain, NamesTheLimitOfADriveThatWasAskedForMore) {
  const physics::Plant plant = servoed_plant();
  const double to_joint = plant.joints[0].reduction / plant.joints[0].gearbox_ratio;
  const double most_n_m = to_joint * recording_of(plant, 1).samples.col(1).maxCoeff();
  const double delivered_n_m = 0.8 * most_n_m;
  const auto limited = [&](unsigned seed) {
    record::Recording r = recording_of(plant, seed);
    for (Index i = 0; i < r.rows(); ++i) {
      const double asked_n_m = most_n_m * (1.5 + 0.5 * std::sin(0.1 * static_cast<double>(i)));
      if (r.samples(i, 1) * to_joint > delivered_n_m) r.samples(i, 1) = asked_n_m / to_joint;
    }
    return servoed(plant, std::move(r), 1.0);
  };
  const auto explained = diagnose({limited(1)}, {limited(2)}, plant, {});
  ASSERT_TRUE(explained.ok()) << explained.error().message;
  const std::vector<NamedEffect>& effects = explained->effects;
  const auto effect = std::find_if(effects.begin(), effects.end(),
                                   [](const NamedEffect& e) { return e.id == "saturation"; });
  ASSERT_NE(effect, effects.end());
  ASSERT_EQ(effect->parameters.size(), 1U);
  EXPECT_EQ(effect->parameters[0].name, "limit");
  EXPECT_GT(effect->parameters[0].value, delivered_n_m);
  EXPECT_LT(effect->parameters[0].value, 1.1 * most_n_m);
  EXPECT_LT(effect->held_out_after, 0.5 * effect->held_out_before);
}

/// No robot was ever asked for more than its DAC can say.
TEST(DiagnoseExplain, LetsALawAskForNoMoreThanItsDac) {
  physics::Plant plant = servoed_plant();
  const record::Recording recording = servoed(plant, recording_of(plant, 1), 1.0);
  const double most_n_m = recording.samples.col(1).cwiseAbs().maxCoeff();
  const auto asked_n_m = [&](double dac_limit_n_m) {
    plant.joints[0].drive.dac_counts_per_n_m = 1000.0;
    plant.joints[0].controller->dac_limit_counts = 1000.0 * dac_limit_n_m;
    auto tracks = make_tracks({recording}, {}, plant, {});
    EXPECT_TRUE(tracks.ok()) << (tracks.ok() ? "" : tracks.error().message);
    const Likelihood rows(plant, std::move(tracks->training));
    const double to_joint = plant.joints[0].reduction / plant.joints[0].gearbox_ratio;
    return rows.outcome(rows.base()).commands[0][0].cwiseAbs().maxCoeff() / to_joint;
  };
  EXPECT_GT(asked_n_m(10.0 * most_n_m), 0.9 * most_n_m);
  EXPECT_NEAR(asked_n_m(0.5 * most_n_m), 0.5 * most_n_m, 1e-9);
}

/// The gain of a servo is a setting: where it differs between recordings the plant's law made none
/// of them, and nothing is concluded from it.
TEST(DiagnoseExplain, ComparesNoLawWhoseGainDiffersBetweenRecordings) {
  const physics::Plant plant = servoed_plant();
  const auto has_law = [&](double first, double second) {
    auto tracks = make_tracks({servoed(plant, recording_of(plant, 1), first),
                               servoed(plant, recording_of(plant, 2), second)},
                              {}, plant, {});
    EXPECT_TRUE(tracks.ok()) << (tracks.ok() ? "" : tracks.error().message);
    return Likelihood(plant, std::move(tracks->training)).has(0, ChannelKind::kLaw);
  };
  EXPECT_TRUE(has_law(1.0, 1.0));
  EXPECT_TRUE(has_law(1.1, 1.1));
  EXPECT_FALSE(has_law(1.0, 2.0));
}

}  // namespace
}  // namespace ravencal::diagnose
