// SPDX-License-Identifier: Apache-2.0
#include "record/recording.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "record/csv_number.hpp"

namespace ravencal::record {

core::Status check_channel_count(std::size_t channels, const std::filesystem::path& path) {
  if (channels <= kMostChannels) return {};
  return core::data_error(fmt::format("{}: {} channels; a recording holds at most {}",
                                      path.string(), channels, kMostChannels));
}

namespace {

template <typename Predicate>
std::optional<Eigen::Index> find_channel(const std::vector<Channel>& channels, Predicate wanted) {
  const auto it = std::find_if(channels.begin(), channels.end(), wanted);
  if (it == channels.end()) return std::nullopt;
  return it - channels.begin();
}

}  // namespace

std::optional<Eigen::Index> Recording::column(std::string_view name) const {
  return find_channel(channels, [&](const Channel& c) { return c.name == name; });
}

std::optional<Eigen::Index> Recording::column(Role role, std::string_view joint) const {
  return find_channel(channels,
                      [&](const Channel& c) { return c.role == role && c.joint == joint; });
}

std::vector<std::string> Recording::calibratable_joints() const {
  std::vector<std::string> joints;
  for (const Channel& channel : channels) {
    const bool estimate = channel.role == Role::kJointEstimate && !channel.joint.empty();
    if (estimate && column(Role::kJointTruth, channel.joint)) joints.push_back(channel.joint);
  }
  return joints;
}

std::vector<std::string> assumptions_of(const Recording& recording, std::string_view name) {
  std::vector<std::string> sentences;
  const auto meta = [&](const char* key) {
    const auto it = recording.meta.find(key);
    return it == recording.meta.end() ? std::string() : it->second;
  };
  if (const std::string period_s = meta("assumed_row_period_s"); !period_s.empty()) {
    sentences.push_back(fmt::format(
        "{} has no time in each row, so that its rows count as {} s apart; the sample time was "
        "assumed: {:g} ms (the profile's time = \"COLUMN\" or row_period_s, without `assumed = "
        "true`, says how "
        "far they are)",
        name, period_s, 1e3 * number_of(period_s).value_or(0.0)));
  }
  if (const std::string unit = meta("assumed_time_unit"); !unit.empty()) {
    sentences.push_back(
        fmt::format("the unit of the time of {} was assumed: {} (delete `assumed = true` in the "
                    "[source] of its profile when it is right)",
                    name, unit));
  }
  if (const std::string channels = meta("assumed_channels"); !channels.empty()) {
    sentences.push_back(fmt::format(
        "the unit, the joint or the sign of these channels of {} is an assumption of its profile "
        "(delete `assumed = true` there when it is right): {}",
        name, channels));
  }
  return sentences;
}

std::vector<const Recording*> pointers_to(const std::vector<Recording>& recordings) {
  std::vector<const Recording*> pointers;
  pointers.reserve(recordings.size());
  for (const Recording& recording : recordings) pointers.push_back(&recording);
  return pointers;
}

}  // namespace ravencal::record
