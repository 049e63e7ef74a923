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

core::Result<Plan> make_plan(std::span<const FeatureSpec> features,
                             const record::Recording& recording, double rows_per_lag,
                             double tick_s) {
  Plan plan;
  std::vector<std::string> missing;
  for (const FeatureSpec& feature : features) {
    const auto channel =
        std::find_if(recording.channels.begin(), recording.channels.end(),
                     [&](const record::Channel& c) { return c.name == feature.channel; });
    if (channel == recording.channels.end()) {
      if (std::find(missing.begin(), missing.end(), feature.channel) == missing.end()) {
        missing.push_back(feature.channel);
      }
      continue;
    }
    const Eigen::Index column = channel - recording.channels.begin();
    auto source = std::find(plan.columns.begin(), plan.columns.end(), column);
    if (source == plan.columns.end()) source = plan.columns.insert(source, column);
    FeatureOp op;
    op.source = static_cast<std::uint32_t>(source - plan.columns.begin());
    op.transform = feature.transform;
    op.lag_ticks =
        static_cast<std::uint32_t>(std::max(1L, std::lround(feature.lag_rows * rows_per_lag)));
    op.half_width = feature.play_half_width;
    if (is_mean(feature.transform) && recording.rows() > 1) {
      if (!(tick_s > 0.0)) return no_period(feature, recording);
      op.gain = mean_gain(tick_s, static_cast<double>(feature.time_constant_s));
    }
    plan.ops.push_back(op);
  }
  if (missing.empty()) return plan;
  return core::Error{core::ErrorCode::kData,
                     fmt::format("{}: lacks {} channel(s) that the model needs: {}",
                                 recording.source, missing.size(), fmt::join(missing, ", "))};
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
