// SPDX-License-Identifier: Apache-2.0
//
// The shipped profiles on the real recordings, against figures published with or found for them.
#include <gtest/gtest.h>

#include <filesystem>
#include <numbers>

#include "record/load.hpp"
#include "record/summary.hpp"

namespace ravencal::record {
namespace {

std::filesystem::path data(const std::string& file) {
  return std::filesystem::path(RAVENCAL_DATA_DIR) / file;
}

std::vector<JointErrorSummary> raw_errors(const std::string& file,
                                          const std::string& profile_name) {
  LoadOptions options;
  options.profile = RAVENCAL_SOURCE_DIR "/tools/profiles/" + profile_name + ".toml";
  const auto loaded = load_recording(data(file), options);
  EXPECT_TRUE(loaded.ok()) << loaded.error().message;
  return loaded.ok() ? summarise(*loaded).joints : std::vector<JointErrorSummary>(6);
}

#define SKIP_WITHOUT(file)                                                              \
  if (!std::filesystem::exists(data(file))) {                                           \
    GTEST_SKIP() << "real data not found: " << data(file) << "; set RAVENCAL_DATA_DIR"; \
  }                                                                                     \
  static_assert(true)

// README of the set: RMSE of q4/q5/q6 without any correction is 8.11/10.39/16.21 deg.
TEST(DvrkBerkeley, HasTheRawWristErrorThatWasFoundElsewhere) {
  SKIP_WITHOUT("dvrk_berkeley/train_peg.csv");
  const auto joints = raw_errors("dvrk_berkeley/train_peg.csv", "dvrk_berkeley");
  ASSERT_EQ(joints.size(), 6U);
  EXPECT_NEAR(joints[3].rmse * 180 / std::numbers::pi, 8.11, 0.005);
  EXPECT_NEAR(joints[4].rmse * 180 / std::numbers::pi, 10.39, 0.005);
  EXPECT_NEAR(joints[5].rmse * 180 / std::numbers::pi, 16.21, 0.005);
  EXPECT_EQ(joints[2].unit, "m");
}

TEST(DvrkBerkeley, EveryFileIsRead) {
  SKIP_WITHOUT("dvrk_berkeley/train_peg.csv");
  for (const auto& file : std::filesystem::directory_iterator(data("dvrk_berkeley"))) {
    if (file.path().extension() != ".csv") continue;
    EXPECT_EQ(
        raw_errors("dvrk_berkeley/" + file.path().filename().string(), "dvrk_berkeley").size(), 6U);
  }
}

TEST(DvrkJhuTracker, JudgesEachAxisOnlyWhereItIsPushed) {
  SKIP_WITHOUT("dvrk_jhu_tracker/dwell_means.csv");
  const auto joints = raw_errors("dvrk_jhu_tracker/dwell_means.csv", "dvrk_jhu_tracker");
  ASSERT_EQ(joints.size(), 3U);
  // 154 pushes of 20 dwells: 52 along x, 50 along y, 52 along z.
  EXPECT_EQ(joints[0].samples, 1040U);
  EXPECT_EQ(joints[1].samples, 1000U);
  EXPECT_EQ(joints[2].samples, 1040U);
  // README: 1.633, 1.470, 0.886 mm on the test depths; all depths together must be near.
  EXPECT_NEAR(joints[0].rmse, 1.633e-3, 0.1e-3);
  EXPECT_NEAR(joints[1].rmse, 1.470e-3, 0.1e-3);
  EXPECT_NEAR(joints[2].rmse, 0.886e-3, 0.1e-3);
}

TEST(OtherRealSets, AreReadByTheirProfiles) {
  SKIP_WITHOUT("emps/emps_train.csv");
  raw_errors("emps/emps_train.csv", "emps");
  raw_errors("emps/emps_test_pulses.csv", "emps");
  raw_errors("raven2_uiuc/raven2_joint123.csv", "raven2_uiuc");
  raw_errors("raven2_uw/raven2_uw_track.csv", "raven2_uw");
  raw_errors("bam_xl330/xl330_kp100_lift_and_drop.csv", "bam_xl330");
}

}  // namespace
}  // namespace ravencal::record
