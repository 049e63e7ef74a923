// SPDX-License-Identifier: Apache-2.0
//
// Quadrature hardware behind the kernel's counter subsystem (/dev/counterN, linux/counter.h;
// Linux 5.16 and later). Where the driver reports changes of state, each comes with the count and
// the kernel's time stamp (CLOCK_MONOTONIC); most drivers do not, and are asked at a fixed rate
// through sysfs instead.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "quadrature_reader/sources/count_follower.hpp"
#include "quadrature_reader/sources/source.hpp"

namespace ravencal::quadrature_reader {

class CounterSource : public Source {
 public:
  /// `sysfs` is where the kernel shows its counters; another folder for tests.
  explicit CounterSource(const SourceSettings& settings,
                         std::filesystem::path sysfs = "/sys/bus/counter/devices")
      : settings_(settings), sysfs_(std::move(sysfs)) {}
  CounterSource(const CounterSource&) = delete;
  CounterSource& operator=(const CounterSource&) = delete;
  ~CounterSource() override { close_files(); }

  core::Status open() override;
  core::Status read(std::vector<Reading>& out, std::chrono::milliseconds timeout) override;

 protected:
  /// Asks the driver to report changes of all counts; false if it does not. Another one for tests.
  virtual core::Result<bool> enable_events();

 private:
  struct Count {
    CounterEncoder settings;
    CountFollower follower;
    int file = -1;  // sysfs countN/count
    std::uint64_t last_raw = 0;
    bool differed = false;  // its count was not the last event's when looked at last
  };

  core::Status open_count(const CounterEncoder& encoder, const std::filesystem::path& folder);
  core::Status read_events(std::vector<Reading>& out);
  core::Status ask_all(std::vector<Reading>& out);
  core::Status look_for_lost_events(std::vector<Reading>& out);
  core::Result<std::uint64_t> ask(const Count& count) const;
  static void take(Count& count, std::int64_t t_ns, std::uint64_t raw, std::vector<Reading>& out);
  void close_files();
  [[nodiscard]] core::Error device_error(std::string_view what) const;

  SourceSettings settings_;
  std::filesystem::path sysfs_;
  std::vector<Count> counts_;
  int device_ = -1;
  bool events_ = false;  // the driver reports changes by itself
  bool asked_ = false;   // since open()
  std::int64_t next_ask_ns_ = 0;
  std::int64_t last_t_ns_ = 0;
};

}  // namespace ravencal::quadrature_reader
