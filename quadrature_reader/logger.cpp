// SPDX-License-Identifier: Apache-2.0
#include "quadrature_reader/logger.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <thread>

#include "quadrature_reader/clock_offset.hpp"

namespace ravencal::quadrature_reader {
namespace {

constexpr auto kPumpPeriod = std::chrono::milliseconds(5);
constexpr std::int64_t kStatusPeriodNs = 100'000'000;
constexpr std::int64_t kMaintainPeriodNs = 1'000'000'000;
constexpr std::int64_t kClockPeriodNs = 10'000'000'000;

}  // namespace

core::Result<std::unique_ptr<Logger>> Logger::create(const Config& config,
                                                     const std::filesystem::path& path,
                                                     const LoggerOptions& options) {
  // Sources first: a configuration that this build cannot serve must not leave an empty file.
  std::vector<std::unique_ptr<Source>> sources;
  for (const auto& settings : config.sources) {
    RAVENCAL_ASSIGN_OR_RETURN(auto source, make_source(settings));
    sources.push_back(std::move(source));
  }
  RAVENCAL_ASSIGN_OR_RETURN(Recorder recorder,
                            Recorder::create(config, path, {options.every_edge}));
  std::unique_ptr<Logger> logger(new Logger(config, std::move(recorder), options));
  for (auto& source : sources) {
    logger->readers_.push_back(std::make_unique<ReaderThread>(
        std::move(source), config.ring_capacity, options.realtime_priority));
  }
  return logger;
}

Logger::Logger(const Config& config, Recorder recorder, const LoggerOptions& options)
    : config_(config),
      options_(options),
      recorder_(std::move(recorder)),
      last_samples_(config.encoders.size()),
      last_edges_(config.encoders.size()) {}

Logger::~Logger() = default;

core::Status Logger::run(const std::function<bool()>& stop,
                         const std::function<void(const LoggerStatus&)>& on_status) {
  recorder_.set_row_observer([this](std::int64_t, std::span<const AxisSample> samples) {
    std::copy(samples.begin(), samples.end(), last_samples_.begin());
  });
  started_ns_ = last_status_ns_ = monotonic_now_ns();
  std::int64_t next_maintain_ns = started_ns_ + kMaintainPeriodNs;
  std::int64_t next_clock_ns = started_ns_;
  for (auto& reader : readers_) reader->start();
  while (!stop()) {
    const std::int64_t now_ns = monotonic_now_ns();
    if (options_.duration_s > 0.0 &&
        static_cast<double>(now_ns - started_ns_) * 1e-9 >= options_.duration_s)
      break;
    const bool ended = sources_ended();
    const bool busy = drain_rings();
    recorder_.write_due();
    if (now_ns - last_status_ns_ >= kStatusPeriodNs) on_status(status(now_ns));
    if (now_ns >= next_maintain_ns) {
      recorder_.sink().maintain(now_ns);
      next_maintain_ns = now_ns + kMaintainPeriodNs;
    }
    if (now_ns >= next_clock_ns) {
      store_clock_offset();
      next_clock_ns = now_ns + kClockPeriodNs;
    }
    if (ended && !busy) break;
    if (!busy) std::this_thread::sleep_for(kPumpPeriod);
  }
  for (auto& reader : readers_) reader->stop();
  drain_rings();
  recorder_.write_due();
  store_clock_offset();
  return recorder_.finish();
}

bool Logger::drain_rings() {
  bool any = false;
  for (std::size_t i = 0; i < readers_.size(); ++i) {
    auto& ring = readers_[i]->ring();
    const std::size_t waiting = ring.size();
    fullest_ring_ = std::max(fullest_ring_,
                             static_cast<double>(waiting) / static_cast<double>(ring.capacity()));
    // No more than was there at the start, so that no source starves the others.
    Reading reading;
    for (std::size_t n = 0; n < waiting && ring.try_pop(reading); ++n) {
      recorder_.take(i, reading);
      any = any || reading.kind != ReadingKind::kAlive;
    }
  }
  return any;
}

bool Logger::sources_ended() const {
  return std::all_of(readers_.begin(), readers_.end(),
                     [](const auto& reader) { return reader->finished(); });
}

LoggerStatus Logger::status(std::int64_t now_ns) {
  LoggerStatus status;
  const double since_s = static_cast<double>(now_ns - last_status_ns_) * 1e-9;
  status.elapsed_s = static_cast<double>(now_ns - started_ns_) * 1e-9;
  for (std::size_t i = 0; i < recorder_.axes().size(); ++i) {
    const Axis& axis = recorder_.axes()[i];
    status.joints.push_back({axis.settings().joint, axis.settings().unit, axis.count(),
                             last_samples_[i], axis.edges(),
                             static_cast<double>(axis.edges() - last_edges_[i]) / since_s,
                             axis.losses(), axis.delivering()});
    last_edges_[i] = axis.edges();
  }
  status.fullest_ring = fullest_ring_;
  status.rows = recorder_.sink().rows();
  for (const auto& reader : readers_) {
    if (const std::string error = reader->last_error(); !error.empty()) status.trouble = error;
  }
  if (recorder_.sink().lost_rows()) status.trouble = recorder_.sink().last_error();
  fullest_ring_ = 0.0;
  last_status_ns_ = now_ns;
  return status;
}

void Logger::store_clock_offset() {
  const ClockOffset offset = measure_realtime_offset();
  recorder_.sink().set_meta("clock.realtime_minus_monotonic_ns",
                            fmt::format("{}", offset.offset_ns));
  recorder_.add_event(
      offset.monotonic_ns, "clock_offset",
      fmt::format(R"({{"clock":"CLOCK_REALTIME","minus_monotonic_ns":{},"uncertainty_ns":{}}})",
                  offset.offset_ns, offset.uncertainty_ns));
}

bool Logger::failed() const {
  if (recorder_.device_failed()) return true;
  return std::any_of(readers_.begin(), readers_.end(),
                     [](const auto& reader) { return !reader->last_error().empty(); });
}

}  // namespace ravencal::quadrature_reader
