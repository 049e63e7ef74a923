// SPDX-License-Identifier: Apache-2.0
//
// Records raven_2/raven_state messages as they arrive: the robot's half of a run. Knows no ROS; one
// thread owns it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "quadrature_reader/recording_sink.hpp"

namespace ravencal::quadrature_reader {

class StateRecorder {
 public:
  StateRecorder(std::filesystem::path path, std::string arm);

  /// One message; the first creates the recording. Errors: no such message, a stamp before the last
  /// one's, a file that cannot be created. Each leaves the recording as it was.
  core::Status take(std::span<const std::uint8_t> message);
  /// Call about once a second: goes on after a disk that was full.
  void maintain(std::int64_t now_ns);
  core::Status finish();

  [[nodiscard]] std::int64_t rows() const { return sink_ ? sink_->rows() : 0; }
  [[nodiscard]] bool lost_rows() const { return sink_ && sink_->lost_rows(); }

 private:
  core::Status begin(std::int64_t stamp_ns);
  void note_gap(std::int64_t stamp_ns);

  std::filesystem::path path_;
  std::string arm_;
  std::optional<RecordingSink> sink_;
  std::vector<double> row_;
  std::int64_t first_stamp_ns_ = 0;
  std::int64_t last_stamp_ns_ = 0;
  double usual_step_ns_ = 0.0;  // mean of the last steps
};

}  // namespace ravencal::quadrature_reader
