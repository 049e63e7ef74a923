// SPDX-License-Identifier: Apache-2.0
//
// GPIO lines as a source: waits for edges, brings them into order, confirms the levels. What
// differs between libgpiod 1 and 2 is behind GpioBackend, whose one implementation of this build
// (gpiod_v1.cpp or gpiod_v2.cpp) CMake chooses.
#pragma once

#include <poll.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string_view>
#include <vector>

#include "quadrature_reader/sources/edge_sorter.hpp"
#include "quadrature_reader/sources/source.hpp"

namespace ravencal::quadrature_reader {

/// The library's calls. Used by one thread.
class GpioBackend {
 public:
  GpioBackend() = default;
  virtual ~GpioBackend() = default;
  GpioBackend(const GpioBackend&) = delete;
  GpioBackend& operator=(const GpioBackend&) = delete;

  /// Requests both edges of every line, after giving back what was requested before. The result
  /// has one file descriptor per queue of edges; they stay the backend's.
  virtual core::Result<std::vector<int>> open(const SourceSettings& settings) = 0;
  /// Adds all edges that wait in `queue` (index into open()'s result).
  virtual core::Status drain(std::size_t queue, EdgeSorter& sorter) = 0;
  /// Present levels of settings.gpio[encoder]: A | B << 1 | Z << 2.
  virtual core::Result<std::int64_t> read_levels(std::size_t encoder) = 0;
};

class GpioSource final : public Source {
 public:
  GpioSource(const SourceSettings& settings, std::unique_ptr<GpioBackend> backend)
      : settings_(settings), backend_(std::move(backend)), sorter_(settings.reorder_ns) {}

  core::Status open() override;
  core::Status read(std::vector<Reading>& out, std::chrono::milliseconds timeout) override;

 private:
  core::Status collect(std::int64_t now_ns);
  core::Status confirm_levels(std::int64_t now_ns);

  SourceSettings settings_;
  std::unique_ptr<GpioBackend> backend_;
  EdgeSorter sorter_;
  std::vector<pollfd> polls_;
  std::int64_t next_level_check_ns_ = 0;
  bool moving_ = false;  // the last read had edges
};

std::unique_ptr<GpioBackend> make_gpio_backend();

/// What failed and errno in words.
core::Error gpio_error(std::string_view what);

}  // namespace ravencal::quadrature_reader
