// SPDX-License-Identifier: Apache-2.0
//
// The calls of libgpiod 1.x (Debian 12's 1.6; kernel uAPI v1). This interface queues 16 edges per
// line, keeps the oldest, drops the rest and counts nothing. A read that returns a full queue is
// therefore taken for a loss.
#include <fmt/format.h>
#include <gpiod.h>
#include <poll.h>

#include <array>
#include <cerrno>
#include <filesystem>
#include <memory>
#include <system_error>

#include "quadrature_reader/sources/gpio_source.hpp"

namespace ravencal::quadrature_reader {
namespace {

// include/linux/gpio.h, struct lineevent_state: DECLARE_KFIFO(events, struct gpioevent_data, 16).
constexpr unsigned kKernelQueue = 16;

struct ChipCloser {
  void operator()(gpiod_chip* chip) const { gpiod_chip_close(chip); }
};

int flags_of(const GpioEncoder& encoder) {
  int flags = encoder.active_low ? GPIOD_LINE_REQUEST_FLAG_ACTIVE_LOW : 0;
  if (encoder.bias == Bias::kDisabled) flags |= GPIOD_LINE_REQUEST_FLAG_BIAS_DISABLE;
  if (encoder.bias == Bias::kPullUp) flags |= GPIOD_LINE_REQUEST_FLAG_BIAS_PULL_UP;
  if (encoder.bias == Bias::kPullDown) flags |= GPIOD_LINE_REQUEST_FLAG_BIAS_PULL_DOWN;
  return flags;
}

struct WatchedLine {
  gpiod_line* handle;
  Line line;
  std::uint8_t axis;
};

class GpiodV1 final : public GpioBackend {
 public:
  core::Result<std::vector<int>> open(const SourceSettings& settings) override;
  core::Status drain(std::size_t queue, EdgeSorter& sorter) override;
  core::Result<std::int64_t> read_levels(std::size_t encoder) override;

 private:
  core::Result<gpiod_line*> find(const LineRef& ref);
  core::Status request(const GpioEncoder& encoder);

  std::string device_;
  std::unique_ptr<gpiod_chip, ChipCloser> chip_;
  std::vector<WatchedLine> lines_;  // one queue each
  std::vector<std::uint8_t> axes_;  // of the encoders
};

core::Result<std::vector<int>> GpiodV1::open(const SourceSettings& settings) {
  device_ = settings.device;
  lines_.clear();
  axes_.clear();
  std::error_code error;
  const auto path = std::filesystem::canonical(device_, error);
  if (error) errno = error.value();
  chip_.reset(error ? nullptr : gpiod_chip_open(path.c_str()));
  if (!chip_) return gpio_error(fmt::format("cannot open GPIO chip {}", device_));
  for (const auto& encoder : settings.gpio) RAVENCAL_RETURN_IF_ERROR(request(encoder));
  std::vector<int> queues;
  for (const auto& watched : lines_) queues.push_back(gpiod_line_event_get_fd(watched.handle));
  return queues;
}

core::Result<gpiod_line*> GpiodV1::find(const LineRef& ref) {
  gpiod_line* line = ref.offset ? gpiod_chip_get_line(chip_.get(), *ref.offset)
                                : gpiod_chip_find_line(chip_.get(), ref.name.c_str());
  if (line != nullptr) return line;
  const std::string name =
      ref.offset ? fmt::format("{}", *ref.offset) : fmt::format("'{}'", ref.name);
  return gpio_error(fmt::format("GPIO chip {} has no line {}", device_, name));
}

core::Status GpiodV1::request(const GpioEncoder& encoder) {
  if (encoder.debounce_us > 0) {
    return core::Error{
        core::ErrorCode::kUsage,
        "debounce_us needs libgpiod 2; this build has libgpiod 1, whose kernel interface "
        "cannot debounce: use shortest_pulse_us"};
  }
  std::vector<std::pair<Line, LineRef>> wanted = {{Line::kA, encoder.a}, {Line::kB, encoder.b}};
  if (encoder.z) wanted.emplace_back(Line::kZ, *encoder.z);
  for (const auto& [line, ref] : wanted) {
    RAVENCAL_ASSIGN_OR_RETURN(gpiod_line * handle, find(ref));
    if (gpiod_line_request_both_edges_events_flags(handle, "ravencal-encoders",
                                                   flags_of(encoder)) != 0) {
      return gpio_error(
          fmt::format("cannot watch line {} of {}", gpiod_line_offset(handle), device_));
    }
    lines_.push_back({handle, line, encoder.axis});
  }
  axes_.push_back(encoder.axis);
  return {};
}

core::Status GpiodV1::drain(std::size_t queue, EdgeSorter& sorter) {
  const WatchedLine& watched = lines_[queue];
  const int fd = gpiod_line_event_get_fd(watched.handle);
  std::array<gpiod_line_event, kKernelQueue> events{};
  int count = 0;
  do {
    count = gpiod_line_event_read_fd_multiple(fd, events.data(), kKernelQueue);
    if (count < 0) return gpio_error(fmt::format("reading {} failed", device_));
    for (int i = 0; i < count; ++i) {
      const auto& event = events[static_cast<std::size_t>(i)];
      const std::int64_t t_ns = std::int64_t{event.ts.tv_sec} * 1'000'000'000 + event.ts.tv_nsec;
      const bool rising = event.event_type == GPIOD_LINE_EVENT_RISING_EDGE;
      sorter.add_edge(
          {t_ns, rising ? 1 : 0, watched.axis, ReadingKind::kEdge, watched.line, Fault::kNone});
      if (i + 1 == static_cast<int>(kKernelQueue)) sorter.add_loss(watched.axis, t_ns);
    }
    pollfd more{fd, POLLIN, 0};
    if (poll(&more, 1, 0) <= 0 || (more.revents & POLLIN) == 0) break;
  } while (count > 0);
  return {};
}

core::Result<std::int64_t> GpiodV1::read_levels(std::size_t encoder) {
  std::int64_t levels = 0;
  for (const auto& watched : lines_) {
    if (watched.axis != axes_[encoder]) continue;
    const int value = gpiod_line_get_value(watched.handle);
    if (value < 0) return gpio_error(fmt::format("reading the lines of {} failed", device_));
    levels |= std::int64_t{value} << static_cast<unsigned>(watched.line);
  }
  return levels;
}

}  // namespace

std::unique_ptr<GpioBackend> make_gpio_backend() { return std::make_unique<GpiodV1>(); }

}  // namespace ravencal::quadrature_reader
