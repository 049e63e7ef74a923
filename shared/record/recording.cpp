// SPDX-License-Identifier: Apache-2.0
#include "record/recording.hpp"

#include <fmt/format.h>

#include <algorithm>

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

std::vector<const Recording*> pointers_to(const std::vector<Recording>& recordings) {
  std::vector<const Recording*> pointers;
  pointers.reserve(recordings.size());
  for (const Recording& recording : recordings) pointers.push_back(&recording);
  return pointers;
}

}  // namespace ravencal::record
