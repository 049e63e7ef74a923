// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <vector>

#include "core/joint_layout.hpp"
#include "core/run_level.hpp"
#include "host/robot_source.hpp"
#include "plugin_host/robot_state.hpp"

namespace ravencal::host {
namespace {

using record::Recording;

constexpr std::int64_t kTickNs = 1'000'000;
/// Longest time for which a row stands. A gap beyond it says nothing of the robot, and the loop
/// goes on at the row after it.
constexpr std::int64_t kLongestHeldNs = 1'000'000'000;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// The ticks of a recording, in order.
class ReplayClock {
 public:
  explicit ReplayClock(const std::vector<std::int64_t>& rows_ns) : rows_ns_(rows_ns) {}

  /// The next tick, the first one at first; false: after the last row.
  bool advance() {
    t_ns_ += kTickNs;
    if (!begun_) t_ns_ = rows_ns_.front();
    begun_ = true;
    if (t_ns_ > rows_ns_.back()) return false;
    const std::size_t next = row_ + 1;
    if (next < rows_ns_.size() && rows_ns_[next] > t_ns_ &&
        t_ns_ - rows_ns_[row_] > kLongestHeldNs) {
      skipped_ns_ += rows_ns_[next] - t_ns_;
      t_ns_ = rows_ns_[next];
    }
    while (row_ + 1 < rows_ns_.size() && rows_ns_[row_ + 1] <= t_ns_) ++row_;
    return true;
  }

  [[nodiscard]] std::int64_t t_ns() const { return t_ns_; }
  [[nodiscard]] std::size_t row() const { return row_; }
  [[nodiscard]] std::int64_t skipped_ns() const { return skipped_ns_; }

 private:
  const std::vector<std::int64_t>& rows_ns_;
  std::int64_t t_ns_ = 0;
  std::int64_t skipped_ns_ = 0;
  std::size_t row_ = 0;
  bool begun_ = false;
};

class RecordingSource final : public RobotSource {
 public:
  explicit RecordingSource(const Recording& recording)
      : recording_(recording), clock_(recording.t_ns) {
    ReplayClock ahead(recording.t_ns);
    while (ahead.advance()) ++cycles_;
    skipped_ns_ = ahead.skipped_ns();
    const auto entries = core::catalogue();
    for (std::size_t i = 0; i < entries.size(); ++i) {
      columns_[i] = recording.column(entries[i].name).value_or(-1);
    }
    for (std::size_t j = 0; j < truth_columns_.size(); ++j) {
      // Without desired joints, the measured ones are what was commanded.
      Eigen::Index& desired = columns_[core::catalogue_index(core::RavenField::kJposD, j)];
      if (desired < 0) desired = columns_[core::catalogue_index(core::RavenField::kJpos, j)];
      truth_columns_[j] =
          recording.column(record::Role::kJointTruth, core::kSlotNames[j]).value_or(-1);
    }
  }

  [[nodiscard]] std::string arm() const override {
    const auto named = recording_.meta.find("arm");
    return named == recording_.meta.end() ? std::string() : named->second;
  }

  [[nodiscard]] std::int64_t cycles() const override { return cycles_; }
  [[nodiscard]] std::int64_t skipped_ns() const override { return skipped_ns_; }

  void rest(ravencal_state& state) override { fill(recording_.t_ns.front(), state); }

  void begin(ravencal_state& state) override {
    clock_.advance();
    fill(clock_.t_ns(), state);
  }

  /// A recording holds published states only: what the hook sees of the last cycle is the plugin's
  /// latch.
  void end(ravencal_state& state) override { fill(clock_.t_ns(), state); }

  [[nodiscard]] Joints truth_ji() const override {
    Joints truth_ji{};
    for (std::size_t j = 0; j < truth_ji.size(); ++j) truth_ji[j] = value(truth_columns_[j], kNan);
    return truth_ji;
  }

 private:
  [[nodiscard]] double value(Eigen::Index column, double absent) const {
    return column < 0 ? absent
                      : recording_.samples(static_cast<Eigen::Index>(clock_.row()), column);
  }

  void fill(std::int64_t t_ns, ravencal_state& state) const {
    constexpr std::size_t kRunlevel = core::catalogue_index(core::RavenField::kRunlevel, 0);
    plugin_host::CatalogueValues values;
    for (std::size_t i = 0; i < values.size(); ++i) {
      values[i] = value(columns_[i], i == kRunlevel ? static_cast<double>(core::kPedalDown) : 0.0);
    }
    plugin_host::fill_state(values, t_ns, true, state);
  }

  const Recording& recording_;
  std::array<Eigen::Index, core::kCatalogueSize> columns_{};
  std::array<Eigen::Index, RAVENCAL_JOINTS> truth_columns_{};
  ReplayClock clock_;
  std::int64_t cycles_ = 0;
  std::int64_t skipped_ns_ = 0;
};

}  // namespace

core::Result<std::unique_ptr<RobotSource>> make_recording_source(
    const Recording& recording, std::span<const model::FeatureSpec> features) {
  if (recording.rows() == 0) {
    return core::Error{core::ErrorCode::kData, fmt::format("{}: has no rows", recording.source)};
  }
  for (const model::FeatureSpec& feature : features) {
    if (!recording.column(feature.channel)) {
      return core::Error{core::ErrorCode::kData,
                         fmt::format("{}: has no channel '{}', which the weights need",
                                     recording.source, feature.channel)};
    }
  }
  return std::unique_ptr<RobotSource>(std::make_unique<RecordingSource>(recording));
}

}  // namespace ravencal::host
