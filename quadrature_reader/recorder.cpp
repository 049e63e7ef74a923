// SPDX-License-Identifier: Apache-2.0
#include "quadrature_reader/recorder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace ravencal::quadrature_reader {
namespace {

constexpr double kNull = std::numeric_limits<double>::quiet_NaN();
constexpr std::int64_t kEventMergeNs = 100'000'000;  // equal events closer than this are one row
constexpr std::int64_t kStallNs =
    2'000'000'000;  // a source that lags more does not hold up the rest
constexpr std::size_t kChannelsPerAxisEdges = 2;

std::vector<record::Channel> channels_of(const Config& config, bool every_edge) {
  std::vector<record::Channel> channels;
  for (const auto& encoder : config.encoders) {
    const std::string& joint = encoder.axis.joint;
    const std::string& unit = encoder.axis.unit;
    if (every_edge) {
      channels.push_back({joint + ".counts", "counts", record::Role::kTruthReading, joint});
      channels.push_back({joint + ".lines", "1", record::Role::kStatus, joint});
      continue;
    }
    channels.push_back({joint + ".joint_truth", unit, record::Role::kJointTruth, joint});
    channels.push_back(
        {joint + ".truth_velocity", unit + "_per_s", record::Role::kTruthReading, joint});
    channels.push_back({joint + ".counts", "counts", record::Role::kTruthReading, joint});
    channels.push_back({joint + ".losses", "1", record::Role::kStatus, joint});
  }
  return channels;
}

std::map<std::string, std::string> meta_of(const Config& config, bool every_edge) {
  std::map<std::string, std::string> meta = config.meta;
  meta["clock"] = "CLOCK_MONOTONIC";
  meta["rows"] = every_edge ? "one per edge" : fmt::format("{} Hz", config.rate_hz);
  for (const auto& encoder : config.encoders) {
    const AxisSettings& axis = encoder.axis;
    meta[axis.joint + ".scale"] =
        fmt::format("{} {} per count", axis.sign * axis.si_per_count, axis.unit);
    if (axis.zero_counts) meta[axis.joint + ".zero_counts"] = fmt::format("{}", *axis.zero_counts);
    meta[axis.joint + ".zero_position"] = fmt::format("{} {}", axis.zero_position_si, axis.unit);
  }
  return meta;
}

record::Event event_row(const std::string& joint, const AxisEvent& event, std::int64_t times) {
  const std::string fault =
      event.fault == Fault::kNone ? "" : fmt::format(R"(,"fault":"{}")", name_of(event.fault));
  return {event.to_ns, std::string(name_of(event.kind)),
          fmt::format(R"({{"joint":"{}","from_ns":{},"to_ns":{},"amount":{},"times":{}{}}})", joint,
                      event.from_ns, event.to_ns, event.amount, times, fault)};
}

}  // namespace

core::Result<Recorder> Recorder::create(const Config& config, const std::filesystem::path& path,
                                        const RecorderOptions& options) {
  RAVENCAL_ASSIGN_OR_RETURN(RecordingSink sink,
                            RecordingSink::create(path, meta_of(config, options.every_edge),
                                                  channels_of(config, options.every_edge)));
  return Recorder(config, std::move(sink), options);
}

Recorder::Recorder(const Config& config, RecordingSink sink, const RecorderOptions& options)
    : options_(options),
      period_ns_(std::max<std::int64_t>(1, std::llround(1e9 / config.rate_hz))),
      sources_(config.sources.size()),
      sink_(std::move(sink)) {
  for (const auto& encoder : config.encoders) {
    axes_.emplace_back(encoder.axis);
    source_of_axis_.push_back(encoder.source);
    latency_ns_ = std::max(latency_ns_, encoder.axis.latency_ns);
  }
  held_edges_.assign(axes_.size() * kChannelsPerAxisEdges, kNull);
  samples_.resize(axes_.size());
}

void Recorder::take(std::size_t source, const Reading& reading) {
  note_source_state(source, reading);
  if (next_row_ns_ == INT64_MIN && reading.kind != ReadingKind::kAlive) {
    first_reading_ns_ = std::min(first_reading_ns_, reading.t_ns);
  }
  if (reading.axis != kEveryAxis) {
    give_to_axis(reading.axis, reading);
    return;
  }
  for (std::size_t i = 0; i < axes_.size(); ++i) {
    if (source_of_axis_[i] == source) give_to_axis(i, reading);
  }
}

void Recorder::note_source_state(std::size_t source, const Reading& reading) {
  SourceState& state = sources_[source];
  if (reading.kind == ReadingKind::kAlive) {
    state.alive_ns = std::max(state.alive_ns, reading.t_ns);
    state.down = false;
  } else if (reading.kind == ReadingKind::kFault && reading.axis == kEveryAxis) {
    state.down = true;
  }
}

void Recorder::give_to_axis(std::size_t number, const Reading& reading) {
  Axis& axis = axes_[number];
  axis.push(reading);
  AxisUpdate update;
  for (std::int64_t losses = axis.losses(); axis.pop(update); losses = axis.losses()) {
    if (!options_.every_edge) continue;
    // A row without values says that something is missing before what follows.
    if (axis.losses() != losses) edges_.push_back({update.t_ns, number, kNull, kNull});
    if (!update.recordable) continue;
    edges_.push_back({update.t_ns, number, static_cast<double>(update.count),
                      static_cast<double>(update.levels)});
  }
  if (!axis.events().empty()) merge_events(number);
}

void Recorder::merge_events(std::size_t number) {
  for (const AxisEvent& event : axes_[number].events()) {
    device_failed_ = device_failed_ || is_loss(event.kind);
    const auto same =
        std::find_if(open_events_.begin(), open_events_.end(), [&](const OpenEvent& open) {
          return open.axis == number && open.event.kind == event.kind &&
                 open.event.fault == event.fault && event.kind != AxisEventKind::kIndexSlip &&
                 event.kind != AxisEventKind::kIndexFound &&
                 event.to_ns - open.event.from_ns < kEventMergeNs;
        });
    if (same == open_events_.end()) {
      open_events_.push_back({event, 1, number});
      continue;
    }
    same->event.from_ns = std::min(same->event.from_ns, event.from_ns);
    same->event.to_ns = std::max(same->event.to_ns, event.to_ns);
    same->event.amount += event.amount;
    ++same->times;
  }
  axes_[number].clear_events();
}

std::int64_t Recorder::watermark_ns() const {
  std::int64_t slowest = INT64_MAX;
  std::int64_t fastest = INT64_MIN;
  for (const auto& source : sources_) {
    if (source.down) continue;
    slowest = std::min(slowest, source.alive_ns);
    fastest = std::max(fastest, source.alive_ns);
  }
  if (fastest == INT64_MIN) return INT64_MIN;
  return std::max(slowest, fastest - kStallNs);
}

void Recorder::write_due() {
  const std::int64_t watermark = watermark_ns();
  if (watermark == INT64_MIN) return write_events(INT64_MAX);  // nobody delivers: tell it now
  if (options_.every_edge) write_edges(watermark - latency_ns_);
  walk_grid(watermark - latency_ns_);
  write_events(watermark - kEventMergeNs);
}

void Recorder::walk_grid(std::int64_t until_ns) {
  if (next_row_ns_ == INT64_MIN) {
    if (until_ns < first_reading_ns_) return;
    next_row_ns_ = (first_reading_ns_ + period_ns_ - 1) / period_ns_ * period_ns_;
  }
  for (; next_row_ns_ <= until_ns; next_row_ns_ += period_ns_) {
    for (std::size_t i = 0; i < axes_.size(); ++i) samples_[i] = axes_[i].sample(next_row_ns_);
    if (!options_.every_edge) put_row(next_row_ns_, samples_);
    if (observer_) observer_(next_row_ns_, samples_);
  }
}

void Recorder::put_row(std::int64_t t_ns, std::span<const AxisSample> samples) {
  row_.clear();
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const AxisSample& sample = samples[i];
    row_.push_back(sample.position_valid ? sample.position_si : kNull);
    row_.push_back(sample.counts_valid ? sample.velocity_si : kNull);
    row_.push_back(sample.counts_valid ? sample.counts : kNull);
    row_.push_back(static_cast<double>(axes_[i].losses()));
  }
  sink_.append(t_ns, row_);
}

void Recorder::write_edges(std::int64_t until_ns) {
  const auto by_time = [](const EdgeRow& x, const EdgeRow& y) { return x.t_ns < y.t_ns; };
  if (!std::is_sorted(edges_.begin(), edges_.end(), by_time)) {
    std::stable_sort(edges_.begin(), edges_.end(), by_time);
  }
  std::size_t written = 0;
  for (; written < edges_.size() && edges_[written].t_ns <= until_ns; ++written) {
    const EdgeRow& edge = edges_[written];
    held_edges_[kChannelsPerAxisEdges * edge.axis] = edge.count;
    held_edges_[kChannelsPerAxisEdges * edge.axis + 1] = edge.levels;
    last_written_ns_ = std::max(last_written_ns_, edge.t_ns);
    sink_.append(last_written_ns_, held_edges_);
  }
  edges_.erase(edges_.begin(), edges_.begin() + static_cast<std::ptrdiff_t>(written));
}

void Recorder::write_events(std::int64_t until_ns) {
  std::size_t kept = 0;
  for (const OpenEvent& open : open_events_) {
    if (open.event.to_ns > until_ns) {
      open_events_[kept++] = open;
    } else {
      sink_.append_event(event_row(axes_[open.axis].settings().joint, open.event, open.times));
    }
  }
  open_events_.resize(kept);
}

void Recorder::add_event(std::int64_t t_ns, const std::string& kind, const std::string& detail) {
  sink_.append_event({t_ns, kind, detail});
}

core::Status Recorder::finish() {
  const std::int64_t watermark = watermark_ns();
  if (watermark != INT64_MIN) {
    if (options_.every_edge) write_edges(INT64_MAX);
    walk_grid(watermark);
  }
  write_events(INT64_MAX);
  return sink_.finish();
}

}  // namespace ravencal::quadrature_reader
