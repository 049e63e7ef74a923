// SPDX-License-Identifier: Apache-2.0
//
// A recording in memory: samples in SI units, one column per channel, with metadata and events.
// Every reader (SQLite, CSV, bag) produces it; every consumer (train, evaluate, diagnose) takes it.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"
#include "record/channel.hpp"

namespace ravencal::record {

/// SQLITE_MAX_COLUMN is 2000, of which one is t_ns.
inline constexpr std::size_t kMostChannels = 1999;

/// Refuses (kData) more channels than a recording holds; `path` is what has them.
core::Status check_channel_count(std::size_t channels, const std::filesystem::path& path);

/// Something that happened at a time: homing, run-level change, drop, overrun, device error.
struct Event {
  std::int64_t t_ns = 0;
  std::string kind;
  std::string detail;
};

/// Samples, [rows x channels], column-major so that one channel is contiguous.
using SampleMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor>;

/// A whole recording. Invariants: t_ns never decreases; samples.rows() == t_ns.size();
/// samples.cols() == channels.size(); a lost value is NaN.
struct Recording {
  std::map<std::string, std::string> meta;  ///< format version, robot, arm, serial, profile, ...
  std::vector<Channel> channels;            ///< units are those of `samples`: SI
  std::vector<std::int64_t> t_ns;
  SampleMatrix samples;
  std::vector<Event> events;
  std::string source;  ///< path it was read from, for messages

  [[nodiscard]] Eigen::Index rows() const { return samples.rows(); }
  /// Column of the channel of that name.
  [[nodiscard]] std::optional<Eigen::Index> column(std::string_view name) const;
  /// Column of the channel with that role and joint.
  [[nodiscard]] std::optional<Eigen::Index> column(Role role, std::string_view joint) const;
  /// Joints that have both an estimate and a truth, in channel order: what can be calibrated.
  [[nodiscard]] std::vector<std::string> calibratable_joints() const;
};

std::vector<const Recording*> pointers_to(const std::vector<Recording>& recordings);

}  // namespace ravencal::record
