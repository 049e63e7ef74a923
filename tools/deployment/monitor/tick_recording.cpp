// SPDX-License-Identifier: Apache-2.0
#include "monitor/tick_recording.hpp"

#include <fmt/format.h>

#include <array>
#include <map>
#include <utility>
#include <vector>

#include "monitor/watch.hpp"

namespace ravencal::monitor {
namespace {

using record::Channel;
using record::Role;

constexpr std::size_t kPerJoint = 6;
constexpr std::size_t kCommon = 7;
constexpr std::size_t kChannels = RAVENCAL_JOINTS * kPerJoint + kCommon;

std::vector<Channel> make_channels() {
  std::vector<Channel> channels;
  for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
    const std::string joint = units_of(j).joint;
    const std::string unit = units_of(j).si;
    channels.push_back({"jpos." + joint, unit, Role::kJointEstimate, joint});
    channels.push_back({"correction." + joint, unit, Role::kFeature, joint});
    channels.push_back({"would_be." + joint, unit, Role::kFeature, joint});
    channels.push_back({"offset." + joint, unit, Role::kFeature, joint});
    channels.push_back({"predicted." + joint, unit, Role::kFeature, joint});
    channels.push_back({"enc." + joint, "counts", Role::kFeature, joint});
  }
  for (const char* name : {"runlevel", "state", "would_be_state", "doubts"}) {
    channels.push_back({name, "1", Role::kStatus, ""});
  }
  channels.push_back({"confidence", "1", Role::kFeature, ""});
  channels.push_back({"step", "ns", Role::kFeature, ""});
  channels.push_back({"tick", "1", Role::kFeature, ""});
  return channels;
}

std::array<double, kChannels> row_of(const NumberedTick& numbered) {
  const ravencal_tick& tick = numbered.tick;
  std::array<double, kChannels> row{};
  std::size_t i = 0;
  for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
    row[i++] = static_cast<double>(tick.jpos_ji[j]);
    row[i++] = static_cast<double>(numbered.applied_ji(j));
    row[i++] = static_cast<double>(tick.correction_ji[j]);
    row[i++] = static_cast<double>(numbered.offset_ji[j]);
    row[i++] = static_cast<double>(tick.predicted_ji[j]);
    row[i++] = tick.enc_counts[j];
  }
  row[i++] = tick.runlevel;
  row[i++] = tick.state;
  row[i++] = tick.would_be_state;
  row[i++] = tick.doubts;
  row[i++] = static_cast<double>(tick.confidence);
  row[i++] = tick.step_ns;
  row[i] = static_cast<double>(numbered.number);
  return row;
}

}  // namespace

core::Result<TickRecording> TickRecording::create(const std::filesystem::path& path,
                                                  const TelemetryReader& reader) {
  const std::map<std::string, std::string> meta = {
      {"robot", "RAVEN-II"},
      {"profile", "telemetry"},
      {"source", reader.name()},
      {"plugin_version", reader.plugin_version()},
      {"writer_pid", fmt::format("{}", reader.writer_pid())},
      {"writer_start_realtime_ns", fmt::format("{}", reader.start_realtime_ns())},
      {"tick_ns", fmt::format("{}", reader.tick_ns())}};
  RAVENCAL_ASSIGN_OR_RETURN(record::RecordingWriter writer,
                            record::RecordingWriter::create(path, meta, make_channels(), true));
  return TickRecording(std::move(writer));
}

core::Status TickRecording::append(const NumberedTick& tick) {
  if (expected_ && tick.number > *expected_) {
    RAVENCAL_RETURN_IF_ERROR(
        writer_.append_event({last_t_ns_.value_or(tick.tick.t_ns), "gap",
                              fmt::format("{} ticks lost, {} to {}: the monitor fell behind",
                                          tick.number - *expected_, *expected_, tick.number - 1)}));
  }
  expected_ = tick.number + 1;
  const bool back = last_t_ns_ && tick.tick.t_ns < *last_t_ns_;
  if (back) {
    ++not_stored_;
    if (std::exchange(time_is_back_, true)) return {};
    return writer_.append_event(
        {*last_t_ns_, "time_back",
         fmt::format("from tick {} on: the robot's time ran back by {} ns; no rows until it has "
                     "passed this point again",
                     tick.number, *last_t_ns_ - tick.tick.t_ns)});
  }
  time_is_back_ = false;
  last_t_ns_ = tick.tick.t_ns;
  ++rows_;
  return writer_.append(tick.tick.t_ns, row_of(tick));
}

core::Status TickRecording::append(Change change, const TelemetryReader& reader) {
  const char* kind = nullptr;
  switch (change) {
    case Change::kNone:
      return {};
    case Change::kEnded:
      kind = "writer_ended";
      break;
    case Change::kGone:
      kind = "writer_gone";
      break;
    case Change::kAttached:
      kind = "writer_attached";
      expected_ = 0;
      break;
  }
  return writer_.append_event({last_t_ns_.value_or(0), kind,
                               fmt::format("process {}, started at {} ns since 1970",
                                           reader.writer_pid(), reader.start_realtime_ns())});
}

}  // namespace ravencal::monitor
