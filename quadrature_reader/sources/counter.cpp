// SPDX-License-Identifier: Apache-2.0
#include "quadrature_reader/sources/counter.hpp"
#include "core/constants.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/counter.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <fstream>
#include <system_error>

namespace ravencal::quadrature_reader {
namespace fs = std::filesystem;
namespace {

// The kernel queues an event at the instant of its stamp; this much for the scheduler.
constexpr std::int64_t kEventDeliveryNs = 1'000'000;
// The kernel drops events silently when its queue is full, so the source reads the count itself now
// and then.
constexpr std::int64_t kCheckPeriodNs = 100'000'000;
constexpr const char* kQueueSize = "1024";
constexpr unsigned kDefaultBits = 32;

/// The first line of a sysfs attribute; nullopt if it cannot be read.
std::optional<std::string> attribute(const fs::path& path) {
  std::ifstream file(path);
  std::string line;
  if (!std::getline(file, line)) return std::nullopt;
  return line;
}

std::optional<std::uint64_t> number_of(std::string_view text) {
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || (end != text.data() + text.size() && *end != '\n'))
    return std::nullopt;
  return value;
}

}  // namespace

core::Error CounterSource::device_error(std::string_view what) const {
  return {core::ErrorCode::kDevice,
          fmt::format("counter {}: {}: {}", settings_.device, what, std::strerror(errno))};
}

core::Status CounterSource::open() {
  close_files();
  last_t_ns_ = monotonic_now_ns();
  next_ask_ns_ = last_t_ns_;
  std::error_code error;
  const fs::path node = fs::canonical(settings_.device, error);
  errno = error.value();
  device_ = error ? -1 : ::open(node.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  if (device_ < 0) return device_error("cannot be opened (udev/README.md)");
  const fs::path folder = sysfs_ / node.filename();
  // Only root may enlarge the kernel's queue; for others its 64 events have to do.
  std::ofstream(folder / "events_queue_size") << kQueueSize;
  for (const auto& encoder : settings_.counters) {
    RAVENCAL_RETURN_IF_ERROR(open_count(encoder, folder));
  }
  events_ = asked_ = false;
  if (settings_.counter_mode == CounterMode::kPoll) return {};
  RAVENCAL_ASSIGN_OR_RETURN(events_, enable_events());
  if (!events_ && settings_.counter_mode == CounterMode::kEvents) {
    return device_error("its driver reports no changes of state; use mode = \"poll\"");
  }
  return {};
}

core::Status CounterSource::open_count(const CounterEncoder& encoder, const fs::path& folder) {
  const fs::path path = folder / fmt::format("count{}", encoder.number);
  const auto function = attribute(path / "function");
  if (function && *function != "quadrature x4") {
    return core::Error{
        core::ErrorCode::kDevice,
        fmt::format("{} is '{}', which does not count every edge with its direction; run "
                    "'echo quadrature x4 > {}'",
                    (path / "function").string(), *function, (path / "function").string())};
  }
  unsigned bits = encoder.counter_bits;
  if (const auto ceiling = attribute(path / "ceiling"); ceiling && bits == 0) {
    const std::uint64_t range = number_of(*ceiling).value_or(0) + 1;  // 0: all 64 bits
    if (range != 0 && (!std::has_single_bit(range) || range < 4)) {
      return core::Error{
          core::ErrorCode::kDevice,
          fmt::format("{} is {}; only counters that wrap at a power of two can be "
                      "followed: run 'echo 4294967295 > {}'",
                      (path / "ceiling").string(), *ceiling, (path / "ceiling").string())};
    }
    bits = range == 0 ? 64U : static_cast<unsigned>(std::countr_zero(range));
  }
  Count count{encoder,
              CountFollower(bits > 0 ? bits : kDefaultBits, false, encoder.max_counts_per_s)};
  count.file = ::open((path / "count").c_str(), O_RDONLY | O_CLOEXEC);
  if (count.file < 0) return device_error(fmt::format("has no count{}", encoder.number));
  counts_.push_back(count);
  return {};
}

core::Result<bool> CounterSource::enable_events() {
  for (const auto& count : counts_) {
    counter_watch watch{};
    watch.component.type = COUNTER_COMPONENT_COUNT;
    watch.component.scope = COUNTER_SCOPE_COUNT;
    watch.component.parent = static_cast<std::uint8_t>(count.settings.number);
    watch.event = COUNTER_EVENT_CHANGE_OF_STATE;
    watch.channel = static_cast<std::uint8_t>(count.settings.channel);
    if (::ioctl(device_, COUNTER_ADD_WATCH_IOCTL, &watch) == 0) continue;
    if (errno == ENODEV) return device_error("is gone");
    return false;  // EINVAL, EOPNOTSUPP, ENOTTY: it can only be asked
  }
  return ::ioctl(device_, COUNTER_ENABLE_EVENTS_IOCTL) == 0;
}

core::Status CounterSource::read(std::vector<Reading>& out, std::chrono::milliseconds timeout) {
  const std::int64_t wait_ns = std::clamp<std::int64_t>(next_ask_ns_ - monotonic_now_ns(), 0,
                                                        std::chrono::nanoseconds(timeout).count());
  const timespec wait_time{wait_ns / core::kNsPerS, wait_ns % core::kNsPerS};
  pollfd wait{device_, POLLIN, 0};
  if (::ppoll(&wait, events_ ? 1 : 0, &wait_time, nullptr) < 0 && errno != EINTR)
    return device_error("waiting failed");
  const std::int64_t now_ns = monotonic_now_ns();
  if (events_) RAVENCAL_RETURN_IF_ERROR(read_events(out));
  if (now_ns >= next_ask_ns_) {
    const std::int64_t period_ns = events_ ? kCheckPeriodNs : settings_.poll_period_ns;
    next_ask_ns_ = std::max(next_ask_ns_ + period_ns, now_ns);
    RAVENCAL_RETURN_IF_ERROR(events_ && asked_ ? look_for_lost_events(out) : ask_all(out));
    asked_ = true;
  }
  last_t_ns_ = std::max(last_t_ns_, events_ ? now_ns - kEventDeliveryNs : now_ns);
  out.push_back({last_t_ns_, 0, kEveryAxis, ReadingKind::kAlive, Line::kA, Fault::kNone});
  return {};
}

core::Status CounterSource::read_events(std::vector<Reading>& out) {
  std::array<counter_event, 64> events{};
  for (;;) {
    const ssize_t size = ::read(device_, events.data(), sizeof(events));
    if (size < 0 && (errno == EAGAIN || errno == EINTR)) return {};
    if (size < 0) return device_error("reading failed");
    const std::size_t read = static_cast<std::size_t>(size) / sizeof(counter_event);
    for (std::size_t i = 0; i < read; ++i) {
      const counter_event& event = events[i];
      for (auto& count : counts_) {
        if (event.status != 0 || event.watch.component.parent != count.settings.number) continue;
        last_t_ns_ = std::max(last_t_ns_, static_cast<std::int64_t>(event.timestamp));
        take(count, last_t_ns_, event.value, out);
      }
    }
    if (read < events.size()) return {};
  }
}

core::Status CounterSource::ask_all(std::vector<Reading>& out) {
  for (auto& count : counts_) {
    const std::int64_t before_ns = monotonic_now_ns();
    RAVENCAL_ASSIGN_OR_RETURN(const std::uint64_t raw, ask(count));
    last_t_ns_ = before_ns + (monotonic_now_ns() - before_ns) / 2;
    take(count, last_t_ns_, raw, out);
  }
  return {};
}

core::Status CounterSource::look_for_lost_events(std::vector<Reading>& out) {
  for (auto& count : counts_) {
    const std::uint64_t last_event = count.last_raw;
    RAVENCAL_ASSIGN_OR_RETURN(const std::uint64_t raw, ask(count));
    RAVENCAL_RETURN_IF_ERROR(read_events(out));
    // A first difference may be an event on its way; a second one without an event in between is a
    // dropped event.
    const bool differs = raw != last_event && count.last_raw == last_event;
    if (differs && count.differed) {
      last_t_ns_ = std::max(last_t_ns_, monotonic_now_ns());
      out.push_back({last_t_ns_, 0, count.settings.axis, ReadingKind::kLost, Line::kA,
                     Fault::kQueueOverflow});
      take(count, last_t_ns_, raw, out);
    } else {
      count.differed = differs;
    }
  }
  return {};
}

core::Result<std::uint64_t> CounterSource::ask(const Count& count) const {
  std::array<char, 32> text{};
  const ssize_t size = ::pread(count.file, text.data(), text.size(), 0);
  if (size <= 0) return device_error("its count cannot be read");
  const auto value = number_of({text.data(), static_cast<std::size_t>(size)});
  if (value) return *value;
  errno = EINVAL;
  return device_error("its count is no number");
}

void CounterSource::take(Count& count, std::int64_t t_ns, std::uint64_t raw,
                         std::vector<Reading>& out) {
  count.last_raw = raw;
  count.differed = false;
  const auto push = [&](ReadingKind kind, std::int64_t value, Fault fault) {
    out.push_back({t_ns, value, count.settings.axis, kind, Line::kA, fault});
  };
  const auto step = count.follower.take(t_ns, raw);
  if (step.outcome == CountFollower::Outcome::kImplausible) {
    return push(ReadingKind::kLost, 1, Fault::kImplausibleCount);
  }
  if (step.outcome == CountFollower::Outcome::kRestarted) {
    push(ReadingKind::kRestarted, step.moved, Fault::kImplausibleCount);
  }
  push(ReadingKind::kCount, step.count, Fault::kNone);
}

void CounterSource::close_files() {
  for (const auto& count : counts_) {
    if (count.file >= 0) ::close(count.file);
  }
  counts_.clear();
  if (device_ >= 0) ::close(device_);
  device_ = -1;
}

}  // namespace ravencal::quadrature_reader
