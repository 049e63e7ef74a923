// SPDX-License-Identifier: Apache-2.0
//
// Replays the edges of a recording made with --edges (or the counts of a sampled one), with its
// timing or as fast as possible. Time stamps are those of the recording.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "quadrature_reader/sources/source.hpp"

namespace ravencal::record {
struct Recording;
}

namespace ravencal::quadrature_reader {

/// Readings of the joints' `<joint>.lines` (levels A | B << 1 | Z << 2) or, where there are none,
/// `<joint>.counts` channels. A NULL is a loss, and so is what the rows say is missing
/// (joint_replay.hpp); `limits` by axis, none: no count is refused. Error if a joint has neither.
core::Result<std::vector<Reading>> readings_of(
    const record::Recording& recording, const std::map<std::string, std::uint8_t>& joints,
    const std::map<std::uint8_t, CountLimit>& limits = {});

class ReplaySource final : public Source {
 public:
  explicit ReplaySource(const SourceSettings& settings) : settings_(settings) {}
  /// Replays given readings, in time order; for tests and benchmarks.
  ReplaySource(const SourceSettings& settings, std::vector<Reading> readings)
      : settings_(settings), readings_(std::move(readings)) {}

  core::Status open() override;
  core::Status read(std::vector<Reading>& out, std::chrono::milliseconds timeout) override;
  [[nodiscard]] bool patient() const override { return true; }
  [[nodiscard]] bool finished() const override { return opened_ && next_ == readings_.size(); }

 private:
  SourceSettings settings_;
  std::vector<Reading> readings_;
  std::size_t next_ = 0;
  bool opened_ = false;
  std::int64_t started_ns_ = 0;  // monotonic clock at the first reading
};

}  // namespace ravencal::quadrature_reader
