// SPDX-License-Identifier: Apache-2.0
//
// Maps of step and hold: rows at rest whose position changes between rests are rows.
#include <gtest/gtest.h>

#include <algorithm>

#include "diagnose/diagnose.hpp"
#include "diagnose/track/tracks.hpp"
#include "diagnose_rests.hpp"

namespace {

using namespace ravencal;
using Eigen::Index;
using rests_sample::Map;
using rests_sample::recording_of;

physics::Plant rotor(const std::string& effects = {}) {
  auto plant = physics::parse_plant(rests_sample::rotor_text(effects), "rotor.toml");
  EXPECT_TRUE(plant.ok()) << (plant.ok() ? "" : plant.error().message);
  return plant.value();
}

diagnose::Tracks tracks_of(const std::vector<record::Recording>& recordings) {
  auto tracks = diagnose::make_tracks(recordings, {}, rotor(), std::nullopt);
  EXPECT_TRUE(tracks.ok()) << (tracks.ok() ? "" : tracks.error().message);
  return std::move(tracks).value();
}

diagnose::Report report_of(const std::vector<record::Recording>& recordings,
                           const std::string& effects = {}) {
  diagnose::Options options;
  options.threads = 1;
  auto report = diagnose::diagnose(recordings, {}, rotor(effects), options);
  EXPECT_TRUE(report.ok()) << (report.ok() ? "" : report.error().message);
  return report.value();
}

TEST(DiagnoseRests, MakesOneRowOfEachRest) {
  const Map map{.waves = {{0.004, 72.0, 0.3}}, .step_rad = 0.008};
  const record::Recording recording = recording_of(map);
  const diagnose::Tracks tracks = tracks_of({recording});
  const diagnose::Track& track = tracks.training.front();
  EXPECT_TRUE(track.at_rest);
  EXPECT_EQ(track.rows(), 2 * map.places - 1) << "the last place is held twice";
  EXPECT_NEAR(track.period_s, map.held_s + map.hidden_s, 1e-9);
  EXPECT_NEAR(track.forced.t_s[1000], 850.0, 1e-6) << "the recording's own clock";
  EXPECT_NEAR(track.joints[0].effort[100], recording.samples.col(1).segment(1500, 15).mean(),
              1e-12);
  EXPECT_GT(track.forced.motors[0].v[100], 0.0);
  EXPECT_LT(track.forced.motors[0].v[2000], 0.0);
  EXPECT_EQ(track.forced.motors[0].a.cwiseAbs().maxCoeff(), 0.0);
  ASSERT_EQ(tracks.notes.size(), 1U);
  EXPECT_NE(tracks.notes[0].find("map.csv was taken as 2999 rests"), std::string::npos)
      << tracks.notes[0];
}

TEST(DiagnoseRests, TakesCountsOfOnePlaceForOneRest) {
  record::Recording recording = recording_of({.step_rad = 0.02, .places = 200});
  for (Index i = 0; i < recording.rows(); i += 2) recording.samples(i, 0) += 0.00098;
  EXPECT_EQ(tracks_of({recording}).training.front().rows(), 399);
}

TEST(DiagnoseRests, LeavesARecordingInMotionAsItIs) {
  record::Recording recording = recording_of({.places = 1000});
  for (Index i = 0; i < recording.rows(); ++i) {
    const double t_s = 0.01 * static_cast<double>(i);
    recording.t_ns[static_cast<std::size_t>(i)] = std::llround(1e9 * t_s);
    recording.samples(i, 0) = std::sin(0.7 * t_s) + 0.5 * std::sin(1.3 * t_s);
  }
  EXPECT_FALSE(tracks_of({recording}).training.front().at_rest);
  // Pick and place: a second at each of a hundred places, and a second on the way.
  for (Index i = 0; i < recording.rows(); ++i) {
    const double t_s = 0.01 * static_cast<double>(i), part = std::fmod(t_s, 2.0);
    recording.samples(i, 0) = 0.2 * (std::floor(0.5 * t_s) + std::min(1.0, part));
  }
  const diagnose::Tracks tracks = tracks_of({recording});
  EXPECT_FALSE(tracks.training.front().at_rest) << "what moves says more than the rests";
  EXPECT_TRUE(tracks.notes.empty());
}

TEST(DiagnoseRests, RefusesARecordingThatStandsStill) {
  record::Recording recording = recording_of({});
  recording.samples.col(0).setConstant(0.5);
  const auto refused = diagnose::diagnose({recording}, {}, rotor(), {});
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, core::ErrorCode::kData);
}

class RippleOfAMap : public ::testing::TestWithParam<std::pair<double, bool>> {};

TEST_P(RippleOfAMap, IsNamedWithItsOrderAndAmplitude) {
  const auto [order, one_row] = GetParam();
  const diagnose::Report report =
      report_of({recording_of({.waves = {{0.004, order, 1.0}}, .one_row = one_row})});
  ASSERT_EQ(report.effects.size(), 1U) << report.verdict.text;
  const diagnose::NamedEffect& ripple = report.effects[0];
  EXPECT_EQ(report.verdict.kind, "named") << report.verdict.text;
  ASSERT_EQ(ripple.id, "torque_ripple") << report.verdict.text;
  EXPECT_NEAR(ripple.parameters[0].value, 0.004, 2e-4);
  EXPECT_LT(ripple.parameters[0].ci95.first, 0.004);
  EXPECT_GT(ripple.parameters[0].ci95.second, 0.004);
  EXPECT_NEAR(ripple.parameters[2].value, order, 0.1);
  EXPECT_TRUE(report.drift.empty()) << "no run starts from rest to rest";
}

INSTANTIATE_TEST_SUITE_P(Diagnose, RippleOfAMap,
                         ::testing::Values(std::pair(72.0, false), std::pair(41.7, false),
                                           std::pair(72.0, true), std::pair(41.7, true)));

TEST(DiagnoseRests, NamesNothingOnAMapOfThePlantAsItIs) {
  for (const bool one_row : {false, true})
    for (const unsigned seed : {1U, 2U, 3U}) {
      const diagnose::Report report = report_of({recording_of({.one_row = one_row, .seed = seed})});
      EXPECT_EQ(report.verdict.kind, "nothing_left_out") << report.verdict.text;
    }
}

/// A plant has one ripple, and this one states another: the wave has no name, and is not nothing.
TEST(DiagnoseRests, FlagsAWaveThatThePlantCannotHold) {
  const diagnose::Report report = report_of({recording_of({.waves = {{0.004, 72.0, 1.0}}})}, R"(
  [[joint.effect]]
  id = "torque_ripple"
  amplitude_n_m = 1e-4
  order = 18.0
  phase_rad = 0.0
)");
  EXPECT_EQ(report.verdict.kind, "unexplained") << report.verdict.text;
}

TEST(DiagnoseRests, SaysWhatRestsCannotShow) {
  const diagnose::Report report = report_of({recording_of({.waves = {{0.004, 72.0, 1.0}}})});
  for (const diagnose::NotFound& n : report.not_found) {
    if (n.id == "viscous_friction" || n.id == "inertia_error") {
      EXPECT_FALSE(n.detection_limit) << n.id;
      EXPECT_NE(n.not_testable_because.find("rests"), std::string::npos) << n.not_testable_because;
    }
  }
}

}  // namespace
