// SPDX-License-Identifier: Apache-2.0
#include "learn/motion_range.hpp"

#include <cmath>
#include <limits>

namespace ravencal::learn {

Eigen::MatrixXd joint_speeds(std::span<const model::OutputSpec> outputs,
                             const record::Recording& recording) {
  Eigen::MatrixXd speeds = Eigen::MatrixXd::Constant(
      recording.rows(), static_cast<Eigen::Index>(outputs.size()), std::nan(""));
  constexpr std::int64_t kSpanNs = 50'000'000;
  for (std::size_t k = 0; k < outputs.size(); ++k) {
    const auto column = recording.column(outputs[k].estimate_channel);
    if (!column) continue;
    Eigen::Index from = 0;
    for (Eigen::Index row = 0; row < recording.rows(); ++row) {
      const auto now = recording.t_ns[static_cast<std::size_t>(row)];
      while (from + 1 < row && now - recording.t_ns[static_cast<std::size_t>(from + 1)] >= kSpanNs)
        ++from;
      const double dt =
          static_cast<double>(now - recording.t_ns[static_cast<std::size_t>(from)]) * 1e-9;
      if (dt <= 0.0) continue;
      speeds(row, static_cast<Eigen::Index>(k)) =
          (recording.samples(row, *column) - recording.samples(from, *column)) / dt;
    }
  }
  return speeds;
}

Eigen::MatrixXd joint_efforts(std::span<const model::OutputSpec> outputs,
                              const record::Recording& recording) {
  Eigen::MatrixXd efforts = Eigen::MatrixXd::Constant(
      recording.rows(), static_cast<Eigen::Index>(outputs.size()), std::nan(""));
  for (std::size_t k = 0; k < outputs.size(); ++k) {
    auto column = recording.column(record::Role::kDriveTorque, outputs[k].joint);
    if (!column) column = recording.column(record::Role::kDriveInput, outputs[k].joint);
    if (column) efforts.col(static_cast<Eigen::Index>(k)) = recording.samples.col(*column);
  }
  return efforts;
}

}  // namespace ravencal::learn
