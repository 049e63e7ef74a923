// SPDX-License-Identifier: Apache-2.0
//
// The calls of libgpiod 2.x (kernel uAPI v2): one request and one queue of up to 1024 edges
// per encoder, which keeps the newest; sequence numbers tell exactly how many were dropped.
#include <fmt/format.h>
#include <gpiod.h>

#include <algorithm>
#include <array>
#include <memory>

#include "quadrature_reader/sources/gpio_source.hpp"

namespace ravencal::quadrature_reader {
namespace {

// The kernel's limit: GPIO_V2_LINES_MAX (64) * 16, drivers/gpio/gpiolib-cdev.c.
constexpr std::size_t kLargestQueue = 1024;
// Edges per read. The library clears its whole buffer before each, so a large one costs more than
// the edges (1024: 435 us per edge in the emulated guest at 1000 edges/s, 64: 97 us).
constexpr std::size_t kReadAtOnce = 64;

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

void add_edge(const WatchedEncoder& encoder, gpiod_edge_event* event, EdgeSorter& sorter) {
  const unsigned offset = gpiod_edge_event_get_line_offset(event);
  const auto line = std::find(encoder.offsets.begin(), encoder.offsets.end(), offset);
  const bool rising = gpiod_edge_event_get_event_type(event) == GPIOD_EDGE_EVENT_RISING_EDGE;
  const Reading edge{static_cast<std::int64_t>(gpiod_edge_event_get_timestamp_ns(event)),
                     rising ? 1 : 0,
                     encoder.axis,
                     ReadingKind::kEdge,
                     static_cast<Line>(line - encoder.offsets.begin()),
                     Fault::kNone};
  sorter.add_edge(edge, static_cast<std::uint32_t>(gpiod_edge_event_get_global_seqno(event)));
}

class GpiodV2 final : public GpioBackend {
 public:
  core::Result<std::vector<int>> open(const SourceSettings& settings) override;
  core::Status drain(std::size_t queue, EdgeSorter& sorter) override;
  core::Result<std::int64_t> read_levels(std::size_t encoder) override;

 private:
  core::Result<unsigned> offset_of(const LineRef& ref);
  core::Status request(const GpioEncoder& encoder, std::size_t queue_size);

  std::string device_;
  EventBuffer events_{gpiod_edge_event_buffer_new(kReadAtOnce)};
  Chip chip_;
  std::vector<WatchedEncoder> encoders_;  // one queue each
};

core::Result<std::vector<int>> GpiodV2::open(const SourceSettings& settings) {
  device_ = settings.device;
  encoders_.clear();
  chip_.reset(gpiod_chip_open(device_.c_str()));
  if (!chip_) return gpio_error(fmt::format("cannot open GPIO chip {}", device_));
  const std::size_t queue_size =
      settings.event_buffer_size > 0 ? settings.event_buffer_size : kLargestQueue;
  for (const auto& encoder : settings.gpio) RAVENCAL_RETURN_IF_ERROR(request(encoder, queue_size));
  std::vector<int> queues;
  for (const auto& encoder : encoders_) {
    queues.push_back(gpiod_line_request_get_fd(encoder.request.get()));
  }
  return queues;
}

core::Result<unsigned> GpiodV2::offset_of(const LineRef& ref) {
  if (ref.offset) return *ref.offset;
  const int offset = gpiod_chip_get_line_offset_from_name(chip_.get(), ref.name.c_str());
  if (offset >= 0) return static_cast<unsigned>(offset);
  return gpio_error(fmt::format("GPIO chip {} has no line '{}'", device_, ref.name));
}

core::Status GpiodV2::request(const GpioEncoder& encoder, std::size_t queue_size) {
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
  gpiod_request_config_set_event_buffer_size(config.get(), queue_size);
  if (gpiod_line_config_add_line_settings(lines.get(), watched.offsets.data(),
                                          watched.offsets.size(), line.get()) == 0) {
    watched.request.reset(gpiod_chip_request_lines(chip_.get(), config.get(), lines.get()));
  }
  if (!watched.request) {
    return gpio_error(
        fmt::format("cannot watch lines {} of {}", fmt::join(watched.offsets, ", "), device_));
  }
  encoders_.push_back(std::move(watched));
  return {};
}

core::Status GpiodV2::drain(std::size_t queue, EdgeSorter& sorter) {
  const WatchedEncoder& encoder = encoders_[queue];
  gpiod_line_request* request = encoder.request.get();
  int count = 0;
  do {
    count = gpiod_line_request_read_edge_events(request, events_.get(), kReadAtOnce);
    if (count < 0) return gpio_error(fmt::format("reading {} failed", device_));
    for (int i = 0; i < count; ++i) {
      add_edge(encoder,
               gpiod_edge_event_buffer_get_event(events_.get(), static_cast<unsigned long>(i)),
               sorter);
    }
    // A read without a waiting edge would block.
  } while (count == static_cast<int>(kReadAtOnce) &&
           gpiod_line_request_wait_edge_events(request, 0) > 0);
  return {};
}

core::Result<std::int64_t> GpiodV2::read_levels(std::size_t encoder) {
  const WatchedEncoder& watched = encoders_[encoder];
  std::array<gpiod_line_value, 3> values{};
  if (gpiod_line_request_get_values(watched.request.get(), values.data()) != 0) {
    return gpio_error(fmt::format("reading the lines of {} failed", device_));
  }
  std::int64_t levels = 0;
  for (std::size_t line = 0; line < watched.offsets.size(); ++line) {
    levels |= std::int64_t{values[line] == GPIOD_LINE_VALUE_ACTIVE} << line;
  }
  return levels;
}

}  // namespace

std::unique_ptr<GpioBackend> make_gpio_backend() { return std::make_unique<GpiodV2>(); }

}  // namespace ravencal::quadrature_reader
