// SPDX-License-Identifier: Apache-2.0
//
// The loop closes on every shipped set: diagnose, then its plant_improved.toml along a recording
// that the fit did not see, which must come out nearer to the robot than with the plant that was
// diagnosed.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "diagnose/diagnose.hpp"
#include "diagnose/report/write_report.hpp"
#include "record/load.hpp"
#include "simulation/follow.hpp"

namespace {

namespace fs = std::filesystem;
using namespace ravencal;

const fs::path kData = RAVENCAL_DATA_DIR;
const fs::path kTools = fs::path(RAVENCAL_SOURCE_DIR) / "tools";

struct Nearer {
  std::string joint;
  double factor;  ///< at most so much of the nominal plant's distance
};
struct Case {
  std::string plant, training, test;
  double held_out_from_s;  ///< of the training recording; negative: all of it trains
  std::vector<Nearer> joints;
  std::string profile = {}, test_profile = {};  ///< empty: the plant's name
  bool open_loop = false;                       ///< a stiff servo hides what its drive does
  const char* missed = "";
};

record::Recording load(const Case& c, const std::string& file, const std::string& profile) {
  record::LoadOptions options;
  options.profile =
      (kTools / "profiles" / ((profile.empty() ? c.plant : profile) + ".toml")).string();
  auto recording = record::load_recording(kData / c.plant / file, options);
  EXPECT_TRUE(recording.ok()) << (recording.ok() ? "" : recording.error().message);
  return std::move(recording).value();
}

double distance(const physics::Plant& plant, const record::Recording& recording,
                const std::string& joint, bool open_loop) {
  simulation::FollowOptions options;
  options.open_loop = open_loop;
  const auto followed = simulation::follow_recording(plant, recording, options);
  EXPECT_TRUE(followed.ok()) << (followed.ok() ? "" : followed.error().message);
  for (const auto& f : followed->joints) {
    if (f.joint == joint) return f.rmse_ji;
  }
  ADD_FAILURE() << "joint " << joint << " was not simulated";
  return 0.0;
}

class ImprovedPlant : public ::testing::TestWithParam<Case> {};

TEST_P(ImprovedPlant, RunsInSimulateAsItIsAndIsNearerToTheRobot) {
  const Case& c = GetParam();
  if (*c.missed != 0) GTEST_SKIP() << "missed: " << c.missed;
  if (!fs::exists(kData / c.plant))
    GTEST_SKIP() << "no recordings in " << (kData / c.plant) << "; set RAVENCAL_DATA_DIR";
  const auto nominal = physics::load_plant(kTools / "plants" / (c.plant + ".toml"));
  ASSERT_TRUE(nominal.ok()) << nominal.error().message;
  diagnose::Options options;
  options.threads = 1;
  if (c.held_out_from_s >= 0.0) options.held_out_from_s = c.held_out_from_s;
  const auto report = diagnose::diagnose({load(c, c.training, c.profile)}, {}, *nominal, options);
  ASSERT_TRUE(report.ok()) << report.error().message;
  const fs::path folder =
      fs::path(::testing::TempDir()) / ("improved_" + std::to_string(::getpid()));
  const auto written = diagnose::write_report(*report, folder);
  ASSERT_TRUE(written.ok()) << written.error().message;
  const auto improved = physics::load_plant(folder / "plant_improved.toml");
  ASSERT_TRUE(improved.ok()) << improved.error().message;
  const auto test = load(c, c.test, c.test_profile);
  for (const Nearer& nearer : c.joints) {
    EXPECT_LT(distance(*improved, test, nearer.joint, c.open_loop),
              nearer.factor * distance(*nominal, test, nearer.joint, c.open_loop))
        << nearer.joint;
  }
}

INSTANTIATE_TEST_SUITE_P(
    Sets, ImprovedPlant,
    ::testing::Values(Case{"emps",
                           "emps_train.csv",
                           "emps_test_pulses.csv",
                           -1.0,
                           {{"carriage", 0.1}},
                           "",
                           "",
                           true},
                      Case{"bam_xl330",
                           "xl330_kp400_sin_time_square.csv",
                           "xl330_kp400_sin_sin.csv",
                           -1.0,
                           {{"pendulum", 0.8}},
                           "",
                           "",
                           false,
                           "in 6 s of one recording nothing is named"},
                      Case{"raven2_uiuc",
                           "raven2_joint123.csv",
                           "raven2_joint123.csv",
                           11.65,
                           // What posture takes of the shoulder's effort is found, but has no link
                           // in the plant that could carry it.
                           {{"shoulder", 0.4}, {"elbow", 0.3}, {"insertion", 0.3}}},
                      Case{"raven2_uw",
                           "raven2_uw_track.csv",
                           "raven2_uw_track.csv",
                           55.0,
                           {{"shoulder", 0.8}, {"elbow", 0.5}, {"insertion", 0.5}}},
                      Case{"dvrk_berkeley",
                           "train_random.csv",
                           "train_pickplace.csv",
                           -1.0,
                           {{"q4", 0.3}, {"q5", 0.8}, {"q6", 0.5}},
                           "",
                           "",
                           false,
                           "q5 comes 19.8 % nearer than with the given plant"},
                      Case{"dvrk_jhu_tracker",
                           "dwell_means.csv",
                           "dwell_means.csv",
                           -1.0,
                           {{"x", 0.2}, {"y", 0.3}, {"z", 0.2}},
                           "dvrk_jhu_tracker_three_depths",
                           "dvrk_jhu_tracker_other_depths"}),
    [](const auto& instance) { return instance.param.plant; });

}  // namespace
