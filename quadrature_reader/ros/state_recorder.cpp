// SPDX-License-Identifier: Apache-2.0
#include "quadrature_reader/ros/state_recorder.hpp"

#include <fmt/format.h>

#include "core/catalogue.hpp"
#include "core/version.hpp"
#include "record/profile.hpp"
#include "record/raven_state_message.hpp"

namespace ravencal::quadrature_reader {
namespace {

constexpr double kStepMemory = 0.05;      // share of the newest step in the usual one
constexpr double kGapSteps = 5.0;         // so many usual steps without a message are a gap
constexpr std::int64_t kFirstSteps = 20;  // before that no step is usual
constexpr std::size_t kTime = core::catalogue_index(core::RavenField::kTime, 0);

}  // namespace

StateRecorder::StateRecorder(std::filesystem::path path, std::string arm)
    : path_(std::move(path)), arm_(std::move(arm)) {}

core::Status StateRecorder::begin(std::int64_t stamp_ns) {
  record::ProfileOptions options;
  options.arm = arm_;
  RAVENCAL_ASSIGN_OR_RETURN(const record::Profile profile, record::load_profile("raven2", options));
  std::vector<record::Channel> channels;
  for (const auto& channel : profile.channels) {
    if (channel.channel.role != record::Role::kJointTruth) channels.push_back(channel.channel);
  }
  const std::map<std::string, std::string> meta = {
      {"robot", profile.robot},
      {"arm", arm_},
      {"profile", "raven2"},
      {"source", "ravenstate"},
      {"clock", "CLOCK_REALTIME of the robot"},
      {"origin.time", fmt::format("{}", 1e-9 * static_cast<double>(stamp_ns))},
      {"software_version", core::kVersion}};
  RAVENCAL_ASSIGN_OR_RETURN(sink_, RecordingSink::create(path_, meta, channels));
  first_stamp_ns_ = last_stamp_ns_ = stamp_ns;
  return {};
}

core::Status StateRecorder::take(std::span<const std::uint8_t> message) {
  const auto state = record::decode_raven_state(message, arm_ == "gold");
  if (!state) {
    return core::Error{core::ErrorCode::kData,
                       fmt::format("ravenstate: {} bytes are no raven_state", message.size())};
  }
  if (!sink_) RAVENCAL_RETURN_IF_ERROR(begin(state->stamp_ns));
  if (state->stamp_ns < last_stamp_ns_) {
    return core::Error{
        core::ErrorCode::kData,
        fmt::format("ravenstate: a stamp {:.3f} ms before the last one: the robot's clock was set",
                    1e-6 * static_cast<double>(last_stamp_ns_ - state->stamp_ns))};
  }
  note_gap(state->stamp_ns);
  row_.assign(state->values.begin(), state->values.end());
  row_[kTime] = 1e-9 * static_cast<double>(state->stamp_ns - first_stamp_ns_);
  sink_->append(state->stamp_ns, row_);
  last_stamp_ns_ = state->stamp_ns;
  return {};
}

void StateRecorder::note_gap(std::int64_t stamp_ns) {
  const auto step_ns = static_cast<double>(stamp_ns - last_stamp_ns_);
  if (sink_->rows() > kFirstSteps && step_ns > kGapSteps * usual_step_ns_) {
    sink_->append_event({stamp_ns, "gap",
                         fmt::format(R"({{"from_ns":{},"to_ns":{},"rows_missing_about":{:.0f}}})",
                                     last_stamp_ns_, stamp_ns, step_ns / usual_step_ns_ - 1.0)});
    return;
  }
  usual_step_ns_ =
      sink_->rows() <= 1 ? step_ns : usual_step_ns_ + kStepMemory * (step_ns - usual_step_ns_);
}

void StateRecorder::maintain(std::int64_t now_ns) {
  if (sink_) sink_->maintain(now_ns);
}

core::Status StateRecorder::finish() { return sink_ ? sink_->finish() : core::Status(); }

}  // namespace ravencal::quadrature_reader
