// SPDX-License-Identifier: Apache-2.0
#include "quadrature_reader/sources/replay.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <thread>

#include "quadrature_reader/sources/joint_replay.hpp"
#include "record/load.hpp"
#include "record/recording.hpp"

namespace ravencal::quadrature_reader {
namespace {

constexpr std::size_t kBatch = 256;

using TakeRow = std::function<void(Eigen::Index row, std::vector<Reading>& out)>;

TakeRow lines_of(const record::Recording& recording, std::uint8_t axis, const CountLimit& limit,
                 Eigen::Index lines, std::optional<Eigen::Index> counts) {
  return [&recording, lines, counts, replay = LinesReplay(axis, limit)](
             Eigen::Index row, std::vector<Reading>& out) mutable {
    replay.take(recording.t_ns[static_cast<std::size_t>(row)], recording.samples(row, lines),
                counts ? recording.samples(row, *counts) : std::nan(""), out);
  };
}

TakeRow counts_of(const record::Recording& recording, std::uint8_t axis, const CountLimit& limit,
                  Eigen::Index counts) {
  std::vector<double> column(recording.t_ns.size());
  for (std::size_t row = 0; row < column.size(); ++row)
    column[row] = recording.samples(static_cast<Eigen::Index>(row), counts);
  return [&recording, counts, replay = CountsReplay(axis, limit, recording.t_ns, column)](
             Eigen::Index row, std::vector<Reading>& out) mutable {
    replay.take(recording.t_ns[static_cast<std::size_t>(row)], recording.samples(row, counts), out);
  };
}

}  // namespace

core::Result<std::vector<Reading>> readings_of(const record::Recording& recording,
                                               const std::map<std::string, std::uint8_t>& joints,
                                               const std::map<std::uint8_t, CountLimit>& limits) {
  std::vector<TakeRow> take_row;
  for (const auto& [joint, axis] : joints) {
    const auto lines = recording.column(joint + ".lines");
    const auto counts = recording.column(joint + ".counts");
    if (!lines && !counts) {
      return core::Error{
          core::ErrorCode::kData,
          fmt::format("{}: joint '{}' has neither a channel '{}.lines' nor '{}.counts'; only "
                      "recordings of ravencal-encoders can be replayed",
                      recording.source, joint, joint, joint)};
    }
    const auto found = limits.find(axis);
    const CountLimit limit = found == limits.end() ? CountLimit{} : found->second;
    take_row.push_back(lines ? lines_of(recording, axis, limit, *lines, counts)
                             : counts_of(recording, axis, limit, *counts));
  }
  std::vector<Reading> readings;
  readings.reserve(static_cast<std::size_t>(recording.rows()) * 2);
  for (Eigen::Index row = 0; row < recording.rows(); ++row) {
    for (auto& take : take_row) take(row, readings);
  }
  return readings;
}

core::Status ReplaySource::open() {
  if (readings_.empty() && !settings_.device.empty()) {
    RAVENCAL_ASSIGN_OR_RETURN(const record::Recording recording,
                              record::load_recording(settings_.device, {}));
    RAVENCAL_ASSIGN_OR_RETURN(
        readings_, readings_of(recording, settings_.replay_joints, settings_.replay_limits));
  }
  opened_ = true;
  started_ns_ = monotonic_now_ns();
  return {};
}

core::Status ReplaySource::read(std::vector<Reading>& out, std::chrono::milliseconds timeout) {
  if (finished()) {
    std::this_thread::sleep_for(timeout);
    return {};
  }
  std::int64_t until_ns = INT64_MAX;
  if (settings_.replay_speed > 0.0) {
    // Deliver what is due now, or sleep towards the next reading.
    const auto elapsed_ns = [this] {
      return static_cast<std::int64_t>(static_cast<double>(monotonic_now_ns() - started_ns_) *
                                       settings_.replay_speed);
    };
    const std::int64_t first_ns = readings_.front().t_ns;
    const double wait_s = static_cast<double>(readings_[next_].t_ns - first_ns - elapsed_ns()) *
                          1e-9 / settings_.replay_speed;
    if (wait_s > 0.0) {
      std::this_thread::sleep_for(
          std::min(std::chrono::duration<double>(wait_s), std::chrono::duration<double>(timeout)));
    }
    until_ns = first_ns + elapsed_ns();
  }
  for (std::size_t n = 0;
       n < kBatch && next_ < readings_.size() && readings_[next_].t_ns <= until_ns; ++n) {
    out.push_back(readings_[next_++]);
  }
  const std::int64_t alive_ns = next_ < readings_.size()
                                    ? std::min(until_ns, readings_[next_].t_ns - 1)
                                    : readings_.back().t_ns;
  out.push_back({alive_ns, 0, kEveryAxis, ReadingKind::kAlive, Line::kA, Fault::kNone});
  return {};
}

}  // namespace ravencal::quadrature_reader
