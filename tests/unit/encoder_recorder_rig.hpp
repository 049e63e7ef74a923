// SPDX-License-Identifier: Apache-2.0
//
// A recorder of two joints in a folder of its own, and the motion that it is given.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <numbers>

#include "core/constants.hpp"
#include "quadrature_reader/encode.hpp"
#include "quadrature_reader/recorder.hpp"
#include "record/load.hpp"

namespace ravencal::quadrature_reader {

namespace fs = std::filesystem;
inline constexpr double kRadPerCount = 2.0 * std::numbers::pi / 80'000.0;

class RecorderTest : public testing::Test {
 protected:
  void SetUp() override {
    folder_ =
        fs::temp_directory_path() / ("encoder_recorder_" + std::to_string(::getpid()) +
                                     testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  static Config two_joints() {
    Config config;
    config.meta["robot"] = "raven2";
    for (const char* joint : {"shoulder", "elbow"}) {
      EncoderSettings encoder;
      encoder.axis.joint = joint;
      encoder.axis.si_per_count = kRadPerCount;
      encoder.axis.zero_counts = 0;
      config.encoders.push_back(encoder);
    }
    SourceSettings source;
    source.kind = SourceKind::kReplay;
    source.replay_joints = {{"shoulder", 0}, {"elbow", 1}};
    source.replay_speed = 0.0;
    config.sources.push_back(source);
    return config;
  }

  static double shoulder_at(std::int64_t t) {
    return 0.1 * std::sin(4e-9 * static_cast<double>(t));
  }
  static double elbow_at(std::int64_t t) {
    return 0.05 - 0.05 * std::cos(7e-9 * static_cast<double>(t));
  }

  /// Both joints moving for a second, merged in time order.
  static std::vector<Reading> motion() {
    std::vector<std::int64_t> t_ns;
    std::vector<double> shoulder;
    std::vector<double> elbow;
    for (std::int64_t t = 0; t <= 1000 * core::kNsPerMs; t += core::kNsPerMs / 5) {
      t_ns.push_back(t);
      shoulder.push_back(shoulder_at(t));
      elbow.push_back(elbow_at(t));
    }
    auto readings = encode_motion(t_ns, shoulder, {1.0 / kRadPerCount, 0, 0});
    const auto others = encode_motion(t_ns, elbow, {1.0 / kRadPerCount, 0, 1});
    readings.insert(readings.end(), others.begin(), others.end());
    std::stable_sort(readings.begin(), readings.end(),
                     [](const Reading& x, const Reading& y) { return x.t_ns < y.t_ns; });
    return readings;
  }

  static Reading alive(std::int64_t t_ns) {
    return {t_ns, 0, kEveryAxis, ReadingKind::kAlive, Line::kA, Fault::kNone};
  }

  record::Recording written(const fs::path& path) {
    auto loaded = record::load_recording(path, {});
    EXPECT_TRUE(loaded.ok()) << (loaded.ok() ? "" : loaded.error().message);
    return loaded.ok() ? std::move(loaded).value() : record::Recording{};
  }

  record::Recording record(const std::vector<Reading>& readings, const RecorderOptions& options,
                           const fs::path& path) {
    auto recorder = Recorder::create(two_joints(), path, options);
    EXPECT_TRUE(recorder.ok());
    for (const auto& reading : readings) {
      recorder->take(0, reading);
      if (reading.t_ns > stalled_from_ns_ && reading.t_ns < stalled_to_ns_) continue;
      recorder->take(0, alive(reading.t_ns));
      recorder->write_due();
    }
    EXPECT_TRUE(recorder->finish().ok());
    return written(path);
  }

  fs::path folder_;
  std::int64_t stalled_from_ns_ = 0;  // the reader thread does not run between these instants
  std::int64_t stalled_to_ns_ = 0;
};

}  // namespace ravencal::quadrature_reader
