// SPDX-License-Identifier: Apache-2.0
//
// Records a run: the robot's states with the external encoders' positions, which come as messages
// of their own, later and at other times. A state waits for the reading behind it and gets the
// value in between; across more than 50 ms, as in `ravencal merge`, there is no value. Knows no
// ROS; one thread owns it.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "record/raven_state_message.hpp"
#include "record/recording_writer.hpp"

namespace ravencal::robot {

struct RunRecorderOptions {
  std::filesystem::path path;
  std::string arm = "gold";
  double rate_hz = 100.0;  ///< the authors' recordings have 100 rows per second
  std::string trajectory;  ///< for the metadata
  bool overwrite = false;
};

class RunRecorder {
 public:
  static core::Result<RunRecorder> create(const RunRecorderOptions& options);

  /// One state; `moving` false: no row, so that nothing is learnt from an arm at its brakes. Times
  /// rise. Errors are those of writing.
  core::Status take(const record::RavenStateMessage& state, bool moving);
  /// One reading of the external encoders: rad, rad, m. A stamp before the last one's is dropped.
  void take_truth(std::int64_t stamp_ns, const std::array<double, 3>& joints_ji);
  /// At the time of a state, or with 0 at that of the last one taken.
  core::Status note(std::int64_t stamp_ns, const std::string& kind, const std::string& detail);
  /// Writes what waits and closes the file.
  core::Status finish();

  [[nodiscard]] std::int64_t rows() const { return rows_; }
  [[nodiscard]] std::int64_t rows_with_truth() const { return rows_with_truth_; }

 private:
  struct Reading {
    std::int64_t stamp_ns;
    std::array<double, 3> joints_ji;
  };
  RunRecorder(record::RecordingWriter writer, const RunRecorderOptions& options);
  core::Status write_ready(bool all);
  std::array<double, 3> truth_at(std::int64_t stamp_ns);

  record::RecordingWriter writer_;
  std::int64_t period_ns_;
  std::int64_t first_ns_ = 0;
  std::int64_t last_ns_ = 0;
  std::int64_t next_row_ns_ = INT64_MIN;
  std::int64_t rows_ = 0;
  std::int64_t rows_with_truth_ = 0;
  std::deque<record::RavenStateMessage> waiting_;
  std::deque<Reading> readings_;
  std::vector<double> row_;
};

}  // namespace ravencal::robot
