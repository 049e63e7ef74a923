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
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

class RecordingSource final : public RobotSource {
 public:
  explicit RecordingSource(const Recording& recording) : recording_(recording) {
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

  [[nodiscard]] std::int64_t cycles() const override {
    return (recording_.t_ns.back() - recording_.t_ns.front()) / kTickNs + 1;
  }

  void rest(ravencal_state& state) override {
    t_ns_ = recording_.t_ns.front();
    fill(state);
  }

  void begin(ravencal_state& state) override {
    t_ns_ = recording_.t_ns.front() + cycle_++ * kTickNs;
    const auto rows = static_cast<std::size_t>(recording_.rows());
    while (row_ + 1 < rows && recording_.t_ns[row_ + 1] <= t_ns_) ++row_;
    fill(state);
  }

  /// A recording holds published states only: what the hook sees of the last cycle is the plugin's
  /// latch.
  void end(ravencal_state& state) override { fill(state); }

  [[nodiscard]] Joints truth_ji() const override {
    Joints truth_ji{};
    for (std::size_t j = 0; j < truth_ji.size(); ++j) truth_ji[j] = value(truth_columns_[j], kNan);
    return truth_ji;
  }

 private:
  [[nodiscard]] double value(Eigen::Index column, double absent) const {
    return column < 0 ? absent : recording_.samples(static_cast<Eigen::Index>(row_), column);
  }

  void fill(ravencal_state& state) const {
    constexpr std::size_t kRunlevel = core::catalogue_index(core::RavenField::kRunlevel, 0);
    plugin_host::CatalogueValues values;
    for (std::size_t i = 0; i < values.size(); ++i) {
      values[i] = value(columns_[i], i == kRunlevel ? static_cast<double>(core::kPedalDown) : 0.0);
    }
    plugin_host::fill_state(values, t_ns_, true, state);
  }

  const Recording& recording_;
  std::array<Eigen::Index, core::kCatalogueSize> columns_{};
  std::array<Eigen::Index, RAVENCAL_JOINTS> truth_columns_{};
  std::int64_t cycle_ = 0;
  std::size_t row_ = 0;
  std::int64_t t_ns_ = 0;
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
