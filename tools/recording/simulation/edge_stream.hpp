// SPDX-License-Identifier: Apache-2.0
//
// The external encoders of the digital twin as `ravencal-encoders --edges` would have recorded
// them: every edge of A and B, stamped by a clock of its own. The driver replays the file, so that
// the twin's labels come the way that a robot's do.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "physics/plant.hpp"
#include "quadrature_reader/decoder.hpp"
#include "quadrature_reader/encode.hpp"
#include "record/recording_writer.hpp"

namespace ravencal::simulation {

/// How the clock that stamps edges (CLOCK_MONOTONIC) stands to the robot's (CLOCK_REALTIME).
struct EncoderClock {
  std::int64_t offset_ns = 0;  ///< encoder's - robot's, at the robot's zero
  double drift_ppm = 0.0;      ///< how much faster the encoder's runs

  [[nodiscard]] std::int64_t at(std::int64_t robot_ns) const;
};

class EdgeStream {
 public:
  static core::Result<EdgeStream> create(const std::filesystem::path& path,
                                         const physics::Plant& plant, const EncoderClock& clock,
                                         bool overwrite);

  /// Shows the true joints, [3] rad rad m, at the robot's time `t_ns`, which rises; every control
  /// cycle. In between they move linearly.
  core::Status observe(std::int64_t t_ns, const Eigen::Vector3d& joints_ji);
  core::Status finish();

 private:
  EdgeStream(record::RecordingWriter writer, const physics::Plant& plant,
             const EncoderClock& clock);
  core::Status write_clock_offset(std::int64_t t_ns);

  record::RecordingWriter writer_;
  EncoderClock clock_;
  std::vector<quadrature_reader::MotionEncoder> encoders_;
  std::vector<quadrature_reader::QuadratureDecoder> counters_;
  std::vector<double> row_;  // counts and lines of every joint
  std::vector<quadrature_reader::Reading> readings_;
  std::int64_t next_clock_offset_ns_ = INT64_MIN;
  std::int64_t last_row_ns_ = INT64_MIN;
};

}  // namespace ravencal::simulation
