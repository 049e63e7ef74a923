// SPDX-License-Identifier: Apache-2.0
//
// GPIO edges through libgpiod 1.x (Debian 12's 1.6; kernel uAPI v1). This interface queues 16
// edges per line, keeps the oldest, drops the rest and counts nothing. A read that returns a full
// queue is therefore taken for a loss.
#include <fmt/format.h>
#include <gpiod.h>
#include <poll.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <memory>
#include <system_error>
#include <thread>

#include "quadrature_reader/sources/edge_sorter.hpp"
#include "quadrature_reader/sources/make_gpio.hpp"

namespace ravencal::quadrature_reader {
namespace {

// include/linux/gpio.h, struct lineevent_state: DECLARE_KFIFO(events, struct gpioevent_data, 16).
constexpr unsigned kKernelQueue = 16;
// While edges come, they are fetched in batches: their time stamps are the kernel's, and waking up
// for each costs more than decoding it. 16 edges per line in this time are 32 000 edges/s.
constexpr auto kBatch = std::chrono::microseconds(500);
constexpr std::int64_t kLevelCheckPeriodNs = 1'000'000'000;

struct ChipCloser {
  void operator()(gpiod_chip* chip) const { gpiod_chip_close(chip); }
};

core::Error device_error(const std::string& what) {
  return {core::ErrorCode::kDevice, fmt::format("{}: {}", what, std::strerror(errno))};
}

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

class GpiodV1Source final : public Source {
 public:
  explicit GpiodV1Source(const SourceSettings& settings)
      : settings_(settings), sorter_(settings.reorder_ns) {}

  core::Status open() override;
  core::Status read(std::vector<Reading>& out, std::chrono::milliseconds timeout) override;

 private:
  core::Status request(const GpioEncoder& encoder);
  core::Result<gpiod_line*> find(const LineRef& ref);
  core::Status drain(const WatchedLine& watched, int fd);
  core::Status collect(std::int64_t now_ns);
  core::Status read_levels(std::int64_t now_ns);

  SourceSettings settings_;
  EdgeSorter sorter_;
  std::unique_ptr<gpiod_chip, ChipCloser> chip_;
  std::vector<WatchedLine> lines_;
  std::vector<pollfd> polls_;
  std::int64_t next_level_check_ns_ = 0;
  bool moving_ = false;  // the last read had edges
};

core::Status GpiodV1Source::open() {
  lines_.clear();
  polls_.clear();
  sorter_.reset();
  next_level_check_ns_ = 0;
  std::error_code error;
  const auto path = std::filesystem::canonical(settings_.device, error);
  chip_.reset(error ? nullptr : gpiod_chip_open(path.c_str()));
  if (!chip_) return device_error(fmt::format("cannot open GPIO chip {}", settings_.device));
  for (const auto& encoder : settings_.gpio) RAVENCAL_RETURN_IF_ERROR(request(encoder));
  for (const auto& watched : lines_) {
    polls_.push_back({gpiod_line_event_get_fd(watched.handle), POLLIN, 0});
  }
  return {};
}

core::Result<gpiod_line*> GpiodV1Source::find(const LineRef& ref) {
  gpiod_line* line = ref.offset ? gpiod_chip_get_line(chip_.get(), *ref.offset)
                                : gpiod_chip_find_line(chip_.get(), ref.name.c_str());
  if (line != nullptr) return line;
  const std::string name =
      ref.offset ? fmt::format("{}", *ref.offset) : fmt::format("'{}'", ref.name);
  return device_error(fmt::format("GPIO chip {} has no line {}", settings_.device, name));
}

core::Status GpiodV1Source::request(const GpioEncoder& encoder) {
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
      return device_error(
          fmt::format("cannot watch line {} of {}", gpiod_line_offset(handle), settings_.device));
    }
    lines_.push_back({handle, line, encoder.axis});
  }
  return {};
}

core::Status GpiodV1Source::drain(const WatchedLine& watched, int fd) {
  std::array<gpiod_line_event, kKernelQueue> events{};
  int count = 0;
  do {
    count = gpiod_line_event_read_fd_multiple(fd, events.data(), kKernelQueue);
    if (count < 0) return device_error(fmt::format("reading {} failed", settings_.device));
    for (int i = 0; i < count; ++i) {
      const auto& event = events[static_cast<std::size_t>(i)];
      const std::int64_t t_ns = std::int64_t{event.ts.tv_sec} * 1'000'000'000 + event.ts.tv_nsec;
      const bool rising = event.event_type == GPIOD_LINE_EVENT_RISING_EDGE;
      sorter_.add_edge(
          {t_ns, rising ? 1 : 0, watched.axis, ReadingKind::kEdge, watched.line, Fault::kNone});
      if (i + 1 == static_cast<int>(kKernelQueue)) sorter_.add_loss(watched.axis, t_ns);
    }
    pollfd more{fd, POLLIN, 0};
    if (poll(&more, 1, 0) <= 0 || (more.revents & POLLIN) == 0) break;
  } while (count > 0);
  return {};
}

core::Status GpiodV1Source::read(std::vector<Reading>& out, std::chrono::milliseconds timeout) {
  if (moving_) std::this_thread::sleep_for(kBatch);
  // Shorter than the reorder horizon, so that edges do not wait for the next edge.
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

core::Status GpiodV1Source::collect(std::int64_t now_ns) {
  for (std::size_t i = 0; i < polls_.size(); ++i) {
    if ((polls_[i].revents & POLLIN) != 0) {
      moving_ = true;
      RAVENCAL_RETURN_IF_ERROR(drain(lines_[i], polls_[i].fd));
    } else if ((polls_[i].revents & (POLLERR | POLLHUP | POLLNVAL)) != 0) {
      errno = ENODEV;
      return device_error(fmt::format("GPIO chip {} is gone", settings_.device));
    }
  }
  return read_levels(now_ns);
}

core::Status GpiodV1Source::read_levels(std::int64_t now_ns) {
  const bool routine = now_ns >= next_level_check_ns_;
  if (routine) next_level_check_ns_ = now_ns + kLevelCheckPeriodNs;
  for (std::size_t i = 0; i < lines_.size();) {
    const std::uint8_t axis = lines_[i].axis;
    const std::size_t first = i;
    while (i < lines_.size() && lines_[i].axis == axis) ++i;
    if (!routine && !sorter_.wants_levels(axis)) continue;
    const std::int64_t t_ns = monotonic_now_ns();
    std::int64_t levels = 0;
    for (std::size_t k = first; k < i; ++k) {
      const int value = gpiod_line_get_value(lines_[k].handle);
      if (value < 0)
        return device_error(fmt::format("reading the lines of {} failed", settings_.device));
      levels |= std::int64_t{value} << static_cast<unsigned>(lines_[k].line);
    }
    sorter_.add_levels(axis, t_ns, levels);
  }
  return {};
}

}  // namespace

std::unique_ptr<Source> make_gpio_source(const SourceSettings& settings) {
  return std::make_unique<GpiodV1Source>(settings);
}

std::string_view gpio_library() { return "libgpiod 1"; }

}  // namespace ravencal::quadrature_reader
