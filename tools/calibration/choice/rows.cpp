// SPDX-License-Identifier: Apache-2.0
#include "choice/rows.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "learn/dataset.hpp"
#include "learn/motion_range.hpp"
#include "record/homing.hpp"

namespace ravencal::choice {
namespace {

using record::Recording;

/// Numbers the sessions: each homing begins one, and so does a recording that has any.
class Sessions {
 public:
  void begin(const Recording& recording) {
    times_ns_.clear();
    for (const record::Event& event : recording.events) {
      if (record::is_homing(event)) times_ns_.push_back(event.t_ns);
    }
    std::sort(times_ns_.begin(), times_ns_.end());
    first_ = next_;
    next_ += static_cast<int>(times_ns_.size()) + 1;
  }
  /// Counted alike whether or not the recording has a homing.
  [[nodiscard]] int own_at(std::int64_t t_ns) const {
    const auto after = std::upper_bound(times_ns_.begin(), times_ns_.end(), t_ns);
    return first_ + static_cast<int>(after - times_ns_.begin());
  }
  /// Recordings without a homing share session 0.
  [[nodiscard]] int at(std::int64_t t_ns) const { return times_ns_.empty() ? 0 : own_at(t_ns); }

 private:
  std::vector<std::int64_t> times_ns_;
  int first_ = 0;
  int next_ = 1;
};

core::Status every_output_has_rows(const learn::Dataset& data,
                                   std::span<const model::OutputSpec> outputs) {
  for (std::size_t k = 0; k < outputs.size(); ++k) {
    const auto known = data.errors.col(static_cast<Eigen::Index>(k)).array().isFinite().count();
    if (known == 0) {
      return core::data_error(fmt::format(
          "joint {}: no row has its truth, its estimate and every input; of all rows {} lack the "
          "truth or the estimate, {} lack an input; `ravencal info` shows which channels are lost, "
          "--features and --joints leave them out",
          outputs[k].joint, data.rows_without_truth, data.rows_without_feature));
    }
    RAVENCAL_RETURN_IF_ERROR(
        learn::check_row_count(fmt::format("joint {}", outputs[k].joint), known, 0));
  }
  return {};
}

}  // namespace

core::Result<Rows> make_rows(std::span<const model::FeatureSpec> features,
                             std::span<const model::OutputSpec> outputs,
                             std::span<const Recording* const> recordings, double row_period_s) {
  Eigen::Index all = 0;
  for (const Recording* recording : recordings) all += recording->rows();
  const Eigen::Index stride = std::max<Eigen::Index>(1, (all + kMostRows - 1) / kMostRows);
  RAVENCAL_ASSIGN_OR_RETURN(learn::Dataset data,
                            learn::make_dataset(features, outputs, recordings, row_period_s,
                                                {.stride = stride, .some_truth = true}));
  RAVENCAL_RETURN_IF_ERROR(every_output_has_rows(data, outputs));
  Rows rows;
  rows.inputs = std::move(data.features);
  rows.errors = std::move(data.errors);
  rows.without_truth = data.rows_without_truth;
  rows.without_input = data.rows_without_feature;
  rows.speeds.resizeLike(rows.errors);
  rows.efforts.resizeLike(rows.errors);
  rows.loads.resizeLike(rows.errors);
  Sessions sessions;
  std::size_t i = 0;
  for (std::size_t r = 0; r < recordings.size(); ++r) {
    const Eigen::MatrixXd speeds = learn::joint_speeds(outputs, *recordings[r]);
    const Eigen::MatrixXd efforts = learn::joint_efforts(outputs, *recordings[r]);
    const Eigen::MatrixXd loads = learn::joint_loads(outputs, *recordings[r]);
    sessions.begin(*recordings[r]);
    for (; i < data.origins.size() && data.origins[i].recording == r; ++i) {
      const Eigen::Index row = data.origins[i].row;
      rows.speeds.row(static_cast<Eigen::Index>(i)) = speeds.row(row).cwiseAbs();
      rows.efforts.row(static_cast<Eigen::Index>(i)) = efforts.row(row).cwiseAbs();
      rows.loads.row(static_cast<Eigen::Index>(i)) = loads.row(row).cwiseAbs();
      rows.recording.push_back(static_cast<int>(r));
      const std::int64_t t_ns = recordings[r]->t_ns[static_cast<std::size_t>(row)];
      rows.session.push_back(sessions.at(t_ns));
      rows.own_session.push_back(sessions.own_at(t_ns));
    }
  }
  return rows;
}

}  // namespace ravencal::choice
