// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "diagnose/track/stretches.hpp"
#include "diagnose_generated.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double kPeriod_s = 0.02;

bool moves(double t_s) { return std::fmod(t_s, 200.0) > 150.0; }

/// One joint that is at rest but for 50 s of each 200 s; values tell their rows.
Track track_of(double length_s) {
  Track track;
  track.period_s = kPeriod_s;
  track.begins_s = 7.0;
  const Index rows = std::lround(length_s / kPeriod_s);
  const VectorXd number = VectorXd::LinSpaced(rows, 0.0, static_cast<double>(rows - 1));
  track.forced.t_s = kPeriod_s * number;
  track.forced.fresh.assign(static_cast<std::size_t>(rows), 0);
  VectorXd q = VectorXd::Zero(rows);
  for (Index i = 0; i < rows; ++i) {
    const double t_s = track.forced.t_s[i];
    if (moves(t_s)) q[i] = std::sin(t_s);
  }
  track.forced.motors = {{q, q, q, 0.0}};
  track.forced.external_loads = {VectorXd()};
  track.forced.load = [number](const std::string& name) {
    return name == "force" ? VectorXd(3.0 * number) : VectorXd();
  };
  JointTrack joint;
  joint.effort = number;
  joint.truth_shift = 2.0 * number;
  track.joints = {joint};
  track.lost = {std::vector<char>(static_cast<std::size_t>(rows), 0)};
  return track;
}

TEST(DiagnoseStretches, LeavesShortRecordingsAsTheyAre) {
  std::vector<Track> tracks = {track_of(700.0)};
  std::vector<std::string> notes;
  keep_moving_stretches(tracks, notes);
  EXPECT_TRUE(notes.empty());
  EXPECT_EQ(tracks[0].rows(), 35000);
  EXPECT_EQ(tracks[0].joints[0].effort.size(), 35000);
}

TEST(DiagnoseStretches, KeepsWhatMovesMostOfEveryPartAndSaysWhich) {
  std::vector<Track> tracks = {track_of(3600.0)};
  std::vector<std::string> notes;
  keep_moving_stretches(tracks, notes);
  const Track& track = tracks[0];
  ASSERT_EQ(track.rows(), 36000) << "720 s of one joint";
  int stretches = 0;
  Index moving = 0;
  for (Index i = 0; i < track.rows(); ++i) {
    const double t_s = track.forced.t_s[i];
    const double row = std::round(t_s / kPeriod_s);
    stretches += track.forced.fresh[static_cast<std::size_t>(i)];
    moving += moves(t_s) ? 1 : 0;
    ASSERT_EQ(track.joints[0].effort[i], row);
    ASSERT_EQ(track.joints[0].truth_shift[i], 2.0 * row);
    ASSERT_EQ(track.forced.motors[0].q[i], moves(t_s) ? std::sin(t_s) : 0.0);
    const bool follows =
        i > 0 && std::abs(t_s - track.forced.t_s[i - 1] - kPeriod_s) < 1e-6 * kPeriod_s;
    ASSERT_NE(follows, track.forced.fresh[static_cast<std::size_t>(i)] != 0) << i;
  }
  EXPECT_EQ(stretches, 18);
  EXPECT_GT(moving, 36000 * 8 / 10) << "a quarter of the recording moves";
  EXPECT_LT(track.forced.t_s[0], 200.0);
  EXPECT_GT(track.forced.t_s[35999], 3400.0);
  EXPECT_EQ(track.forced.load("force")[35999], 3.0 * track.joints[0].effort[35999]);
  EXPECT_EQ(track.forced.load("none").size(), 0);
  EXPECT_EQ(track.joints[0].truth.size(), 0);
  ASSERT_EQ(notes.size(), 1U);
  EXPECT_EQ(notes[0],
            "of 3600 s to fit, 720 s were fitted: the 18 stretches in which the joints move most "
            "(--all-rows fits every row)");
}

TEST(DiagnoseStretches, DividesWhatIsFittedAmongRecordings) {
  std::vector<Track> tracks = {track_of(1200.0), track_of(600.0)};
  std::vector<std::string> notes;
  keep_moving_stretches(tracks, notes);
  EXPECT_EQ(tracks[0].rows(), 24000);
  EXPECT_EQ(tracks[1].rows(), 12000);
}

TEST(DiagnoseStretches, LostRowsAreNoMotion) {
  Track track = track_of(3600.0);
  for (Index i = 0; i < track.rows(); ++i) {
    const double in_part_s = std::fmod(track.forced.t_s[i], 200.0);
    track.lost[0][static_cast<std::size_t>(i)] = in_part_s > 150.0 && in_part_s < 160.0;
  }
  std::vector<Track> tracks = {std::move(track)};
  std::vector<std::string> notes;
  keep_moving_stretches(tracks, notes);
  EXPECT_LT(std::count(tracks[0].lost[0].begin(), tracks[0].lost[0].end(), 1), 18 * 50)
      << "a second of each stretch of 40 s";
}

TEST(DiagnoseStretches, NamesWhatAnHourShowsByTheStretchesAlone) {
  const Report report =
      diagnosed(generator::make_recording({.coulomb_n_m = 1.5}, {.seed = 3, .duration_s = 3600.0}));
  ASSERT_EQ(report.effects.size(), 1U);
  EXPECT_EQ(report.effects[0].id, "coulomb_friction");
  EXPECT_NEAR(report.effects[0].parameters.at(0).value, 1.5, 0.1);
  ASSERT_FALSE(report.notes.empty());
  EXPECT_NE(report.notes.back().find("of 3600 s to fit, 720 s were fitted"), std::string::npos)
      << report.notes.back();
}

}  // namespace
}  // namespace ravencal::diagnose
