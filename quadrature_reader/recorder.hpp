// SPDX-License-Identifier: Apache-2.0
//
// Turns readings of all encoders into a recording: rows at a fixed rate or one per edge, and
// events. Knows no device, no thread and no clock: time is that of the readings, so a replay gives
// the same recording as the live run. One thread owns it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "quadrature_reader/axis.hpp"
#include "quadrature_reader/config.hpp"
#include "quadrature_reader/recording_sink.hpp"

namespace ravencal::quadrature_reader {

struct RecorderOptions {
  bool every_edge = false;  ///< one row per edge instead of rows at Config::rate_hz
};

class Recorder {
 public:
  /// Sees every row of the fixed-rate grid: instant and one sample per encoder.
  using RowObserver = std::function<void(std::int64_t t_ns, std::span<const AxisSample>)>;

  static core::Result<Recorder> create(const Config& config, const std::filesystem::path& path,
                                       const RecorderOptions& options);

  /// A reading from source `source` (index into Config::sources), in that source's order.
  void take(std::size_t source, const Reading& reading);
  /// Writes everything that has become final.
  void write_due();
  /// The sources have ended: writes what is left up to the last reading, and closes the file.
  core::Status finish();

  void set_row_observer(RowObserver observer) { observer_ = std::move(observer); }
  /// Records a happening that is not an axis's own.
  void add_event(std::int64_t t_ns, const std::string& kind, const std::string& detail);

  std::vector<Axis>& axes() { return axes_; }
  RecordingSink& sink() { return sink_; }
  /// Instant up to which all live sources have delivered; INT64_MIN before the first.
  [[nodiscard]] std::int64_t watermark_ns() const;
  /// A device failed or data was lost at any time: exit code 4.
  [[nodiscard]] bool device_failed() const { return device_failed_; }
  /// Rows were lost to the disk at any time: exit code 4 too.
  [[nodiscard]] bool lost_rows() const { return sink_.lost_rows(); }

 private:
  struct SourceState {
    std::int64_t alive_ns = INT64_MIN;
    bool down = false;
  };
  struct EdgeRow {
    std::int64_t t_ns;
    std::size_t axis;
    double count;  // both NaN: a loss
    double levels;
  };
  struct OpenEvent {
    AxisEvent event;
    std::int64_t times = 0;
    std::size_t axis = 0;
  };

  Recorder(const Config& config, RecordingSink sink, const RecorderOptions& options);
  void give_to_axis(std::size_t number, const Reading& reading);
  void note_source_state(std::size_t source, const Reading& reading);
  void merge_events(std::size_t number);
  void write_events(std::int64_t until_ns);
  void walk_grid(std::int64_t until_ns);
  void write_edges(std::int64_t until_ns);
  void put_row(std::int64_t t_ns, std::span<const AxisSample> samples);

  RecorderOptions options_;
  std::int64_t period_ns_;
  std::int64_t latency_ns_ = 0;
  std::vector<Axis> axes_;
  std::vector<std::size_t> source_of_axis_;
  std::vector<SourceState> sources_;
  RecordingSink sink_;
  RowObserver observer_;
  std::vector<EdgeRow> edges_;
  std::vector<double> held_edges_;  // the newest row: counts and levels of every axis
  std::vector<OpenEvent> open_events_;
  std::vector<double> row_;
  std::vector<AxisSample> samples_;
  std::int64_t first_reading_ns_ = INT64_MAX;
  std::int64_t next_row_ns_ = INT64_MIN;
  std::int64_t last_written_ns_ = INT64_MIN;
  bool device_failed_ = false;
};

}  // namespace ravencal::quadrature_reader
