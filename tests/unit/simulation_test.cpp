// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <string>

#include "record/load.hpp"
#include "simulation/session.hpp"
#include "simulation/truth_stream.hpp"

namespace ravencal::simulation {
namespace {

namespace fs = std::filesystem;

physics::Plant shipped_plant() {
  auto plant = physics::load_plant(std::string(RAVENCAL_SOURCE_DIR) + "/tools/plants/raven2.toml");
  EXPECT_TRUE(plant.ok()) << plant.error().message;
  return std::move(plant).value();
}

trajectory::Trajectory short_motion(double duration_s) {
  trajectory::RandomOptions options;
  options.duration_s = duration_s;
  return *trajectory::make_random(options);
}

fs::path fresh(const std::string& name) {
  const fs::path path = fs::path(testing::TempDir()) / name;
  fs::remove(path);
  return path;
}

const ProgressFunction kGoOn = [](double) { return true; };

TEST(TruthStream, PairsARowWithTheReadingOfNearestStamp) {
  physics::Logger logger;
  logger.truth_period_s = 0.010;
  logger.truth_latency_s = 0.004;
  TruthStream stream(logger, 1);
  EXPECT_FALSE(stream.nearest(0.0, true).has_value());
  for (int ms = 0; ms < 100; ++ms) stream.observe(1e-3 * ms, {ms, 0, 0});
  const auto counts = stream.nearest(0.050, false);
  ASSERT_TRUE(counts.has_value());
  // Stamps lie within half a period of the row; the reading is a latency older than its stamp.
  EXPECT_LE(std::abs(static_cast<double>((*counts)[0]) + 4.0 - 50.0), 5.5);
  EXPECT_FALSE(stream.nearest(0.2, false).has_value()) << "a nearer reading may still come";
  EXPECT_TRUE(stream.nearest(0.2, true).has_value());
}

TEST(Session, RecordsEveryFieldWithItsTruth) {
  const fs::path path = fresh("session.db");
  const auto summary = record_session(shipped_plant(), short_motion(20.0), path, {}, kGoOn);
  ASSERT_TRUE(summary.ok()) << summary.error().message;
  EXPECT_EQ(summary->rows, 2001);
  const auto recording = record::load_recording(path, {});
  ASSERT_TRUE(recording.ok()) << recording.error().message;
  EXPECT_EQ(recording->rows(), 2001);
  EXPECT_EQ(recording->samples.cols(), 3 + 240 + 3);
  EXPECT_EQ(recording->calibratable_joints().size(), 3U);
  EXPECT_TRUE(recording->samples.allFinite());
  EXPECT_EQ(recording->t_ns[1] - recording->t_ns[0], 10'000'000);
  const auto time = recording->column("time");
  ASSERT_TRUE(time.has_value());
  EXPECT_EQ(recording->samples(0, *time), 0.0);
  EXPECT_NEAR(std::stod(recording->meta.at("origin.time")),
              1e-9 * static_cast<double>(recording->t_ns[0]), 1e-9)
      << "what `export --profile raven2` adds to it";
  const auto counts = recording->column("truth_counts.elbow");
  const auto truth = recording->column("truth.elbow");
  ASSERT_TRUE(counts && truth);
  EXPECT_NEAR(recording->samples(7, *truth), recording->samples(7, *counts) * 7.853981633974483e-5,
              1e-12);
}

TEST(Session, GivesTheSameRecordingForTheSameSeedAndAnotherForAnother) {
  const auto run = [](std::uint64_t seed, const std::string& name) {
    SessionOptions options;
    options.seed = seed;
    const fs::path path = fresh(name);
    EXPECT_TRUE(record_session(shipped_plant(), short_motion(5.0), path, options, kGoOn).ok());
    return std::move(record::load_recording(path, {})).value().samples;
  };
  const auto first = run(3, "seed_a.db");
  EXPECT_EQ(first, run(3, "seed_b.db"));
  EXPECT_NE(first, run(4, "seed_c.db"));
}

TEST(Session, HomesAgainWhenAskedAndSaysSo) {
  SessionOptions options;
  options.rehome_every_s = 4.0;
  const fs::path path = fresh("rehome.db");
  const auto summary = record_session(shipped_plant(), short_motion(10.0), path, options, kGoOn);
  ASSERT_TRUE(summary.ok()) << summary.error().message;
  EXPECT_EQ(summary->homings, 3);
  EXPECT_EQ(summary->rows, 1001);
  const auto recording = record::load_recording(path, {});
  ASSERT_TRUE(recording.ok());
  int homings = 0;
  for (const auto& event : recording->events) homings += event.kind == "homing";
  EXPECT_EQ(homings, 3);
  const auto offset = *recording->column("enc_offset.elbow");
  EXPECT_NE(recording->samples(0, offset), recording->samples(1000, offset));
}

TEST(Session, LeavesAValidRecordingWhenStopped) {
  const fs::path path = fresh("stopped.db");
  const auto summary = record_session(shipped_plant(), short_motion(60.0), path, {},
                                      [](double done) { return done < 0.1; });
  ASSERT_TRUE(summary.ok());
  EXPECT_TRUE(summary->interrupted);
  const auto recording = record::load_recording(path, {});
  ASSERT_TRUE(recording.ok()) << recording.error().message;
  EXPECT_EQ(recording->rows(), summary->rows);
  EXPECT_GT(summary->rows, 500);
  EXPECT_LT(summary->rows, 1000);
}

TEST(Session, RefusesAnExistingFileAndARateThatDoesNotDivide) {
  const fs::path path = fresh("exists.db");
  SessionOptions options;
  options.rate_hz = 333.0;
  const auto odd = record_session(shipped_plant(), short_motion(1.0), path, options, kGoOn);
  ASSERT_FALSE(odd.ok());
  EXPECT_EQ(odd.error().code, core::ErrorCode::kUsage);
  EXPECT_FALSE(fs::exists(path));
  ASSERT_TRUE(record_session(shipped_plant(), short_motion(1.0), path, {}, kGoOn).ok());
  EXPECT_FALSE(record_session(shipped_plant(), short_motion(1.0), path, {}, kGoOn).ok());
  options = {};
  options.overwrite = true;
  EXPECT_TRUE(record_session(shipped_plant(), short_motion(1.0), path, options, kGoOn).ok());
}

}  // namespace
}  // namespace ravencal::simulation
