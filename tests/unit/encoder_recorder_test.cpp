// SPDX-License-Identifier: Apache-2.0
//
// Readings to recordings: rows, gaps, events, replay, and a disk that fails.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <thread>

#include "quadrature_reader/encode.hpp"
#include "quadrature_reader/homing_watch.hpp"
#include "quadrature_reader/logger.hpp"
#include "quadrature_reader/recorder.hpp"
#include "quadrature_reader/sources/replay.hpp"
#include "record/load.hpp"
#include "record/recording_writer.hpp"
#include "unit/encoder_recorder_rig.hpp"

namespace ravencal::quadrature_reader {
namespace {

TEST_F(RecorderTest, WritesTheTrueJointOnAFixedGrid) {
  const auto recording = record(motion(), {}, folder_ / "r.db");
  ASSERT_GE(recording.rows(), 990);
  const auto shoulder = recording.column(record::Role::kJointTruth, "shoulder");
  const auto elbow = recording.column(record::Role::kJointTruth, "elbow");
  ASSERT_TRUE(shoulder && elbow);
  for (Eigen::Index row = 0; row < recording.rows(); ++row) {
    const std::int64_t t = recording.t_ns[static_cast<std::size_t>(row)];
    ASSERT_EQ(t % core::kNsPerMs, 0);
    EXPECT_NEAR(recording.samples(row, *shoulder), shoulder_at(t), 0.51 * kRadPerCount);
    EXPECT_NEAR(recording.samples(row, *elbow), elbow_at(t), 0.51 * kRadPerCount);
  }
  EXPECT_EQ(recording.meta.at("robot"), "raven2");
  EXPECT_EQ(recording.meta.at("clock"), "CLOCK_MONOTONIC");
}

TEST_F(RecorderTest, ReplayOfEveryEdgeGivesTheSameRecordingAsTheLiveRun) {
  const auto live = record(motion(), {}, folder_ / "live.db");
  const auto edges = record(motion(), {true}, folder_ / "edges.db");
  const auto readings = readings_of(edges, {{"shoulder", 0}, {"elbow", 1}});
  ASSERT_TRUE(readings.ok());
  const auto again = record(*readings, {}, folder_ / "again.db");
  ASSERT_EQ(again.rows(), live.rows());
  EXPECT_EQ(again.t_ns, live.t_ns);
  EXPECT_EQ(again.samples, live.samples);
}

TEST_F(RecorderTest, LeavesANullAndAnEventWhereEdgesWereLost) {
  auto readings = motion();
  // The reader is stopped for 100 ms, and the shoulder's kernel queue overflows meanwhile.
  stalled_from_ns_ = 100 * core::kNsPerMs;
  stalled_to_ns_ = 200 * core::kNsPerMs;
  std::erase_if(readings, [](const Reading& r) {
    return r.axis == 0 && r.t_ns > 100 * core::kNsPerMs && r.t_ns < 200 * core::kNsPerMs;
  });
  // As the libgpiod 1 source says it: after the last edge that the full queue had kept.
  const auto at = std::find_if(readings.begin(), readings.end(),
                               [](const Reading& r) { return r.t_ns > 100 * core::kNsPerMs; });
  readings.insert(
      at, {100 * core::kNsPerMs, 0, 0, ReadingKind::kLost, Line::kA, Fault::kQueueOverflow});
  const auto recording = record(readings, {}, folder_ / "r.db");
  const auto shoulder = *recording.column("shoulder.counts");
  const auto truth = *recording.column("shoulder.joint_truth");
  const auto elbow = *recording.column("elbow.joint_truth");
  for (Eigen::Index row = 0; row < recording.rows(); ++row) {
    const std::int64_t t = recording.t_ns[static_cast<std::size_t>(row)];
    if (t > 101 * core::kNsPerMs && t < 199 * core::kNsPerMs) {
      EXPECT_TRUE(std::isnan(recording.samples(row, shoulder))) << t;
    }
    if (t > 203 * core::kNsPerMs) {
      EXPECT_FALSE(std::isnan(recording.samples(row, shoulder))) << t;
      EXPECT_TRUE(std::isnan(recording.samples(row, truth))) << "nobody counted what was lost";
    }
    EXPECT_FALSE(std::isnan(recording.samples(row, elbow))) << t;
  }
  ASSERT_EQ(recording.events.size(), 1U);
  EXPECT_EQ(recording.events[0].kind, "edges_lost");
  EXPECT_NE(recording.events[0].detail.find("\"joint\":\"shoulder\""), std::string::npos);
}

TEST_F(RecorderTest, ReplayOfEveryEdgeKnowsOfTheLossesOfTheLiveRun) {
  auto readings = motion();
  readings.erase(readings.begin() + 1000);
  const auto edges = record(readings, {true}, folder_ / "edges.db");
  const auto replayed = readings_of(edges, {{"shoulder", 0}, {"elbow", 1}});
  ASSERT_TRUE(replayed.ok());
  const auto again = record(*replayed, {}, folder_ / "again.db");
  EXPECT_TRUE(std::any_of(again.events.begin(), again.events.end(),
                          [](const record::Event& event) { return event.kind == "edges_lost"; }));
}

TEST_F(RecorderTest, TellsAnOutageOfEverythingWhileItLasts) {
  auto recorder = Recorder::create(two_joints(), folder_ / "r.db", {});
  ASSERT_TRUE(recorder.ok());
  recorder->take(
      0, {core::kNsPerMs, 19, kEveryAxis, ReadingKind::kFault, Line::kA, Fault::kDeviceGone});
  recorder->write_due();
  // The writer commits by itself, when the machine lets it.
  while (written(folder_ / "r.db").events.size() < 2)
    std::this_thread::sleep_for(std::chrono::milliseconds(25));
  EXPECT_EQ(written(folder_ / "r.db").events.size(), 2U);
  EXPECT_TRUE(recorder->device_failed());
  EXPECT_TRUE(recorder->finish().ok());
}

TEST_F(RecorderTest, GoesOnInANewFileWhenTheFolderDisappears) {
  const fs::path path = folder_ / "gone" / "r.db";
  fs::create_directories(path.parent_path());
  auto recorder = Recorder::create(two_joints(), path, {});
  ASSERT_TRUE(recorder.ok());
  const auto readings = motion();
  bool removed = false;
  for (const auto& reading : readings) {
    recorder->take(0, reading);
    recorder->take(0, alive(reading.t_ns));
    recorder->write_due();
    if (!removed && reading.t_ns > 500 * core::kNsPerMs) {
      removed = true;
      fs::remove_all(path.parent_path());
      recorder->sink().maintain(reading.t_ns);  // finds it gone
    }
    if (removed && reading.t_ns > 600 * core::kNsPerMs) recorder->sink().maintain(reading.t_ns);
  }
  EXPECT_TRUE(recorder->sink().lost_rows());
  EXPECT_TRUE(recorder->finish().ok());
  const auto rest = written(path.parent_path() / "r.2.db");
  EXPECT_GT(rest.rows(), 350);
  ASSERT_FALSE(rest.events.empty());
  EXPECT_EQ(rest.events.front().kind, "gap");
  EXPECT_EQ(rest.meta.at("continues"), "r.db");
}

TEST_F(RecorderTest, HomesFromTheHardStopAndNeverJumpsAtASecondHoming) {
  // Down onto the stop at 0.1745 rad/s, 0.5 s there, up; then the same again, 12 counts further.
  std::vector<std::int64_t> t_ns;
  std::vector<double> shoulder;
  double position = 0.0;
  std::int64_t now = 0;
  const auto move_to = [&](double target, double speed) {
    while (position != target) {
      const double step = speed * 1e-3;
      position = std::abs(target - position) <= step
                     ? target
                     : position + std::copysign(step, target - position);
      t_ns.push_back(now += core::kNsPerMs);
      shoulder.push_back(position);
    }
  };
  const auto rest = [&](int ms) {
    for (int i = 0; i < ms; ++i) {
      t_ns.push_back(now += core::kNsPerMs);
      shoulder.push_back(position);
    }
  };
  constexpr double kStop = -0.3;
  rest(500);
  for (const double stop : {kStop, kStop - 12.0 * kRadPerCount}) {
    move_to(stop, 0.1745);
    rest(500);
    move_to(0.2, 0.2);
    rest(500);
  }
  Config config = two_joints();
  for (auto& encoder : config.encoders) encoder.axis.zero_counts.reset();
  config.encoders[0].stop = StopSettings{false, 0.25};
  auto recorder = Recorder::create(config, folder_ / "r.db", {});
  ASSERT_TRUE(recorder.ok());
  HomingWatch homing(config, {{"shoulder", {100.0, 1.0, std::nullopt}}});
  homing.start();
  recorder->set_row_observer([&](std::int64_t t, std::span<const AxisSample> samples) {
    homing.take(t, samples, *recorder);
  });
  bool again = false;
  for (const auto& reading : encode_motion(t_ns, shoulder, {1.0 / kRadPerCount, 0, 0})) {
    if (!again && homing.homed_any() && reading.t_ns > t_ns.back() / 2) {
      homing.start();
      again = true;
    }
    recorder->take(0, reading);
    recorder->take(0, alive(reading.t_ns));
    recorder->write_due();
  }
  recorder->take(0, alive(now));
  recorder->write_due();
  ASSERT_TRUE(recorder->finish().ok());
  const auto recording = written(folder_ / "r.db");
  const auto truth = *recording.column("shoulder.joint_truth");
  ASSERT_EQ(recording.events.size(), 2U);
  EXPECT_EQ(recording.events[0].kind, "homing");
  EXPECT_NE(recording.events[0].detail.find("\"moved_counts\":null"), std::string::npos)
      << "GPIO counts of another run say nothing";
  EXPECT_EQ(recording.events[1].kind, "rehoming");
  EXPECT_NE(recording.events[1].detail.find("\"moved_counts\":-12.0"), std::string::npos)
      << recording.events[1].detail;
  for (Eigen::Index row = 1; row < recording.rows(); ++row) {
    const std::int64_t t = recording.t_ns[static_cast<std::size_t>(row)];
    if (t <= recording.events[0].t_ns) {
      ASSERT_TRUE(std::isnan(recording.samples(row, truth))) << "no zero yet";
      continue;
    }
    const auto at = static_cast<std::size_t>(t / core::kNsPerMs) - 1;
    if (at >= shoulder.size()) break;
    ASSERT_NEAR(recording.samples(row, truth), shoulder[at] - kStop + 0.25, 1.1 * kRadPerCount)
        << t;
  }
}

TEST_F(RecorderTest, LoggerRecordsAReplayFromEndToEnd) {
  (void)record(motion(), {true}, folder_ / "edges.db");
  auto edges = written(folder_ / "edges.db");
  edges.events.push_back({7 * core::kNsPerMs, "clock_offset", R"({"minus_monotonic_ns":5})"});
  ASSERT_TRUE(record::write_recording(edges, folder_ / "edges.db", true).ok());
  Config config = two_joints();
  replay_instead(config, folder_ / "edges.db", 0.0);
  auto logger = Logger::create(config, folder_ / "out.db", {});
  ASSERT_TRUE(logger.ok()) << logger.error().message;
  EXPECT_TRUE((*logger)->run([] { return false; }, [](const LoggerStatus&) {}).ok());
  EXPECT_FALSE((*logger)->failed());
  const auto live = record(motion(), {}, folder_ / "live.db");
  const auto replayed = written(folder_ / "out.db");
  EXPECT_EQ(replayed.samples, live.samples);
  ASSERT_EQ(replayed.events.size(), 1U);
  EXPECT_EQ(replayed.events[0].t_ns, 7 * core::kNsPerMs)
      << "the clocks of the recording, not of this machine";
  EXPECT_EQ(replayed.events[0].kind, "clock_offset");
}

TEST_F(RecorderTest, TakesTheZeroFromTheRestingRobotsPose) {
  // At rest for 100 ms, then away.
  std::vector<std::int64_t> t_ns = {0, 100 * core::kNsPerMs, 1100 * core::kNsPerMs};
  std::vector<double> x = {0.3, 0.3, 0.4};
  auto readings = encode_motion(t_ns, x, {1.0 / kRadPerCount, 0, 0});
  (void)record(readings, {true}, folder_ / "edges.db");
  Config config = two_joints();
  for (auto& encoder : config.encoders) encoder.axis.zero_counts.reset();
  config.encoders[0].axis.sign = -1;
  replay_instead(config, folder_ / "edges.db", 0.0);
  LoggerOptions options;
  options.pose_si = {{"shoulder", 0.5}};
  auto logger = Logger::create(config, folder_ / "out.db", options);
  ASSERT_TRUE(logger.ok()) << logger.error().message;
  ASSERT_TRUE((*logger)->run([] { return false; }, [](const LoggerStatus&) {}).ok());
  const auto recording = written(folder_ / "out.db");
  ASSERT_EQ(recording.events.size(), 1U);
  EXPECT_EQ(recording.events[0].kind, "aligned");
  EXPECT_NE(recording.events[0].detail.find("\"position\":0.5"), std::string::npos);
  EXPECT_TRUE(recording.meta.contains("shoulder.zero_counts"));
  const auto truth = *recording.column("shoulder.joint_truth");
  const auto last = recording.rows() - 1;
  const double moved =
      0.1 * static_cast<double>(recording.t_ns.back() - 100 * core::kNsPerMs) * 1e-9;
  EXPECT_NEAR(recording.samples(last, truth), 0.5 - moved, 1.1 * kRadPerCount);
  EXPECT_TRUE(std::isnan(recording.samples(last, *recording.column("elbow.joint_truth"))))
      << "nobody said where the elbow was";
}

TEST_F(RecorderTest, TellsByTheIndexHowFarTheStopMovedSinceTheLastProgram) {
  // Counting begins anew with every program; the index pulse, every 4000 counts, does not move.
  std::vector<std::int64_t> t_ns;
  std::vector<double> x;
  const auto go = [&](double to, int ms) {
    const double from = x.empty() ? to : x.back();
    for (int i = 1; i <= ms; ++i) {
      t_ns.push_back(static_cast<std::int64_t>(t_ns.size()) * core::kNsPerMs);
      x.push_back(from + (to - from) * i / ms);
    }
  };
  go(100.0, 1);  // counts on the disc; the index is at 0
  go(100.0, 500);
  go(-3000.0, 1400);
  go(-3000.0, 500);
  go(500.0, 1000);
  go(500.0, 500);
  Config config = two_joints();
  config.encoders[0].axis.zero_counts.reset();
  config.encoders[0].axis.index = IndexSettings{4000, 2};
  config.encoders[0].stop = StopSettings{false, 0.25};
  auto recorder = Recorder::create(config, folder_ / "r.db", {});
  ASSERT_TRUE(recorder.ok());
  // Then the stop was 3040 counts below the index.
  HomingWatch homing(config, {{"shoulder", {960.0, 1.0, 4000}}});
  homing.start();
  recorder->set_row_observer([&](std::int64_t t, std::span<const AxisSample> samples) {
    homing.take(t, samples, *recorder);
  });
  for (const auto& reading : encode_motion(t_ns, x, {1.0, 4000, 0})) {
    recorder->take(0, reading);
    recorder->take(0, alive(reading.t_ns));
    recorder->write_due();
  }
  recorder->take(0, alive(t_ns.back()));
  recorder->write_due();
  ASSERT_TRUE(recorder->finish().ok());
  const auto recording = written(folder_ / "r.db");
  const auto found =
      std::find_if(recording.events.begin(), recording.events.end(),
                   [](const record::Event& event) { return event.kind == "homing"; });
  ASSERT_NE(found, recording.events.end());
  for (const char* key : {"\"stop_counts\"", "\"spread_counts\"", "\"confidence\""})
    EXPECT_NE(found->detail.find(key), std::string::npos) << found->detail;
  const auto at = found->detail.find("\"moved_counts\":");
  ASSERT_NE(at, std::string::npos);
  EXPECT_NEAR(std::strtod(found->detail.c_str() + at + 15, nullptr), 40.0, 2.0) << found->detail;
  // What is kept for the next time reads back as it was written.
  ASSERT_TRUE(save_homing_records(folder_ / "h.toml", homing.records()).ok());
  const auto again = load_homing_records(folder_ / "h.toml");
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_NEAR(again->at("shoulder").stop_counts, homing.records().at("shoulder").stop_counts, 0.1);
  EXPECT_EQ(again->at("shoulder").index_counts, homing.records().at("shoulder").index_counts);
}

TEST_F(RecorderTest, ARunThatLostItsFolderGoesOnAndIsNotCalledComplete) {
  (void)record(motion(), {true}, folder_ / "edges.db");
  Config config = two_joints();
  replay_instead(config, folder_ / "edges.db", 0.5);  // two seconds: the folder is looked at each
  const fs::path path = folder_ / "gone" / "r.db";
  fs::create_directories(path.parent_path());
  auto logger = Logger::create(config, path, {});
  ASSERT_TRUE(logger.ok()) << logger.error().message;
  bool removed = false;
  const auto status = (*logger)->run([] { return false; },
                                     [&](const LoggerStatus& now) {
                                       if (removed || now.elapsed_s < 0.3) return;
                                       removed = true;
                                       fs::remove_all(path.parent_path());
                                     });
  EXPECT_TRUE((*logger)->failed()) << "exit code 4";
  EXPECT_TRUE((*logger)->recorder().lost_rows());
  EXPECT_EQ((*logger)->recorder().axes()[0].losses(), 0) << "counting went on";
}

}  // namespace
}  // namespace ravencal::quadrature_reader
