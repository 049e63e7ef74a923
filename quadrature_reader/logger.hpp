// SPDX-License-Identifier: Apache-2.0
//
// The live path: one reader thread per source, their rings, and the calling thread as writer.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "quadrature_reader/config.hpp"
#include "quadrature_reader/homing_watch.hpp"
#include "quadrature_reader/reader_thread.hpp"
#include "quadrature_reader/recorder.hpp"

namespace ravencal::quadrature_reader {

struct LoggerOptions {
  bool every_edge = false;
  bool home = false;  ///< find zeros from hard stops, see homing_watch.hpp
  /// Joint positions (rad or m) that the resting robot has now: sets zeros. See Config::encoders.
  std::map<std::string, double> pose_si;
  double duration_s = 0.0;    ///< 0: until stopped
  int realtime_priority = 0;  ///< of the reader threads; 0: ordinary scheduling
  /// Sees every row of the fixed-rate grid, on the writer thread; must not wait.
  Recorder::RowObserver on_row;
};

/// A picture of the run, for the terminal and for --json.
struct LoggerStatus {
  struct Joint {
    std::string name;
    std::string unit;
    std::int64_t count = 0;
    AxisSample sample;
    std::int64_t edges = 0;
    double edges_per_s = 0.0;
    std::int64_t losses = 0;
    bool delivering = false;
  };
  bool ended = false;  ///< the recording is closed, these are its totals
  double elapsed_s = 0.0;
  std::vector<Joint> joints;
  double fullest_ring = 0.0;  ///< fill level of the fullest ring since the last status, 0 to 1
  std::int64_t rows = 0;
  std::vector<std::string> to_be_homed;
  std::vector<std::string> without_zero;  ///< joints whose counts have no position so far
  std::string trouble;  ///< last device or disk error, or a right that is missing; else empty
};

class Logger {
 public:
  /// Opens the devices, then the recording. A device that is missing is an error of code kDevice
  /// and leaves no recording.
  static core::Result<std::unique_ptr<Logger>> create(const Config& config,
                                                      const std::filesystem::path& path,
                                                      const LoggerOptions& options);
  Logger(const Logger&) = delete;
  Logger& operator=(const Logger&) = delete;
  ~Logger();

  /// Records until `stop` says so, the duration is over, or all sources have ended. `on_status` is
  /// called ten times a second and once at the end. The result is that of closing the recording.
  core::Status run(const std::function<bool()>& stop,
                   const std::function<void(const LoggerStatus&)>& on_status);

  /// Looks for the hard stops once more. Any thread, also from a signal handler.
  void home_again() { home_again_.store(true); }

  /// A device failed, or data was lost: the program's exit code is kDevice.
  [[nodiscard]] bool failed() const;
  Recorder& recorder() { return recorder_; }

 private:
  Logger(const Config& config, Recorder recorder, const LoggerOptions& options);
  bool drain_rings();
  [[nodiscard]] bool sources_ended() const;
  LoggerStatus status(std::int64_t now_ns);
  [[nodiscard]] bool is_over(std::int64_t now_ns) const;
  void take_row(std::int64_t t_ns, std::span<const AxisSample> samples);
  void take_pose(std::int64_t t_ns, std::span<const AxisSample> samples);
  [[nodiscard]] std::string scheduling_trouble() const;
  void store_clock_offset();
  [[nodiscard]] bool is_replay() const;
  core::Status carry_clock_offsets();

  Config config_;
  LoggerOptions options_;
  Recorder recorder_;
  std::vector<std::unique_ptr<ReaderThread>> readers_;
  std::optional<HomingWatch> homing_;
  std::filesystem::path homing_path_;
  std::map<std::string, double> pose_si_;  // joints whose zero is still to be set from the pose
  std::atomic<bool> home_again_{false};
  bool memory_locked_ = false;
  std::vector<AxisSample> last_samples_;
  std::vector<std::int64_t> last_edges_;
  std::int64_t started_ns_ = 0;
  std::int64_t last_status_ns_ = 0;
  double fullest_ring_ = 0.0;
};

}  // namespace ravencal::quadrature_reader
