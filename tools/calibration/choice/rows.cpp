// SPDX-License-Identifier: Apache-2.0
#include "choice/rows.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "learn/dataset.hpp"

namespace ravencal::choice {
namespace {

using record::Recording;

/// Fewer recordings are cut in time.
constexpr std::size_t kFewestRecordings = 4;
constexpr std::size_t kMostParts = 8;
constexpr std::size_t kTimeParts = 5;

/// Share of the rows that are outermost.
constexpr double kOutermostShare = 0.5;

std::vector<Eigen::Index> outermost(const Eigen::MatrixXd& positions) {
  if (positions.size() == 0) return {};
  Eigen::VectorXd distance = Eigen::VectorXd::Zero(positions.rows());
  for (const auto& values : positions.colwise()) {
    const double low = values.minCoeff();
    const double high = values.maxCoeff();
    if (!(high > low)) continue;
    const auto from_middle = (values.array() - 0.5 * (low + high)).abs() / (0.5 * (high - low));
    distance = distance.cwiseMax(from_middle.matrix());
  }
  std::vector<double> sorted(distance.begin(), distance.end());
  const auto inner = (1.0 - kOutermostShare) * static_cast<double>(sorted.size());
  const auto limit = sorted.begin() + static_cast<std::ptrdiff_t>(inner);
  std::nth_element(sorted.begin(), limit, sorted.end());
  std::vector<Eigen::Index> outer;
  for (Eigen::Index row = 0; row < distance.size(); ++row) {
    if (distance[row] > *limit) outer.push_back(row);
  }
  return outer;
}

/// Numbers the homings: each event begins one, and so does a recording that has any.
class Homings {
 public:
  void begin(const Recording& recording) {
    times_ns_.clear();
    for (const record::Event& event : recording.events) {
      if (event.kind == "homing") times_ns_.push_back(event.t_ns);
    }
    std::sort(times_ns_.begin(), times_ns_.end());
    first_ = next_;
    next_ += times_ns_.empty() ? 0 : static_cast<int>(times_ns_.size()) + 1;
  }
  [[nodiscard]] int at(std::int64_t t_ns) const {
    if (times_ns_.empty()) return 0;
    const auto after = std::upper_bound(times_ns_.begin(), times_ns_.end(), t_ns);
    return first_ + static_cast<int>(after - times_ns_.begin());
  }

 private:
  std::vector<std::int64_t> times_ns_;
  int first_ = 0;
  int next_ = 1;  ///< 0 is the one that is shared
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
  Homings homings;
  for (std::size_t r = 0; r < recordings.size(); ++r) {
    RAVENCAL_ASSIGN_OR_RETURN(const Eigen::MatrixXd errors,
                              learn::joint_errors(outputs, *recordings[r]));
    RAVENCAL_ASSIGN_OR_RETURN(const model::FeatureMatrix inputs,
                              model::feature_matrix(features, *recordings[r], row_period_s));
    homings.begin(*recordings[r]);
    for (Eigen::Index row = 0; row < inputs.rows(); row += stride) {
      if (!errors.row(row).array().isFinite().any()) {
        ++rows.without_truth;
      } else if (!inputs.row(row).allFinite()) {
        ++rows.without_input;
      } else {
        rows.inputs.row(kept) = inputs.row(row);
        rows.errors.row(kept++) = errors.row(row);
        rows.recording.push_back(static_cast<int>(r));
        rows.homing.push_back(homings.at(recordings[r]->t_ns[static_cast<std::size_t>(row)]));
      }
    }
  }
  rows.inputs.conservativeResize(kept, Eigen::NoChange);
  rows.errors.conservativeResize(kept, Eigen::NoChange);
  RAVENCAL_RETURN_IF_ERROR(every_output_has_rows(rows, outputs));
  return rows;
}

HeldOut held_out_parts(std::span<const int> recording, const Eigen::MatrixXd& positions) {
  const std::set<int> recordings(recording.begin(), recording.end());
  const auto count = static_cast<Eigen::Index>(recording.size());
  HeldOut parts;
  parts.by_recording = recordings.size() >= kFewestRecordings;
  parts.rows.resize(parts.by_recording ? std::min(recordings.size(), kMostParts) : kTimeParts);
  const auto part_count = static_cast<Eigen::Index>(parts.rows.size());
  for (Eigen::Index row = 0; row < count; ++row) {
    const auto place = std::distance(recordings.begin(),
                                     recordings.find(recording[static_cast<std::size_t>(row)]));
    const Eigen::Index part = parts.by_recording ? place % part_count : row * part_count / count;
    parts.rows[static_cast<std::size_t>(part)].push_back(row);
  }
  parts.rows.push_back(outermost(positions));
  return parts;
}

}  // namespace ravencal::choice
