// SPDX-License-Identifier: Apache-2.0
//
// GPIO edges through libgpiod 2.x (kernel uAPI v2): one request and one queue of up to 1024 edges
// per encoder, which keeps the newest; sequence numbers tell exactly how many were dropped.
#include <fmt/format.h>
#include <gpiod.h>
#include <poll.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <memory>
#include <thread>

#include "quadrature_reader/sources/edge_sorter.hpp"
#include "quadrature_reader/sources/make_gpio.hpp"

namespace ravencal::quadrature_reader {
namespace {

// The kernel's limit: GPIO_V2_LINES_MAX (64) * 16, drivers/gpio/gpiolib-cdev.c.
constexpr std::size_t kLargestQueue = 1024;
// While edges come, they are fetched in batches: their time stamps are the kernel's, and waking up
// for each costs more than decoding it. The queue holds far more than this.
constexpr auto kBatch = std::chrono::microseconds(500);
constexpr std::int64_t kLevelCheckPeriodNs = 1'000'000'000;

template <auto free_function>
struct Free {
  template <typename T>
  void operator()(T* object) const {
    free_function(object);
  }
};
template <typename T, auto free_function>
using Handle = std::unique_ptr<T, Free<free_function>>;
using Chip = Handle<gpiod_chip, gpiod_chip_close>;
using LineSettings = Handle<gpiod_line_settings, gpiod_line_settings_free>;
using LineConfig = Handle<gpiod_line_config, gpiod_line_config_free>;
using RequestConfig = Handle<gpiod_request_config, gpiod_request_config_free>;
using Request = Handle<gpiod_line_request, gpiod_line_request_release>;
using EventBuffer = Handle<gpiod_edge_event_buffer, gpiod_edge_event_buffer_free>;

core::Error device_error(const std::string& what) {
  return {core::ErrorCode::kDevice, fmt::format("{}: {}", what, std::strerror(errno))};
}

gpiod_line_bias bias_of(Bias bias) {
  switch (bias) {
    case Bias::kAsIs:
      return GPIOD_LINE_BIAS_AS_IS;
    case Bias::kDisabled:
      return GPIOD_LINE_BIAS_DISABLED;
    case Bias::kPullUp:
      return GPIOD_LINE_BIAS_PULL_UP;
    case Bias::kPullDown:
      return GPIOD_LINE_BIAS_PULL_DOWN;
  }
  return GPIOD_LINE_BIAS_AS_IS;
}

/// The lines of one encoder.
struct WatchedEncoder {
  std::uint8_t axis = 0;
  std::vector<unsigned> offsets;  // A, B and, if there is one, Z
  Request request;
};

class GpiodV2Source final : public Source {
 public:
  explicit GpiodV2Source(const SourceSettings& settings)
      : settings_(settings),
        sorter_(settings.reorder_ns),
        events_(gpiod_edge_event_buffer_new(kLargestQueue)) {}

  core::Status open() override;
  core::Status read(std::vector<Reading>& out, std::chrono::milliseconds timeout) override;

 private:
  core::Result<unsigned> offset_of(const LineRef& ref);
  core::Status request(const GpioEncoder& encoder);
  core::Status drain(const WatchedEncoder& encoder);
  core::Status collect(std::int64_t now_ns);
  core::Status read_levels(std::int64_t now_ns);

  SourceSettings settings_;
  EdgeSorter sorter_;
  EventBuffer events_;
  Chip chip_;
  std::vector<WatchedEncoder> encoders_;
  std::vector<pollfd> polls_;
  std::int64_t next_level_check_ns_ = 0;
  bool moving_ = false;  // the last read had edges
};

core::Status GpiodV2Source::open() {
  polls_.clear();
  encoders_.clear();
  sorter_.reset();
  next_level_check_ns_ = 0;
  chip_.reset(gpiod_chip_open(settings_.device.c_str()));
  if (!chip_) return device_error(fmt::format("cannot open GPIO chip {}", settings_.device));
  for (const auto& encoder : settings_.gpio) RAVENCAL_RETURN_IF_ERROR(request(encoder));
  for (const auto& encoder : encoders_) {
    polls_.push_back({gpiod_line_request_get_fd(encoder.request.get()), POLLIN, 0});
  }
  return {};
}

core::Result<unsigned> GpiodV2Source::offset_of(const LineRef& ref) {
  if (ref.offset) return *ref.offset;
  const int offset = gpiod_chip_get_line_offset_from_name(chip_.get(), ref.name.c_str());
  if (offset >= 0) return static_cast<unsigned>(offset);
  return device_error(fmt::format("GPIO chip {} has no line '{}'", settings_.device, ref.name));
}

core::Status GpiodV2Source::request(const GpioEncoder& encoder) {
  WatchedEncoder watched;
  watched.axis = encoder.axis;
  std::vector<LineRef> wanted = {encoder.a, encoder.b};
  if (encoder.z) wanted.push_back(*encoder.z);
  for (const auto& ref : wanted) {
    RAVENCAL_ASSIGN_OR_RETURN(const unsigned offset, offset_of(ref));
    watched.offsets.push_back(offset);
  }
  const LineSettings line(gpiod_line_settings_new());
  gpiod_line_settings_set_direction(line.get(), GPIOD_LINE_DIRECTION_INPUT);
  gpiod_line_settings_set_edge_detection(line.get(), GPIOD_LINE_EDGE_BOTH);
  gpiod_line_settings_set_event_clock(line.get(), GPIOD_LINE_CLOCK_MONOTONIC);
  gpiod_line_settings_set_bias(line.get(), bias_of(encoder.bias));
  gpiod_line_settings_set_active_low(line.get(), encoder.active_low);
  gpiod_line_settings_set_debounce_period_us(line.get(), encoder.debounce_us);
  const LineConfig lines(gpiod_line_config_new());
  const RequestConfig config(gpiod_request_config_new());
  gpiod_request_config_set_consumer(config.get(), "ravencal-encoders");
  gpiod_request_config_set_event_buffer_size(
      config.get(), settings_.event_buffer_size > 0 ? settings_.event_buffer_size : kLargestQueue);
  if (gpiod_line_config_add_line_settings(lines.get(), watched.offsets.data(),
                                          watched.offsets.size(), line.get()) == 0) {
    watched.request.reset(gpiod_chip_request_lines(chip_.get(), config.get(), lines.get()));
  }
  if (!watched.request) {
    return device_error(fmt::format("cannot watch lines {} of {}", fmt::join(watched.offsets, ", "),
                                    settings_.device));
  }
  encoders_.push_back(std::move(watched));
  return {};
}

core::Status GpiodV2Source::drain(const WatchedEncoder& encoder) {
  const int count =
      gpiod_line_request_read_edge_events(encoder.request.get(), events_.get(), kLargestQueue);
  if (count < 0) return device_error(fmt::format("reading {} failed", settings_.device));
  for (int i = 0; i < count; ++i) {
    gpiod_edge_event* event =
        gpiod_edge_event_buffer_get_event(events_.get(), static_cast<unsigned long>(i));
    const unsigned offset = gpiod_edge_event_get_line_offset(event);
    const auto line = std::find(encoder.offsets.begin(), encoder.offsets.end(), offset);
    const bool rising = gpiod_edge_event_get_event_type(event) == GPIOD_EDGE_EVENT_RISING_EDGE;
    const Reading edge{static_cast<std::int64_t>(gpiod_edge_event_get_timestamp_ns(event)),
                       rising ? 1 : 0,
                       encoder.axis,
                       ReadingKind::kEdge,
                       static_cast<Line>(line - encoder.offsets.begin()),
                       Fault::kNone};
    sorter_.add_edge(edge, static_cast<std::uint32_t>(gpiod_edge_event_get_global_seqno(event)));
  }
  return {};
}

core::Status GpiodV2Source::read(std::vector<Reading>& out, std::chrono::milliseconds timeout) {
  if (moving_) std::this_thread::sleep_for(kBatch);
  // No longer than the reorder horizon, so that edges do not wait for the next edge.
  const auto wait = std::min<std::int64_t>(
      timeout.count(), std::max<std::int64_t>(1, settings_.reorder_ns / 1'000'000));
  if (poll(polls_.data(), polls_.size(), static_cast<int>(wait)) < 0 && errno != EINTR) {
    return device_error(fmt::format("waiting for {} failed", settings_.device));
  }
  const std::int64_t now_ns = monotonic_now_ns();
  moving_ = false;
  core::Status status = collect(now_ns);
  // A chip that vanishes takes nothing with it that has been read.
  sorter_.release(status.ok() ? now_ns : now_ns + settings_.reorder_ns, out);
  return status;
}

core::Status GpiodV2Source::collect(std::int64_t now_ns) {
  for (std::size_t i = 0; i < polls_.size(); ++i) {
    if ((polls_[i].revents & POLLIN) != 0) {
      moving_ = true;
      RAVENCAL_RETURN_IF_ERROR(drain(encoders_[i]));
    } else if ((polls_[i].revents & (POLLERR | POLLHUP | POLLNVAL)) != 0) {
      errno = ENODEV;
      return device_error(fmt::format("GPIO chip {} is gone", settings_.device));
    }
  }
  return read_levels(now_ns);
}

core::Status GpiodV2Source::read_levels(std::int64_t now_ns) {
  const bool routine = now_ns >= next_level_check_ns_;
  if (routine) next_level_check_ns_ = now_ns + kLevelCheckPeriodNs;
  for (const auto& encoder : encoders_) {
    if (!routine && !sorter_.wants_levels(encoder.axis)) continue;
    const std::int64_t t_ns = monotonic_now_ns();
    std::array<gpiod_line_value, 3> values{};
    if (gpiod_line_request_get_values(encoder.request.get(), values.data()) != 0) {
      return device_error(fmt::format("reading the lines of {} failed", settings_.device));
    }
    std::int64_t levels = 0;
    for (std::size_t line = 0; line < encoder.offsets.size(); ++line) {
      levels |= std::int64_t{values[line] == GPIOD_LINE_VALUE_ACTIVE} << line;
    }
    sorter_.add_levels(encoder.axis, t_ns, levels);
  }
  return {};
}

}  // namespace

std::unique_ptr<Source> make_gpio_source(const SourceSettings& settings) {
  return std::make_unique<GpiodV2Source>(settings);
}

std::string_view gpio_library() { return "libgpiod 2"; }

}  // namespace ravencal::quadrature_reader
