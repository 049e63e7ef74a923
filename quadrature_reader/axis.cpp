// SPDX-License-Identifier: Apache-2.0
#include "quadrature_reader/axis.hpp"

#include <algorithm>

namespace ravencal::quadrature_reader {

std::string_view name_of(AxisEventKind kind) {
  switch (kind) {
    case AxisEventKind::kEdgesLost:
      return "edges_lost";
    case AxisEventKind::kLevelMismatch:
      return "level_mismatch";
    case AxisEventKind::kRepeatedEdge:
      return "repeated_edge";
    case AxisEventKind::kEdgeRepaired:
      return "edge_repaired";
    case AxisEventKind::kLateEdge:
      return "late_edge";
    case AxisEventKind::kIndexFound:
      return "index_found";
    case AxisEventKind::kIndexSlip:
      return "index_slip";
    case AxisEventKind::kRestarted:
      return "device_restarted";
    case AxisEventKind::kCounterWrapped:
      return "counter_wrapped";
    case AxisEventKind::kOutage:
      return "outage";
    case AxisEventKind::kRecovered:
      return "recovered";
    case AxisEventKind::kNotice:
      return "notice";
    case AxisEventKind::kGlitchRemoved:
      return "glitch_removed";
  }
  return "unknown";
}

bool is_loss(AxisEventKind kind) {
  switch (kind) {
    case AxisEventKind::kEdgesLost:
    case AxisEventKind::kLevelMismatch:
    case AxisEventKind::kRepeatedEdge:
    case AxisEventKind::kEdgeRepaired:
    case AxisEventKind::kLateEdge:
    case AxisEventKind::kIndexSlip:
    case AxisEventKind::kRestarted:
    case AxisEventKind::kCounterWrapped:
    case AxisEventKind::kOutage:
      return true;
    case AxisEventKind::kIndexFound:
    case AxisEventKind::kRecovered:
    case AxisEventKind::kNotice:
    case AxisEventKind::kGlitchRemoved:
      return false;
  }
  return false;
}

Axis::Axis(const AxisSettings& settings)
    : settings_(settings),
      filter_(settings.shortest_pulse_ns),
      track_(settings.latency_ns, settings.stale_ns) {
  if (settings.index)
    index_.emplace(settings.index->counts_per_rev, settings.index->tolerance_counts);
}

void Axis::push(const Reading& reading) {
  if (reading.kind == ReadingKind::kAlive) {
    filter_.advance(reading.t_ns);
  } else {
    filter_.push(reading);
  }
}

bool Axis::pop(AxisUpdate& update) {
  Reading reading;
  if (!filter_.pop(reading)) return false;
  switch (reading.kind) {
    case ReadingKind::kEdge:
      take_edge(reading);
      break;
    case ReadingKind::kLevels:
      take_levels(reading);
      break;
    case ReadingKind::kCount:
      take_count(reading);
      break;
    default:
      take_state(reading);
      break;
  }
  if (filter_.removed_pulses() > reported_glitches_) {
    report(AxisEventKind::kGlitchRemoved, reading.t_ns, reading.t_ns,
           filter_.removed_pulses() - reported_glitches_);
    reported_glitches_ = filter_.removed_pulses();
  }
  const bool recordable = reading.kind == ReadingKind::kEdge ||
                          reading.kind == ReadingKind::kLevels ||
                          reading.kind == ReadingKind::kCount;
  update = {reading.t_ns, count_, levels_, recordable};
  return true;
}

void Axis::take_edge(const Reading& reading) {
  if (reading.t_ns < last_t_ns_) {
    // Its neighbours are decoded already; without it the levels do not follow: a known loss.
    report(AxisEventKind::kLateEdge, reading.t_ns, last_t_ns_, 1);
    decoder_.on_lost(1);
    gap_from_ns_ = reading.t_ns;
    track_.interrupt(last_t_ns_);
    return;
  }
  ++edges_;
  const auto line = static_cast<std::size_t>(reading.line);
  const auto bit = static_cast<std::uint8_t>(1U << line);
  levels_ = static_cast<std::uint8_t>(reading.value != 0 ? levels_ | bit : levels_ & ~bit);
  if (reading.line == Line::kZ) {
    take_index_edge(reading);
  } else {
    const DecoderStep step = decoder_.on_edge(reading.line, reading.value != 0);
    take_motion(reading, step, last_line_t_ns_[line]);
    last_line_t_ns_[line] = reading.t_ns;
  }
  last_t_ns_ = reading.t_ns;
}

void Axis::take_motion(const Reading& reading, const DecoderStep& step,
                       std::int64_t known_until_ns) {
  const std::int64_t before = count_;
  count_ = decoder_.count();
  track_.set_uncertainty(uncertainty_counts());
  if (!delivering_) {
    delivering_ = decoder_.levels_known();
    if (delivering_) track_.begin(reading.t_ns, count_);
    return;
  }
  switch (step.kind) {
    case DecoderStep::Kind::kNone:
      break;
    case DecoderStep::Kind::kStep:
      track_.add_edge(reading.t_ns, before, count_);
      break;
    case DecoderStep::Kind::kRepeated:
    case DecoderStep::Kind::kRepaired:
      report(step.kind == DecoderStep::Kind::kRepeated ? AxisEventKind::kRepeatedEdge
                                                       : AxisEventKind::kEdgeRepaired,
             known_until_ns, reading.t_ns, 1);
      track_.add_gap(known_until_ns, reading.t_ns, count_);
      break;
    case DecoderStep::Kind::kResync:
      track_.add_gap(gap_from_ns_, reading.t_ns, count_);
      break;
  }
}

void Axis::take_index_edge(const Reading& reading) {
  if (!index_) return;
  const auto pass = index_->on_edge(reading.value != 0, decoder_.direction(), count_);
  if (!pass) return;
  if (pass->first) {
    report(AxisEventKind::kIndexFound, reading.t_ns, reading.t_ns, count_);
    return;
  }
  if (pass->slip_counts != 0) {
    report(AxisEventKind::kIndexSlip, reading.t_ns, reading.t_ns, pass->slip_counts);
  }
  // The index says how far the count is off. A position that was withheld for its uncertainty can
  // be given again; one that was being given does not jump.
  if (settings_.zero_counts && uncertainty_counts() > settings_.max_uncertainty_counts) {
    *settings_.zero_counts += pass->slip_counts;
  }
  decoder_.trust();
}

void Axis::take_levels(const Reading& reading) {
  if (reading.t_ns < last_t_ns_) return;
  const bool knew = decoder_.levels_known();
  levels_ = static_cast<std::uint8_t>(reading.value & 7);
  const DecoderStep step = decoder_.on_levels((levels_ & 1) != 0, (levels_ & 2) != 0);
  if (delivering_ && knew && step.kind == DecoderStep::Kind::kResync) {
    gap_from_ns_ = std::min(last_line_t_ns_[0], last_line_t_ns_[1]);
    report(AxisEventKind::kLevelMismatch, gap_from_ns_, reading.t_ns, std::abs(step.delta_counts));
  }
  take_motion(reading, step, gap_from_ns_);
  last_t_ns_ = reading.t_ns;
  last_line_t_ns_ = {reading.t_ns, reading.t_ns};
}

void Axis::take_count(const Reading& reading) {
  if (reading.t_ns < last_t_ns_) {
    report(AxisEventKind::kLateEdge, reading.t_ns, last_t_ns_, 1);
    return;
  }
  counting_device_ = true;
  ++edges_;
  count_ = reading.value;
  track_.set_uncertainty(uncertainty_counts());
  if (delivering_) {
    track_.add_count(reading.t_ns, count_);
  } else {
    track_.begin(reading.t_ns, count_);
    delivering_ = true;
  }
  last_t_ns_ = reading.t_ns;
}

void Axis::take_state(const Reading& reading) {
  switch (reading.kind) {
    case ReadingKind::kLost:
      report(AxisEventKind::kEdgesLost, last_t_ns_, reading.t_ns, reading.value, reading.fault);
      if (!counting_device_) {
        gap_from_ns_ = last_t_ns_;
        // What was refused as implausible is no number of edges.
        decoder_.on_lost(reading.fault == Fault::kImplausibleCount ? 0 : reading.value);
        track_.interrupt(last_t_ns_);
      }
      break;
    case ReadingKind::kUnseen:
      take_unseen(reading);
      break;
    case ReadingKind::kWrapped:
      report(AxisEventKind::kCounterWrapped, last_t_ns_, reading.t_ns, reading.value);
      break;
    case ReadingKind::kRestarted:
      report(AxisEventKind::kRestarted, last_t_ns_, reading.t_ns, reading.value, reading.fault);
      device_restarted_ = true;
      track_.interrupt(last_t_ns_);
      if (index_) index_->reset();
      break;
    case ReadingKind::kFault:
      report(AxisEventKind::kOutage, delivering_ ? last_t_ns_ : reading.t_ns, reading.t_ns,
             reading.value, reading.fault);
      delivering_ = false;
      if (!counting_device_) decoder_.on_lost(0);
      track_.interrupt(last_t_ns_);
      break;
    case ReadingKind::kRecovered:
      report(AxisEventKind::kRecovered, reading.t_ns, reading.t_ns, 0, reading.fault);
      break;
    default:
      report(AxisEventKind::kNotice, reading.t_ns, reading.t_ns, reading.value, reading.fault);
      break;
  }
}

void Axis::take_unseen(const Reading& reading) {
  const std::int64_t movement = std::abs(reading.value);
  // The last edge of the movement is the one that the levels after it show.
  report(AxisEventKind::kEdgesLost, last_t_ns_, reading.t_ns,
         std::max<std::int64_t>(movement - 1, 1), reading.fault);
  gap_from_ns_ = last_t_ns_;
  // A movement that was counted is exact; one that was inferred may have gone the other way.
  decoder_.on_unseen(reading.value, reading.fault == Fault::kMissingRows ? 0 : 2 * movement);
  track_.interrupt(last_t_ns_);
}

AxisSample Axis::sample(std::int64_t t_ns) {
  const TrackSample track = track_.sample(t_ns);
  AxisSample sample;
  if (!track.valid) return sample;
  const double scale = settings_.sign * settings_.si_per_count;
  sample.counts_valid = true;
  sample.counts = track.position_counts;
  sample.velocity_si = scale * track.velocity_counts_per_s;
  if (settings_.zero_counts && track.uncertainty_counts <= settings_.max_uncertainty_counts) {
    sample.position_valid = true;
    sample.position_si =
        scale * (track.position_counts - static_cast<double>(*settings_.zero_counts)) +
        settings_.zero_position_si;
  }
  return sample;
}

void Axis::set_zero(std::int64_t zero_counts, double zero_position_si) {
  settings_.zero_counts = zero_counts;
  settings_.zero_position_si = zero_position_si;
  decoder_.trust();
  device_restarted_ = false;
  track_.set_uncertainty_of_all(0);
}

std::optional<std::int64_t> Axis::index_counts() const {
  return index_ ? index_->reference_counts() : std::nullopt;
}

std::int64_t Axis::uncertainty_counts() const {
  return device_restarted_ ? QuadratureDecoder::kUnbounded : decoder_.uncertainty_counts();
}

void Axis::report(AxisEventKind kind, std::int64_t from_ns, std::int64_t to_ns, std::int64_t amount,
                  Fault fault) {
  if (is_loss(kind)) ++losses_;
  events_.push_back({kind, fault, from_ns, to_ns, amount});
}

}  // namespace ravencal::quadrature_reader
