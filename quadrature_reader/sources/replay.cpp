// SPDX-License-Identifier: Apache-2.0
#include "quadrature_reader/sources/replay.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <thread>

#include "record/load.hpp"
#include "record/recording.hpp"

namespace ravencal::quadrature_reader {
namespace {

constexpr std::size_t kBatch = 256;

class JointReplay {
 public:
  JointReplay(std::uint8_t axis, bool lines) : axis_(axis), lines_(lines) {}

  void take(std::int64_t t_ns, double value, std::vector<Reading>& out) {
    constexpr double kLargest = 9e15;  // whole numbers are exact in a double up to here
    if (!(std::abs(value) <= kLargest)) {
      if (known_) out.push_back({t_ns, 0, axis_, ReadingKind::kLost, Line::kA, Fault::kNone});
      known_ = false;
      return;
    }
    const auto now = static_cast<std::int64_t>(std::llround(value));
    if (!lines_) {
      if (!known_ || now != last_) put(t_ns, now, ReadingKind::kCount, Line::kA, out);
    } else if (!known_) {
      put(t_ns, now & 7, ReadingKind::kLevels, Line::kA, out);
    } else {
      const std::int64_t changed = now ^ last_;
      for (unsigned line = 0; line < 3; ++line) {
        if (((changed >> line) & 1) != 0) {
          put(t_ns, (now >> line) & 1, ReadingKind::kEdge, static_cast<Line>(line), out);
        }
      }
    }
    last_ = now;
    known_ = true;
  }

 private:
  void put(std::int64_t t_ns, std::int64_t value, ReadingKind kind, Line line,
           std::vector<Reading>& out) const {
    out.push_back({t_ns, value, axis_, kind, line, Fault::kNone});
  }

  std::uint8_t axis_;
  bool lines_;
  bool known_ = false;
  std::int64_t last_ = 0;
};

}  // namespace

core::Result<std::vector<Reading>> readings_of(const record::Recording& recording,
                                               const std::map<std::string, std::uint8_t>& joints) {
  std::vector<std::pair<Eigen::Index, JointReplay>> replays;
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
    replays.emplace_back(lines ? *lines : *counts, JointReplay(axis, lines.has_value()));
  }
  std::vector<Reading> readings;
  readings.reserve(static_cast<std::size_t>(recording.rows()) * 2);
  for (Eigen::Index row = 0; row < recording.rows(); ++row) {
    const std::int64_t t_ns = recording.t_ns[static_cast<std::size_t>(row)];
    for (auto& [column, replay] : replays)
      replay.take(t_ns, recording.samples(row, column), readings);
  }
  return readings;
}

core::Status ReplaySource::open() {
  if (readings_.empty() && !settings_.device.empty()) {
    RAVENCAL_ASSIGN_OR_RETURN(const record::Recording recording,
                              record::load_recording(settings_.device, {}));
    RAVENCAL_ASSIGN_OR_RETURN(readings_, readings_of(recording, settings_.replay_joints));
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
