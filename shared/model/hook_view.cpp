// SPDX-License-Identifier: Apache-2.0
#include "model/hook_view.hpp"

#include <algorithm>
#include <limits>
#include <vector>

#include "core/catalogue.hpp"
#include "core/constants.hpp"

namespace ravencal::model {
namespace {

constexpr const char* kKey = "inputs";  // of a model's provenance
constexpr const char* kAtHook = "as seen at the plugin's hook (train --latched)";
constexpr double kLongestGapRows = 10.0;

std::vector<Eigen::Index> latched_columns(const record::Recording& recording) {
  std::vector<Eigen::Index> columns;
  for (std::size_t i = 0; i < recording.channels.size(); ++i) {
    const auto index = core::catalogue_index_of(recording.channels[i].name);
    if (index && core::is_cycle_old_at_hook(core::catalogue()[*index].field)) {
      columns.push_back(static_cast<Eigen::Index>(i));
    }
  }
  return columns;
}

/// Share of the row before in the values of one cycle ago, for every row; NaN where it is unknown.
std::vector<double> shares_of_row_before(const record::Recording& recording) {
  const double period_s = row_period_s(recording);
  std::vector<double> shares(recording.t_ns.size(), std::numeric_limits<double>::quiet_NaN());
  for (std::size_t row = 1; row < shares.size(); ++row) {
    const double gap_s =
        static_cast<double>(recording.t_ns[row] - recording.t_ns[row - 1]) * core::kSecondsPerNs;
    if (gap_s <= 0.0 || gap_s > kLongestGapRows * period_s) continue;
    shares[row] = std::min(1.0, kControlCycleS / gap_s);
  }
  for (const record::Event& event : recording.events) {
    if (event.kind != "episode") continue;
    const auto row = std::lower_bound(recording.t_ns.begin(), recording.t_ns.end(), event.t_ns);
    if (row == recording.t_ns.end()) continue;
    shares[static_cast<std::size_t>(row - recording.t_ns.begin())] =
        std::numeric_limits<double>::quiet_NaN();
  }
  return shares;
}

}  // namespace

record::Recording as_seen_at_hook(record::Recording recording) {
  const std::vector<double> shares = shares_of_row_before(recording);
  for (const Eigen::Index column : latched_columns(recording)) {
    auto values = recording.samples.col(column);
    for (Eigen::Index row = recording.rows() - 1; row >= 0; --row) {
      const double share = shares[static_cast<std::size_t>(row)];
      const double before = row > 0 ? values[row - 1] : values[row];
      // Not the sum of shares where that is the row before itself: its last bit would be lost.
      values[row] = share == 1.0 ? before : values[row] + share * (before - values[row]);
    }
  }
  return recording;
}

bool is_trained_at_hook(const CalibrationModel& model) {
  const auto entry = model.provenance.find(kKey);
  return entry != model.provenance.end() && entry->second == kAtHook;
}

void set_trained_at_hook(CalibrationModel& model) { model.provenance[kKey] = kAtHook; }

core::Result<FeatureMatrix> inputs_of(const CalibrationModel& model,
                                      const record::Recording& recording) {
  if (!is_trained_at_hook(model)) {
    return feature_matrix(model.features, recording, model.row_period_s);
  }
  return feature_matrix(model.features, as_seen_at_hook(recording), model.row_period_s);
}

}  // namespace ravencal::model
