// SPDX-License-Identifier: Apache-2.0
//
// The recording of a run: states at their rate, truth in between its readings, gaps as gaps.
#include <gtest/gtest.h>

#include <cmath>

#include "core/catalogue.hpp"
#include "record/load.hpp"
#include "robot/run_recorder.hpp"
#include "rt/rig.hpp"

namespace ravencal::test {
namespace {

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kStart = 1'700'000'000'000'000'000;

record::RavenStateMessage state_at(std::int64_t ms) {
  record::RavenStateMessage state;
  state.stamp_ns = kStart + ms * kMs;
  state.values[core::catalogue_index(core::RavenField::kJpos, 1)] = 90.0;
  state.values[core::catalogue_index(core::RavenField::kRunlevel, 0)] = 3.0;
  return state;
}

class Recorded : public testing::Test {
 protected:
  void SetUp() override {
    options_.path = scratch_folder() / "run.db";
    options_.overwrite = true;
    options_.trajectory = "zigzag.csv";
  }
  robot::RunRecorder create() {
    auto made = robot::RunRecorder::create(options_);
    EXPECT_TRUE(made.ok()) << made.error().message;
    return std::move(made).value();
  }
  record::Recording load() {
    auto loaded = record::load_recording(options_.path, {});
    EXPECT_TRUE(loaded.ok()) << loaded.error().message;
    return std::move(loaded).value();
  }
  robot::RunRecorderOptions options_;
};

TEST_F(Recorded, HasTheTruthAtEachStatesOwnTime) {
  robot::RunRecorder recorder = create();
  for (std::int64_t ms = 0; ms <= 1000; ++ms) {
    if (ms % 11 == 3) {
      recorder.take_truth(kStart + ms * kMs, {1e-3 * static_cast<double>(ms), 0.0, 0.4});
    }
    ASSERT_TRUE(recorder.take(state_at(ms), true).ok());
  }
  ASSERT_TRUE(recorder.finish().ok());
  const record::Recording run = load();
  EXPECT_NEAR(static_cast<double>(run.rows()), 101.0, 1.0);
  const auto truth = *run.column("truth.shoulder");
  int with_truth = 0;
  for (Eigen::Index row = 0; row < run.rows(); ++row) {
    if (std::isnan(run.samples(row, truth))) continue;
    ++with_truth;
    const double t_s = 1e-9 * static_cast<double>(run.t_ns[static_cast<std::size_t>(row)] - kStart);
    EXPECT_NEAR(run.samples(row, truth), t_s, 1e-9);
  }
  EXPECT_GE(with_truth, 98);
  EXPECT_NEAR(run.samples(0, *run.column("jpos.elbow")), M_PI / 2.0, 1e-9);
  EXPECT_EQ(run.calibratable_joints().size(), 3U);
  EXPECT_EQ(run.meta.at("trajectory"), "zigzag.csv");
}

TEST_F(Recorded, InventsNoTruthAcrossAGap) {
  robot::RunRecorder recorder = create();
  for (std::int64_t ms = 0; ms <= 600; ms += 10) {
    if (ms <= 200 || ms >= 400) recorder.take_truth(kStart + ms * kMs, {0.5, 1.5, 0.4});
    ASSERT_TRUE(recorder.take(state_at(ms), true).ok());
  }
  ASSERT_TRUE(recorder.finish().ok());
  const record::Recording run = load();
  const auto truth = *run.column("truth.elbow");
  for (Eigen::Index row = 0; row < run.rows(); ++row) {
    const std::int64_t ms = (run.t_ns[static_cast<std::size_t>(row)] - kStart) / kMs;
    EXPECT_EQ(std::isnan(run.samples(row, truth)), ms > 200 && ms < 400) << ms;
  }
}

TEST_F(Recorded, GoesOnWithoutEncodersAndLeavesOutWhatDoesNotMove) {
  robot::RunRecorder recorder = create();
  for (std::int64_t ms = 0; ms <= 2000; ++ms) {
    ASSERT_TRUE(recorder.take(state_at(ms), ms < 500 || ms >= 1500).ok());
    if (ms == 500) {
      ASSERT_TRUE(recorder.note(state_at(ms).stamp_ns, "pause", "the pedal is up").ok());
    }
  }
  ASSERT_TRUE(recorder.finish().ok());
  const record::Recording run = load();
  EXPECT_NEAR(static_cast<double>(run.rows()), 101.0, 2.0);
  EXPECT_EQ(recorder.rows_with_truth(), 0);
  for (const std::int64_t t_ns : run.t_ns) {
    const std::int64_t ms = (t_ns - kStart) / kMs;
    EXPECT_TRUE(ms < 500 || ms >= 1500) << ms;
  }
  ASSERT_EQ(run.events.size(), 1U);
  EXPECT_EQ(run.events[0].kind, "pause");
  EXPECT_EQ(run.events[0].t_ns, kStart + 500 * kMs);
}

TEST_F(Recorded, RefusesToReplaceAFileUnlessToldTo) {
  { ASSERT_TRUE(create().finish().ok()); }
  options_.overwrite = false;
  EXPECT_FALSE(robot::RunRecorder::create(options_).ok());
}

}  // namespace
}  // namespace ravencal::test
