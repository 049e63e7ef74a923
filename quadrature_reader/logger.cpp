// SPDX-License-Identifier: Apache-2.0
#include "quadrature_reader/logger.hpp"

#include <fmt/format.h>
#include <sys/mman.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <thread>

#include "quadrature_reader/clock_offset.hpp"
#include "record/recording_reader.hpp"

namespace ravencal::quadrature_reader {
namespace fs = std::filesystem;
namespace {

constexpr auto kPumpPeriod = std::chrono::milliseconds(5);
constexpr std::int64_t kStatusPeriodNs = 100'000'000;
constexpr std::int64_t kMaintainPeriodNs = 1'000'000'000;
constexpr std::int64_t kClockPeriodNs = 10'000'000'000;
constexpr const char* kClockOffset = "clock_offset";

/// Beside the configuration, or where the service manager lets a service keep things.
fs::path homing_path_of(const fs::path& config) {
  const char* state = std::getenv("STATE_DIRECTORY");
  const fs::path folder = state != nullptr ? fs::path(state) : config.parent_path();
  return folder / fs::path(config.filename()).replace_extension(".homing.toml");
}

}  // namespace

core::Result<std::unique_ptr<Logger>> Logger::create(const Config& config,
                                                     const std::filesystem::path& path,
                                                     const LoggerOptions& options) {
  // Sources first: what cannot be opened must not leave an empty recording.
  std::vector<std::unique_ptr<Source>> sources;
  for (const auto& settings : config.sources) {
    RAVENCAL_ASSIGN_OR_RETURN(auto source, make_source(settings));
    RAVENCAL_RETURN_IF_ERROR(source->open());
    sources.push_back(std::move(source));
  }
  // Reading begins at once: a moving joint fills the kernel's queue while the file is made.
  std::vector<std::unique_ptr<ReaderThread>> readers;
  for (auto& source : sources) {
    readers.push_back(std::make_unique<ReaderThread>(std::move(source), config.ring_capacity,
                                                     options.realtime_priority));
    readers.back()->start();
  }
  RAVENCAL_ASSIGN_OR_RETURN(Recorder recorder,
                            Recorder::create(config, path, {options.every_edge}));
  std::unique_ptr<Logger> logger(new Logger(config, std::move(recorder), options));
  logger->homing_path_ = homing_path_of(config.path);
  std::map<std::string, HomingRecord> before;
  if (!logger->is_replay()) {
    RAVENCAL_ASSIGN_OR_RETURN(before, load_homing_records(logger->homing_path_));
    core::may_renew(logger->homing_path_);
  }
  logger->homing_.emplace(config, std::move(before));
  if (options.home) logger->homing_->start();
  logger->readers_ = std::move(readers);
  return logger;
}

Logger::Logger(const Config& config, Recorder recorder, const LoggerOptions& options)
    : config_(config),
      options_(options),
      recorder_(std::move(recorder)),
      pose_si_(options.pose_si),
      last_samples_(config.encoders.size()),
      last_edges_(config.encoders.size()) {}

Logger::~Logger() = default;

core::Status Logger::run(const std::function<bool()>& stop,
                         const std::function<void(const LoggerStatus&)>& on_status) {
  recorder_.set_row_observer(
      [this](std::int64_t t_ns, std::span<const AxisSample> samples) { take_row(t_ns, samples); });
  started_ns_ = last_status_ns_ = monotonic_now_ns();
  std::int64_t next_maintain_ns = started_ns_ + kMaintainPeriodNs;
  std::int64_t next_clock_ns = started_ns_;
  // A page fault in a reader thread would cost edges. Refused without the right to; then it may.
  memory_locked_ = mlockall(MCL_CURRENT) == 0;
  while (!stop()) {
    const std::int64_t now_ns = monotonic_now_ns();
    if (is_over(now_ns)) break;
    if (home_again_.exchange(false)) homing_->start();
    const bool ended = sources_ended();
    const bool busy = drain_rings();
    recorder_.write_due();
    if (now_ns - last_status_ns_ >= kStatusPeriodNs) on_status(status(now_ns));
    if (now_ns >= next_maintain_ns) {
      recorder_.sink().maintain(now_ns);
      next_maintain_ns = now_ns + kMaintainPeriodNs;
    }
    if (now_ns >= next_clock_ns && !is_replay()) {
      store_clock_offset();
      next_clock_ns = now_ns + kClockPeriodNs;
    }
    if (ended && !busy) break;
    if (!busy) std::this_thread::sleep_for(kPumpPeriod);
  }
  for (auto& reader : readers_) reader->stop();
  drain_rings();
  recorder_.write_due();
  if (is_replay()) {
    RAVENCAL_RETURN_IF_ERROR(carry_clock_offsets());
  } else {
    store_clock_offset();
  }
  core::Status closed = recorder_.finish();
  LoggerStatus last = status(monotonic_now_ns());
  last.ended = true;
  on_status(last);
  // What a replay homes is no homing of the robot as it stands now.
  if (closed.ok() && homing_->homed_any() && !is_replay())
    return save_homing_records(homing_path_, homing_->records());
  return closed;
}

bool Logger::is_over(std::int64_t now_ns) const {
  return options_.duration_s > 0.0 &&
         static_cast<double>(now_ns - started_ns_) * 1e-9 >= options_.duration_s;
}

void Logger::take_row(std::int64_t t_ns, std::span<const AxisSample> samples) {
  std::copy(samples.begin(), samples.end(), last_samples_.begin());
  homing_->take(t_ns, samples, recorder_);
  if (!pose_si_.empty()) take_pose(t_ns, samples);
  if (options_.on_row) options_.on_row(t_ns, samples);
}

void Logger::take_pose(std::int64_t t_ns, std::span<const AxisSample> samples) {
  for (std::size_t i = 0; i < samples.size(); ++i) {
    Axis& axis = recorder_.axes()[i];
    const auto pose = pose_si_.find(axis.settings().joint);
    if (pose == pose_si_.end() || !samples[i].counts_valid || samples[i].velocity_si != 0.0)
      continue;
    axis.set_zero(std::llround(samples[i].counts), pose->second);
    recorder_.add_event(
        t_ns, "aligned",
        fmt::format(R"({{"joint":"{}","counts":{},"position":{},"unit":"{}"}})", pose->first,
                    samples[i].counts, pose->second, axis.settings().unit));
    recorder_.sink().set_meta(pose->first + ".zero_counts", fmt::format("{}", samples[i].counts));
    pose_si_.erase(pose);
  }
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
    if (!axis.zero_counts()) status.without_zero.push_back(axis.settings().joint);
  }
  status.fullest_ring = fullest_ring_;
  status.rows = recorder_.sink().rows();
  status.trouble = scheduling_trouble();
  for (const auto& reader : readers_) {
    if (const std::string error = reader->last_error(); !error.empty()) status.trouble = error;
  }
  if (recorder_.sink().lost_rows()) status.trouble = recorder_.sink().last_error();
  status.to_be_homed = homing_->waiting();
  fullest_ring_ = 0.0;
  last_status_ns_ = now_ns;
  return status;
}

std::string Logger::scheduling_trouble() const {
  if (options_.realtime_priority == 0) return {};
  const bool refused = std::any_of(readers_.begin(), readers_.end(),
                                   [](const auto& reader) { return reader->scheduling_refused(); });
  if (!refused && memory_locked_) return {};
  return fmt::format("--realtime-priority {}: {} was refused; --check-setup gives the remedy",
                     options_.realtime_priority, refused ? "SCHED_FIFO" : "locking memory");
}

void Logger::store_clock_offset() {
  const ClockOffset offset = measure_realtime_offset();
  recorder_.sink().set_meta("clock.realtime_minus_monotonic_ns",
                            fmt::format("{}", offset.offset_ns));
  recorder_.add_event(
      offset.monotonic_ns, kClockOffset,
      fmt::format(R"({{"clock":"CLOCK_REALTIME","minus_monotonic_ns":{},"uncertainty_ns":{}}})",
                  offset.offset_ns, offset.uncertainty_ns));
}

bool Logger::is_replay() const {
  return std::all_of(config_.sources.begin(), config_.sources.end(),
                     [](const auto& source) { return source.kind == SourceKind::kReplay; });
}

core::Status Logger::carry_clock_offsets() {
  // A replay has the times of its recording, not those of this machine's clocks.
  for (const auto& source : config_.sources) {
    if (source.device.empty()) continue;
    RAVENCAL_ASSIGN_OR_RETURN(const auto events, record::read_events(source.device));
    for (const auto& event : events) {
      if (event.kind == kClockOffset) recorder_.add_event(event.t_ns, event.kind, event.detail);
    }
  }
  return {};
}

bool Logger::failed() const {
  if (recorder_.device_failed() || recorder_.lost_rows()) return true;
  return std::any_of(readers_.begin(), readers_.end(),
                     [](const auto& reader) { return !reader->last_error().empty(); });
}

}  // namespace ravencal::quadrature_reader
