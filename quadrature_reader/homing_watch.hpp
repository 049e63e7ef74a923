// SPDX-License-Identifier: Apache-2.0
//
// Watches the joints while the robot homes, sets each one's zero from its hard stop, and compares
// with the homing before. The first zero of a joint gives it positions; a later homing in the same
// run is recorded as an event and moves nothing. One thread.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "quadrature_reader/config.hpp"
#include "quadrature_reader/homing.hpp"
#include "quadrature_reader/recorder.hpp"

namespace ravencal::quadrature_reader {

/// What is kept of a joint's homing for the next one.
struct HomingRecord {
  double stop_counts = 0.0;
  double spread_counts = 0.0;
  std::optional<std::int64_t> index_counts;  ///< where the index pulse was, if there is one
};

/// Homing records by joint, from and to a small .toml beside the configuration. A missing file is
/// no error: there was no homing before.
core::Result<std::map<std::string, HomingRecord>> load_homing_records(
    const std::filesystem::path& path);
core::Status save_homing_records(const std::filesystem::path& path,
                                 const std::map<std::string, HomingRecord>& records);

class HomingWatch {
 public:
  HomingWatch(const Config& config, std::map<std::string, HomingRecord> before);

  /// Starts to look for every joint's stop, from now on.
  void start();
  /// One row of the recorder's grid; sets zeros and records events in `recorder`.
  void take(std::int64_t t_ns, std::span<const AxisSample> samples, Recorder& recorder);

  /// Joints that are still to be homed.
  [[nodiscard]] std::vector<std::string> waiting() const;
  /// All records, the newest where there are two.
  [[nodiscard]] const std::map<std::string, HomingRecord>& records() const { return records_; }
  [[nodiscard]] bool homed_any() const { return homed_any_; }

 private:
  struct Joint {
    std::string name;
    std::optional<StopSettings> stop;
    bool counts_by_itself = false;  // its counts outlive this program
    bool watching = false;
    std::vector<std::int64_t> t_ns;
    std::vector<double> counts;
    std::size_t examined = 0;
  };

  void examine(Joint& joint, Axis& axis, std::int64_t t_ns, Recorder& recorder);
  void settle(Joint& joint, Axis& axis, const HardStop& stop, std::int64_t t_ns,
              Recorder& recorder);
  [[nodiscard]] std::optional<double> moved_since_before(const Joint& joint, const Axis& axis,
                                                         const HardStop& stop) const;

  std::vector<Joint> joints_;
  std::map<std::string, HomingRecord> records_;
  std::map<std::string, bool> homed_in_this_run_;
  std::int64_t next_sample_ns_ = INT64_MIN;
  bool homed_any_ = false;
};

}  // namespace ravencal::quadrature_reader
