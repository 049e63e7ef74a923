// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <string>
#include <string_view>

namespace ravencal::cli {

/// One line of progress with the time left, on standard error. Silent for the first 2 s; on a
/// terminal the line is redrawn, elsewhere a line is written every 10 s.
class Progress {
 public:
  explicit Progress(std::string_view task);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// `done` in [0, 1]; `detail` follows the percentage, e.g. "epoch 12/60, loss 0.031".
  void update(double done, std::string_view detail = {});

 private:
  using Clock = std::chrono::steady_clock;
  std::string task_;
  Clock::time_point start_;
  Clock::time_point last_;
  bool terminal_;
  bool drawn_ = false;
};

}  // namespace ravencal::cli
