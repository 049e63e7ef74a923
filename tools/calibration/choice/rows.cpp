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

core::Status every_output_has_rows(const Rows& rows, std::span<const model::OutputSpec> outputs) {
  for (std::size_t k = 0; k < outputs.size(); ++k) {
    const auto known = rows.errors.col(static_cast<Eigen::Index>(k)).array().isFinite().count();
    if (known == 0) {
      return core::data_error(fmt::format(
          "joint {}: no row has its truth, its estimate and every input; of all rows {} lack the "
          "truth or the estimate, {} lack an input; `ravencal info` shows which channels are lost, "
          "--features and --joints leave them out",
          outputs[k].joint, rows.without_truth, rows.without_input));
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
  Rows rows;
  rows.inputs.resize(all / stride + static_cast<Eigen::Index>(recordings.size()),
                     static_cast<Eigen::Index>(features.size()));
  rows.errors.resize(rows.inputs.rows(), static_cast<Eigen::Index>(outputs.size()));
  Eigen::Index kept = 0;
  Sessions sessions;
  rows.speeds.resizeLike(rows.errors);
  rows.efforts.resizeLike(rows.errors);
  for (std::size_t r = 0; r < recordings.size(); ++r) {
    RAVENCAL_ASSIGN_OR_RETURN(const Eigen::MatrixXd errors,
                              learn::joint_errors(outputs, *recordings[r]));
    RAVENCAL_ASSIGN_OR_RETURN(const model::FeatureMatrix inputs,
                              model::feature_matrix(features, *recordings[r], row_period_s));
    const Eigen::MatrixXd speeds = learn::joint_speeds(outputs, *recordings[r]);
    const Eigen::MatrixXd efforts = learn::joint_efforts(outputs, *recordings[r]);
    sessions.begin(*recordings[r]);
    for (Eigen::Index row = 0; row < inputs.rows(); row += stride) {
      if (!errors.row(row).array().isFinite().any()) {
        ++rows.without_truth;
      } else if (!inputs.row(row).allFinite()) {
        ++rows.without_input;
      } else {
        rows.inputs.row(kept) = inputs.row(row);
        rows.speeds.row(kept) = speeds.row(row).cwiseAbs();
        rows.efforts.row(kept) = efforts.row(row).cwiseAbs();
        rows.errors.row(kept++) = errors.row(row);
        rows.recording.push_back(static_cast<int>(r));
        const std::int64_t t_ns = recordings[r]->t_ns[static_cast<std::size_t>(row)];
        rows.session.push_back(sessions.at(t_ns));
        rows.own_session.push_back(sessions.own_at(t_ns));
      }
    }
  }
  rows.inputs.conservativeResize(kept, Eigen::NoChange);
  rows.errors.conservativeResize(kept, Eigen::NoChange);
  rows.speeds.conservativeResize(kept, Eigen::NoChange);
  rows.efforts.conservativeResize(kept, Eigen::NoChange);
  RAVENCAL_RETURN_IF_ERROR(every_output_has_rows(rows, outputs));
  return rows;
}

}  // namespace ravencal::choice
