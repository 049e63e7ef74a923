// SPDX-License-Identifier: Apache-2.0
#include "quadrature_reader/sources/gpio_source.hpp"
#include "core/constants.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <thread>

namespace ravencal::quadrature_reader {
namespace {

// While edges come, they are fetched in batches: their time stamps are the kernel's, and waking up
// for each costs more than decoding it. libgpiod 1's queue of 16 edges per line, the smallest,
// fills in this time at 32 000 edges/s per line.
constexpr auto kBatchTime = std::chrono::microseconds(500);
constexpr std::int64_t kLevelCheckPeriodNs = 1'000'000'000;

}  // namespace

core::Error gpio_error(std::string_view what) {
  return {core::ErrorCode::kDevice, fmt::format("{}: {}", what, std::strerror(errno))};
}

core::Status GpioSource::open() {
  polls_.clear();
  sorter_.reset();
  next_level_check_ns_ = 0;
  moving_ = false;
  RAVENCAL_ASSIGN_OR_RETURN(const std::vector<int> queues, backend_->open(settings_));
  for (const int queue : queues) polls_.push_back({queue, POLLIN, 0});
  return {};
}

core::Status GpioSource::read(std::vector<Reading>& out, std::chrono::milliseconds timeout) {
  if (moving_) std::this_thread::sleep_for(kBatchTime);
  // Shorter than the reorder horizon, so that edges do not wait for the next edge.
  const auto wait_ms = std::min<std::int64_t>(
      timeout.count(), std::max<std::int64_t>(1, settings_.reorder_ns / core::kNsPerMs));
  if (poll(polls_.data(), polls_.size(), static_cast<int>(wait_ms)) < 0 && errno != EINTR) {
    return gpio_error(fmt::format("waiting for {} failed", settings_.device));
  }
  const std::int64_t now_ns = monotonic_now_ns();
  moving_ = false;
  core::Status status = collect(now_ns);
  // Readings from before the chip vanished are kept.
  sorter_.release(status.ok() ? now_ns : now_ns + settings_.reorder_ns, out);
  return status;
}

core::Status GpioSource::collect(std::int64_t now_ns) {
  for (std::size_t i = 0; i < polls_.size(); ++i) {
    if ((polls_[i].revents & POLLIN) != 0) {
      moving_ = true;
      RAVENCAL_RETURN_IF_ERROR(backend_->drain(i, sorter_));
    } else if ((polls_[i].revents & (POLLERR | POLLHUP | POLLNVAL)) != 0) {
      errno = ENODEV;
      return gpio_error(fmt::format("GPIO chip {} is gone", settings_.device));
    }
  }
  return confirm_levels(now_ns);
}

core::Status GpioSource::confirm_levels(std::int64_t now_ns) {
  const bool routine = now_ns >= next_level_check_ns_;
  if (routine) next_level_check_ns_ = now_ns + kLevelCheckPeriodNs;
  for (std::size_t i = 0; i < settings_.gpio.size(); ++i) {
    const std::uint8_t axis = settings_.gpio[i].axis;
    if (!routine && !sorter_.wants_levels(axis)) continue;
    const std::int64_t t_ns = monotonic_now_ns();
    RAVENCAL_ASSIGN_OR_RETURN(const std::int64_t levels, backend_->read_levels(i));
    sorter_.add_levels(axis, t_ns, levels);
  }
  return {};
}

}  // namespace ravencal::quadrature_reader
