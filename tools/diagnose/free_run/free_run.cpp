// SPDX-License-Identifier: Apache-2.0
#include "diagnose/free_run/free_run.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "diagnose/effects/shapes.hpp"
#include "physics/plant_effort.hpp"

namespace ravencal::diagnose {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

std::vector<FreeRunWindow> free_run_windows(const Series& s, FreeRunRows rows, double length_s) {
  std::vector<FreeRunWindow> windows;
  const auto usable = [&](Index i) {
    const auto n = static_cast<std::size_t>(i);
    return s.valid[n] != 0 && (s.held_out[n] != 0) == (rows == FreeRunRows::kHeldOut);
  };
  Index first = 0;
  while (first < s.rows()) {
    Index last = first;
    while (last < s.rows() && usable(last) && s.t_s[last] - s.t_s[first] < length_s &&
           (last == first || s.fresh[static_cast<std::size_t>(last)] == 0)) {
      ++last;
    }
    const bool whole =
        last > first + 5 && last < s.rows() && s.t_s[last - 1] - s.t_s[first] > 0.9 * length_s;
    if (whole) windows.push_back({first, last});
    first = std::max(last, first + 1);
  }
  return windows;
}

FreeRun::FreeRun(const Series& drive, const physics::Plant& plant, const VectorXd& found_load)
    : series_(&drive) {
  const auto index = plant.joint_index(drive.joint);
  possible_ = index.has_value() && drive.recorded.size() > 0;
  if (!possible_) return;
  const physics::Joint& joint = plant.joints[*index];
  limit_ = joint.parameter("saturation", "limit");
  side_ = direction(drive);
  beyond_ = drive.others_friction.size() > 0 ? drive.others_friction
                                             : VectorXd(VectorXd::Zero(drive.rows()));
  if (found_load.size() > 0) beyond_ += found_load;
  if (drive.wound.size() > 0)
    beyond_ += joint.parameter("joint_friction", "level") *
               (direction_memory(drive.wound, drive.rest_width(), drive.fresh) - side_);
  pendulum_ = plant.joints.size() == 1 && joint.kind == physics::JointKind::kRevolute &&
              drive.weight.size() > 0 && !joint.external_load;
  if (pendulum_) {
    MatrixXd turned(drive.rows(), 2);
    turned << drive.motion.q.array().sin(), drive.motion.q.array().cos();
    const Eigen::Vector2d fitted = turned.colPivHouseholderQr().solve(drive.weight);
    sine_ = fitted[0];
    cosine_ = fitted[1];
  }
}

physics::DriveNumbers<double> FreeRun::numbers(const physics::Plant& plant) const {
  const std::size_t index = plant.joint_index(series_->joint).value_or(0);
  const physics::Joint& joint = plant.joints[index];
  physics::DriveNumbers<double> n =
      physics::drive_numbers(joint, physics::joint_inertia(plant, index), series_->rest_width());
  if (joint.link.mass_kg > 0.0 && series_->nominal_mass_kg > 0.0)
    n.weight_scale = joint.link.mass_kg / series_->nominal_mass_kg;
  n.offset += series_->free_offset;  // beside the plant's own
  return n;
}

std::vector<std::vector<double>> free_run_errors(const FreeRun& run,
                                                 const physics::DriveNumbers<double>& numbers,
                                                 const std::vector<FreeRunWindow>& windows) {
  std::vector<std::vector<double>> errors;
  for (const FreeRunWindow& w : windows) {
    errors.emplace_back();
    run.run(numbers, w, [&](Index row, double position) {
      errors.back().push_back(position - run.series().motion.q[row]);
    });
  }
  return errors;
}

double rms_of(const std::vector<std::vector<double>>& errors) {
  double sum = 0.0;
  double count = 0.0;
  for (const auto& window : errors) {
    // A run that left for good counts as far off, not as infinity.
    for (const double e : window) sum += std::isfinite(e) ? std::min(e * e, 1e6) : 1e6;
    count += static_cast<double>(window.size());
  }
  return count > 0.0 ? std::sqrt(sum / count) : -1.0;
}

}  // namespace ravencal::diagnose
