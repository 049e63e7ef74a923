// SPDX-License-Identifier: Apache-2.0
//
// Real recordings with physics that the shipped plants conceal; figures on data that no fit saw.
// The limits are those of others (README of each set), or ours with a margin of a tenth where ours
// are worse.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "diagnose/diagnose.hpp"
#include "diagnose/report/write_report.hpp"
#include "record/load.hpp"

namespace {

namespace fs = std::filesystem;
using namespace ravencal;

const fs::path kData = RAVENCAL_DATA_DIR;
const fs::path kTools = fs::path(RAVENCAL_SOURCE_DIR) / "tools";

struct Case {
  std::string plant;
  std::vector<std::string> training, held_out = {};
  double held_out_from_s = -1.0;
  std::string profile = {}, held_out_profile = {};  ///< empty: the plant's name
};

diagnose::Report run(const Case& c) {
  const auto load = [&](const std::vector<std::string>& files, const std::string& name) {
    std::vector<record::Recording> recordings;
    for (const std::string& file : files) {
      record::LoadOptions options;
      options.profile =
          (kTools / "profiles" / ((name.empty() ? c.plant : name) + ".toml")).string();
      auto recording = record::load_recording(kData / c.plant / file, options);
      EXPECT_TRUE(recording.ok()) << (recording.ok() ? "" : recording.error().message);
      recordings.push_back(std::move(recording).value());
    }
    return recordings;
  };
  const auto plant = physics::load_plant(kTools / "plants" / (c.plant + ".toml"));
  EXPECT_TRUE(plant.ok()) << (plant.ok() ? "" : plant.error().message);
  diagnose::Options options;
  options.threads = 1;
  if (c.held_out_from_s >= 0.0) options.series.held_out_from_s = c.held_out_from_s;
  auto report = diagnose::diagnose(load(c.training, c.profile),
                                   load(c.held_out, c.held_out_profile), plant.value(), options);
  EXPECT_TRUE(report.ok()) << (report.ok() ? "" : report.error().message);
  const fs::path folder = fs::path(::testing::TempDir()) / ("diagnose_" + c.plant);
  const auto written = diagnose::write_report(report.value(), plant.value(), folder);
  EXPECT_TRUE(written.ok()) << (written.ok() ? "" : written.error().message);
  const auto improved = physics::load_plant(folder / "plant_improved.toml");
  EXPECT_TRUE(improved.ok()) << (improved.ok() ? "" : improved.error().message);
  return std::move(report).value();
}

const diagnose::NamedEffect* find(const diagnose::Report& report, const std::string& joint,
                                  const std::string& id) {
  const auto it = std::find_if(report.effects.begin(), report.effects.end(), [&](const auto& e) {
    return e.joint == joint &&
           (e.id == id || std::find(e.ambiguous_with.begin(), e.ambiguous_with.end(), id) !=
                              e.ambiguous_with.end());
  });
  return it == report.effects.end() ? nullptr : &*it;
}

double after(const diagnose::Report& report, const std::string& joint, const std::string& metric) {
  for (const auto& h : report.held_out) {
    if (h.joint == joint && h.metric == metric) return h.after;
  }
  return 1e300;
}

#define SKIP_WITHOUT(folder)                                                                \
  if (!fs::exists(kData / (folder))) {                                                      \
    GTEST_SKIP() << "no recordings in " << (kData / (folder)) << "; set RAVENCAL_DATA_DIR"; \
  }                                                                                         \
  static_assert(true)

TEST(DiagnoseEmps, NamesTheFrictionThatThePlantConceals) {
  SKIP_WITHOUT("emps");
  const auto report = run({"emps", {"emps_train.csv"}, {"emps_test_pulses.csv"}});
  const auto* coulomb = find(report, "carriage", "coulomb_friction");
  const auto* viscous = find(report, "carriage", "viscous_friction");
  ASSERT_NE(coulomb, nullptr);
  ASSERT_NE(viscous, nullptr);
  EXPECT_NE(find(report, "carriage", "asymmetric_friction"), nullptr);
  // Janot, Gautier, Brunot 2019: 20.39 N and 203.5 N s/m.
  EXPECT_NEAR(coulomb->parameters.front().value, 20.39, 0.6);
  EXPECT_NEAR(viscous->parameters.front().value, 203.5, 6.0);
  EXPECT_LE(after(report, "carriage", "effort_relative_error"), 5.39);
}

TEST(DiagnoseEmps, FindsThe25PulsesAtTheDriveInput) {
  SKIP_WITHOUT("emps");
  const auto report = run({"emps", {"emps_test_pulses.csv"}, {}});
  const auto* pulses = find(report, "carriage", "input_disturbance");
  ASSERT_NE(pulses, nullptr);
  EXPECT_NEAR(pulses->parameters[0].value, 175.8, 0.05 * 175.8);
  EXPECT_EQ(pulses->parameters[1].value, 25.0);
  for (int k = 0; k < 25; ++k) {
    EXPECT_NEAR(pulses->parameters[static_cast<std::size_t>(3 + k)].value, 0.344 + k, 0.010)
        << "pulse " << k + 1;
  }
}

TEST(DiagnoseRaven2Uiuc, NamesFrictionOfMotorAndCable) {
  SKIP_WITHOUT("raven2_uiuc");
  const auto report = run({"raven2_uiuc", {"raven2_joint123.csv"}, {}, 11.65});
  for (const char* joint : {"shoulder", "elbow", "insertion"})
    EXPECT_NE(find(report, joint, "coulomb_friction"), nullptr) << joint;
  EXPECT_LE(after(report, "shoulder", "effort_relative_error_unfiltered"), 27.0);
  EXPECT_LE(after(report, "elbow", "effort_relative_error_unfiltered"), 21.0);
  EXPECT_LE(after(report, "insertion", "effort_relative_error_unfiltered"), 52.0);
}

TEST(DiagnoseRaven2Uw, NamesHysteresisAndFollowsAsWellAsOthers) {
  SKIP_WITHOUT("raven2_uw");
  const auto report = run({"raven2_uw", {"raven2_uw_track.csv"}, {}, 55.0});
  for (const char* joint : {"shoulder", "elbow", "insertion"})
    EXPECT_NE(find(report, joint, "hysteresis"), nullptr) << joint;
  constexpr double kDeg = 3.14159265358979 / 180.0;
  EXPECT_LE(after(report, "shoulder", "tracking_rmse"), 0.0281 * kDeg);
  EXPECT_LE(after(report, "elbow", "tracking_rmse"), 0.0428 * kDeg);
  EXPECT_LE(after(report, "insertion", "tracking_rmse"), 0.0029e-2);
}

TEST(DiagnoseDvrkWrist, NamesOffsetCouplingAndPlayThroughGrossErrorsOfTheCamera) {
  SKIP_WITHOUT("dvrk_berkeley");
  const auto report = run({"dvrk_berkeley", {"train_random.csv"}, {"train_peg.csv"}});
  EXPECT_NE(find(report, "q4", "homing_offset"), nullptr);
  EXPECT_NE(find(report, "q6", "coupling"), nullptr);
  for (const char* joint : {"q4", "q5", "q6"})
    EXPECT_NE(find(report, joint, "hysteresis"), nullptr) << joint;
  for (const diagnose::NamedEffect& e : report.effects) {
    const auto [low, high] = e.parameters.front().ci95;
    EXPECT_GT(low * high, 0.0) << e.id << " of " << e.joint << " may as well be nothing";
  }
  constexpr double kDeg = 3.14159265358979 / 180.0;
  EXPECT_LE(after(report, "q4", "position_rmse"), 0.84 * kDeg);
  EXPECT_LE(after(report, "q5", "position_rmse"), 3.49 * kDeg);
  EXPECT_LE(after(report, "q6", "position_rmse"), 2.65 * kDeg);
}

TEST(DiagnoseBam, PrefersFrictionByLoadOnAGainThatNoFitSaw) {
  SKIP_WITHOUT("bam_xl330");
  std::vector<std::string> training, held_out;
  for (const char* gain : {"100", "200", "800", "400"}) {
    for (const char* motion : {"lift_and_drop", "sin_sin", "sin_time_square", "up_and_down"}) {
      auto& list = std::string(gain) == "400" ? held_out : training;
      list.push_back(std::string("xl330_kp") + gain + "_" + motion + ".csv");
    }
  }
  const auto report = run({"bam_xl330", training, held_out});
  EXPECT_NE(find(report, "pendulum", "load_dependent_friction"), nullptr);
  EXPECT_LE(after(report, "pendulum", "closed_loop_mae"), 0.045);
}

TEST(DiagnoseDvrk, NamesCableStretchUnderTheRecordedForce) {
  SKIP_WITHOUT("dvrk_jhu_tracker");
  const std::string file = "dwell_means.csv";
  const auto report = run({"dvrk_jhu_tracker",
                           {file},
                           {file},
                           -1.0,
                           "dvrk_jhu_tracker_three_depths",
                           "dvrk_jhu_tracker_other_depths"});
  for (const char* axis : {"x", "y", "z"}) {
    EXPECT_NE(find(report, axis, "compliance"), nullptr) << axis;
  }
  for (const diagnose::NamedEffect& e : report.effects) {
    const auto [low, high] = e.parameters.front().ci95;
    EXPECT_TRUE(e.id != "homing_offset" || low * high > 0.0) << e.joint << " may have none";
  }
  EXPECT_LE(after(report, "x", "position_rmse"), 0.071e-3);  // others: 0.063
  EXPECT_LE(after(report, "y", "position_rmse"), 0.178e-3);
  EXPECT_LE(after(report, "z", "position_rmse"), 0.044e-3);
}

}  // namespace
