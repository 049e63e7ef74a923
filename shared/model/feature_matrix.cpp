// SPDX-License-Identifier: Apache-2.0
#include "model/feature_matrix.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/median.hpp"
#include "model/feature_state.hpp"
#include "model/mean_gain.hpp"

namespace ravencal::model {
namespace {

/// Columns of the recording that features use, and the features in terms of them.
struct Plan {
  std::vector<Eigen::Index> columns;
  std::vector<FeatureOp> ops;
};

core::Error no_period(const FeatureSpec& feature, const record::Recording& recording) {
  return {core::ErrorCode::kData,
          fmt::format("{}: its rows carry no time, which the mean '{}' needs", recording.source,
                      feature.text())};
}

/// Finds the recording's columns of channels, and remembers those that it lacks.
class Columns {
 public:
  explicit Columns(const record::Recording& recording) : recording_(recording) {}

  /// Index of the channel among the columns used; any if the recording lacks it.
  std::uint32_t source_of(const std::string& name) {
    const auto channel = std::find_if(recording_.channels.begin(), recording_.channels.end(),
                                      [&](const record::Channel& c) { return c.name == name; });
    if (channel == recording_.channels.end()) {
      if (std::find(missing_.begin(), missing_.end(), name) == missing_.end()) {
        missing_.push_back(name);
      }
      return 0;
    }
    const Eigen::Index column = channel - recording_.channels.begin();
    auto source = std::find(used_.begin(), used_.end(), column);
    if (source == used_.end()) source = used_.insert(source, column);
    return static_cast<std::uint32_t>(source - used_.begin());
  }

  core::Result<std::vector<Eigen::Index>> take() {
    if (missing_.empty()) return std::move(used_);
    return core::Error{core::ErrorCode::kData,
                       fmt::format("{}: lacks {} channel(s) that the model needs: {}",
                                   recording_.source, missing_.size(), fmt::join(missing_, ", "))};
  }

 private:
  const record::Recording& recording_;
  std::vector<Eigen::Index> used_;
  std::vector<std::string> missing_;
};

core::Result<Plan> make_plan(std::span<const FeatureSpec> features,
                             const record::Recording& recording, double rows_per_lag,
                             double tick_s) {
  Plan plan;
  Columns columns(recording);
  for (const FeatureSpec& feature : features) {
    FeatureOp op;
    op.source = columns.source_of(feature.channel);
    op.transform = feature.transform;
    op.lag_ticks =
        static_cast<std::uint32_t>(std::max(1L, std::lround(feature.lag_rows * rows_per_lag)));
    op.half_width = feature.play_half_width;
    if (is_mean(feature.transform) && recording.rows() > 1) {
      if (!(tick_s > 0.0)) return no_period(feature, recording);
      op.gain = mean_gain(tick_s, static_cast<double>(feature.time_constant_s));
    }
    if (is_travel_mean(feature.transform)) {
      op.travel = feature.travel_si;
      op.along = columns.source_of(feature.along);
    }
    plan.ops.push_back(op);
  }
  RAVENCAL_ASSIGN_OR_RETURN(plan.columns, columns.take());
  return plan;
}

/// Rows at which memory starts anew.
std::vector<Eigen::Index> episode_rows(const record::Recording& recording) {
  std::vector<Eigen::Index> rows;
  for (const record::Event& event : recording.events) {
    if (event.kind != "episode") continue;
    const auto row = std::lower_bound(recording.t_ns.begin(), recording.t_ns.end(), event.t_ns);
    rows.push_back(row - recording.t_ns.begin());
  }
  std::sort(rows.begin(), rows.end());
  return rows;
}

}  // namespace

double row_period_s(const record::Recording& recording) {
  std::vector<std::int64_t> steps;
  for (std::size_t i = 1; i < recording.t_ns.size(); ++i) {
    steps.push_back(recording.t_ns[i] - recording.t_ns[i - 1]);
  }
  if (steps.empty()) return 0.0;
  return static_cast<double>(core::upper_median(std::move(steps))) * 1e-9;
}

core::Result<FeatureMatrix> feature_matrix(std::span<const FeatureSpec> features,
                                           const record::Recording& recording, double row_period) {
  const double period = row_period_s(recording);
  const double rows_per_lag = row_period > 0.0 && period > 0.0 ? row_period / period : 1.0;
  const double tick_s = period > 0.0 ? period : row_period;
  RAVENCAL_ASSIGN_OR_RETURN(const Plan plan, make_plan(features, recording, rows_per_lag, tick_s));
  std::vector<float> memory(FeatureState::memory_floats(plan.ops, plan.columns.size()));
  FeatureState state(plan.ops, plan.columns.size(), memory);
  std::vector<float> sources(plan.columns.size());
  FeatureMatrix matrix(recording.rows(), static_cast<Eigen::Index>(features.size()));
  const std::vector<Eigen::Index> episodes = episode_rows(recording);
  auto episode = episodes.begin();
  for (Eigen::Index row = 0; row < recording.rows(); ++row) {
    for (; episode != episodes.end() && *episode <= row; ++episode) state.reset();
    for (std::size_t i = 0; i < sources.size(); ++i) {
      sources[i] = static_cast<float>(recording.samples(row, plan.columns[i]));
    }
    state.advance(sources, {matrix.row(row).data(), features.size()});
  }
  return matrix;
}

}  // namespace ravencal::model
