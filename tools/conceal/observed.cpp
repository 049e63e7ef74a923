// SPDX-License-Identifier: Apache-2.0
#include "conceal/observed.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "record/load.hpp"
#include "record/recording_file.hpp"
#include "simulation/session.hpp"

namespace ravencal::conceal {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double kMean_s = 0.25;

VectorXd means(const VectorXd& column, Index rows) {
  VectorXd out(column.size() / rows);
  for (Index i = 0; i < out.size(); ++i) out[i] = column.segment(i * rows, rows).mean();
  return out;
}

Traces traces_of(const record::Recording& recording, const physics::Plant& plant) {
  const double rate_hz = plant.logger.rate_hz;
  const Index rows = std::max<Index>(1, std::lround(kMean_s * rate_hz));
  const Index count = recording.rows() / rows;
  Traces traces{Eigen::MatrixX3d(count, 3), Eigen::MatrixX3d(count, 3), Eigen::MatrixX3d(count, 3),
                static_cast<double>(rows) / rate_hz};
  for (Index i = 0; i < 3; ++i) {
    const physics::Joint& joint = plant.joints[static_cast<std::size_t>(i)];
    const auto column = [&](record::Role role) -> VectorXd {
      return recording.samples.col(*recording.column(role, joint.name));
    };
    const VectorXd believed = column(record::Role::kJointEstimate);
    traces.position.col(i) = means(believed, rows);
    traces.error.col(i) = means(column(record::Role::kJointTruth) - believed, rows);
    traces.effort.col(i) =
        means(joint.reduction / joint.gearbox_ratio * column(record::Role::kDriveTorque), rows);
  }
  return traces;
}

}  // namespace

core::Result<Traces> observe(const physics::Plant& plant, const trajectory::Trajectory& motion,
                             std::uint64_t seed, const std::filesystem::path& scratch) {
  simulation::SessionOptions options;
  options.seed = seed;
  options.overwrite = true;
  const auto session =
      simulation::record_session(plant, motion, scratch, options, [](double) { return true; });
  if (!session.ok()) return session.error();
  const auto recording = record::load_recording(scratch, {});
  (void)record::remove_recording(scratch);
  if (!recording.ok()) return recording.error();
  return traces_of(*recording, plant);
}

double spread(const VectorXd& column) {
  if (column.size() == 0) return 0.0;
  return std::sqrt((column.array() - column.mean()).square().mean());
}

core::Result<Observed> observe_scatter(const physics::Plant& plant,
                                       const trajectory::Trajectory& motion, std::uint64_t seed,
                                       const std::filesystem::path& scratch) {
  Observed observed;
  RAVENCAL_ASSIGN_OR_RETURN(observed.traces, observe(plant, motion, seed, scratch));
  RAVENCAL_ASSIGN_OR_RETURN(const Traces again, observe(plant, motion, seed + 1, scratch));
  for (Index i = 0; i < 3; ++i) {
    observed.error_scatter[i] =
        spread(again.error.col(i) - observed.traces.error.col(i)) / std::numbers::sqrt2;
    observed.effort_scatter[i] =
        spread(again.effort.col(i) - observed.traces.effort.col(i)) / std::numbers::sqrt2;
  }
  return observed;
}

Visibility visibility_at(std::size_t joint, const Observed& plain, const Traces& changed) {
  const auto i = static_cast<Index>(joint);
  return {spread(changed.error.col(i) - plain.traces.error.col(i)) / plain.error_scatter[i],
          spread(changed.effort.col(i) - plain.traces.effort.col(i)) / plain.effort_scatter[i]};
}

}  // namespace ravencal::conceal
