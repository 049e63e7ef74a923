// SPDX-License-Identifier: Apache-2.0
#include "quadrature_reader/homing_watch.hpp"

#include <fmt/format.h>

#include <cmath>

namespace ravencal::quadrature_reader {
namespace {

constexpr std::int64_t kSamplePeriodNs = 4'000'000;  // find_hard_stop's 250 Hz
constexpr std::size_t kExamineEvery = 125;           // samples
// The joint has left the stop once it is this many plateau widths away: the visit is complete.
constexpr double kLeftWidths = 10.0;

}  // namespace

HomingWatch::HomingWatch(const Config& config, std::map<std::string, HomingRecord> before)
    : records_(std::move(before)) {
  for (const auto& encoder : config.encoders) {
    const SourceKind kind = config.sources[encoder.source].kind;
    Joint joint;
    joint.name = encoder.axis.joint;
    joint.stop = encoder.stop;
    joint.counts_by_itself = kind == SourceKind::kCan;
    joints_.push_back(std::move(joint));
  }
}

void HomingWatch::start() {
  for (auto& joint : joints_) {
    joint.watching = joint.stop.has_value();
    joint.t_ns.clear();
    joint.counts.clear();
    joint.examined = 0;
  }
}

void HomingWatch::take(std::int64_t t_ns, std::span<const AxisSample> samples, Recorder& recorder) {
  if (t_ns < next_sample_ns_) return;
  next_sample_ns_ = t_ns + kSamplePeriodNs;
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    Joint& joint = joints_[i];
    if (!joint.watching || !samples[i].counts_valid) continue;
    joint.t_ns.push_back(t_ns);
    joint.counts.push_back(samples[i].counts);
    if (joint.counts.size() >= joint.examined + kExamineEvery) {
      joint.examined = joint.counts.size();
      examine(joint, recorder.axes()[i], t_ns, recorder);
    }
  }
}

void HomingWatch::examine(Joint& joint, Axis& axis, std::int64_t t_ns, Recorder& recorder) {
  // The configuration speaks of the joint's position, the counts may run the other way.
  const bool at_largest_count = joint.stop->at_maximum == (axis.settings().sign > 0);
  const auto stop = find_hard_stop(joint.t_ns, joint.counts, at_largest_count);
  if (!stop) return;
  if (std::abs(joint.counts.back() - stop->position_counts) < kLeftWidths * stop->width_counts)
    return;
  joint.watching = false;
  settle(joint, axis, *stop, t_ns, recorder);
}

void HomingWatch::settle(Joint& joint, Axis& axis, const HardStop& stop, std::int64_t t_ns,
                         Recorder& recorder) {
  const auto moved = moved_since_before(joint, axis, stop);
  const bool again = homed_in_this_run_[joint.name];
  if (!again) {
    // The median may lie between two counts; the position carries the fraction.
    const auto zero = static_cast<std::int64_t>(std::llround(stop.position_counts));
    const double scale = axis.settings().sign * axis.settings().si_per_count;
    axis.set_zero(
        zero, joint.stop->position_si + scale * (static_cast<double>(zero) - stop.position_counts));
  }
  recorder.add_event(
      t_ns, again ? "rehoming" : "homing",
      fmt::format(
          R"({{"joint":"{}","stop_counts":{},"stop_position":{},"unit":"{}","spread_counts":{:.3f},)"
          R"("samples":{},"confidence":{:.9f},"from_ns":{},"to_ns":{},"moved_counts":{}}})",
          joint.name, stop.position_counts, joint.stop->position_si, axis.settings().unit,
          stop.spread_counts, stop.samples, stop.confidence, stop.from_ns, stop.to_ns,
          moved ? fmt::format("{:.1f}", *moved) : "null"));
  recorder.sink().set_meta(joint.name + ".zero_counts", fmt::format("{}", stop.position_counts));
  records_[joint.name] = {stop.position_counts, stop.spread_counts, axis.index_counts()};
  homed_in_this_run_[joint.name] = true;
  homed_any_ = true;
}

std::optional<double> HomingWatch::moved_since_before(const Joint& joint, const Axis& axis,
                                                      const HardStop& stop) const {
  const auto before = records_.find(joint.name);
  if (before == records_.end()) return std::nullopt;
  const auto homed = homed_in_this_run_.find(joint.name);
  const bool same_counts =
      joint.counts_by_itself || (homed != homed_in_this_run_.end() && homed->second);
  if (same_counts) return stop.position_counts - before->second.stop_counts;
  // Counting began anew with this program: only the index pulse is the same as then.
  if (!before->second.index_counts || !axis.index_counts() || !axis.settings().index)
    return std::nullopt;
  const double then =
      before->second.stop_counts - static_cast<double>(*before->second.index_counts);
  const double now = stop.position_counts - static_cast<double>(*axis.index_counts());
  return std::remainder(now - then, static_cast<double>(axis.settings().index->counts_per_rev));
}

std::vector<std::string> HomingWatch::waiting() const {
  std::vector<std::string> names;
  for (const auto& joint : joints_) {
    if (joint.watching) names.push_back(joint.name);
  }
  return names;
}

}  // namespace ravencal::quadrature_reader
