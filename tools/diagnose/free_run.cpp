// SPDX-License-Identifier: Apache-2.0
#include "diagnose/free_run.hpp"

#include <ceres/ceres.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "diagnose/effects/shapes.hpp"
#include "diagnose/plant_effort.hpp"
#include "physics/effects/bristle_friction.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double kLongestStep_s = 1e-3;

struct Window {
  Index first = 0;
  Index last = 0;  ///< one past the end
};

std::vector<Window> windows_of(const Series& s, FreeRunRows rows) {
  std::vector<Window> windows;
  const auto usable = [&](Index i) {
    const auto n = static_cast<std::size_t>(i);
    return s.valid[n] != 0 && (s.held_out[n] != 0) == (rows == FreeRunRows::kHeldOut);
  };
  Index first = 0;
  while (first < s.rows()) {
    Index last = first;
    while (last < s.rows() && usable(last) && s.t_s[last] - s.t_s[first] < kFreeRunWindow_s &&
           (last == first || s.fresh[static_cast<std::size_t>(last)] == 0)) {
      ++last;
    }
    const bool whole = last > first + 5 && last < s.rows() &&
                       s.t_s[last - 1] - s.t_s[first] > 0.9 * kFreeRunWindow_s;
    if (whole) windows.push_back({first, last});
    first = std::max(last, first + 1);
  }
  return windows;
}

/// One joint's drive as a rigid body with the plant's friction and load.
class Drive {
 public:
  Drive(const Series& s, const physics::Plant& plant, const physics::Joint& joint)
      : s_(s),
        inertia_(joint.motor_inertia_kg_m2 * joint.reduction * joint.reduction +
                 link_inertia(joint)),
        gain_(1.0 + joint.parameter("torque_constant", "ratio")),
        limit_(joint.parameter("saturation", "limit")),
        viscous_(joint.parameter("viscous_friction", "damping")),
        asymmetry_(0.5 * joint.parameter("asymmetric_friction", "damping_difference")),
        load_share_(joint.parameter("load_dependent_friction", "load_share")),
        ripple_(joint.parameter("torque_ripple", "amplitude")),
        order_(joint.parameter("torque_ripple", "order")),
        phase_(joint.parameter("torque_ripple", "phase")),
        offset_(s.free_offset),
        pendulum_(plant.joints.size() == 1 && joint.kind == physics::JointKind::kRevolute &&
                  s.weight.size() > 0),
        plant_(plant),
        weight_scale_(joint.link.mass_kg > 0.0 && s.nominal_mass_kg > 0.0
                          ? joint.link.mass_kg / s.nominal_mass_kg
                          : 1.0) {
    parameters_.level = std::max(1e-9, joint.parameter("coulomb_friction", "level") +
                                           joint.parameter("joint_friction", "level"));
    parameters_.stribeck_extra = joint.parameter("stribeck_friction", "extra");
    parameters_.stribeck_velocity =
        std::max(1e-9, joint.parameter("stribeck_friction", "velocity"));
    const double displacement = joint.parameter("presliding", "displacement");
    parameters_.presliding = displacement > 0.0 ? displacement : std::max(1e-6, s.rest_width());
    // Keeps a sticking bristle from ringing.
    parameters_.damping =
        std::sqrt(parameters_.level / parameters_.presliding * std::max(inertia_, 1e-9));
  }

  /// Errors of position at the window's samples but the first.
  void run(const Window& w, std::vector<double>& errors) const {
    physics::BristleFriction bristle(parameters_);
    double q = s_.motion.q[w.first];
    double v = s_.motion.v[w.first];
    // Friction as it is after motion in this direction.
    const double side = memory_[w.first];
    bristle.step(side * parameters_.presliding, 1.0);
    for (Index i = w.first; i + 1 < w.last; ++i) {
      const double dt_s = s_.t_s[i + 1] - s_.t_s[i];
      const int steps = std::max(1, static_cast<int>(std::ceil(dt_s / kLongestStep_s - 1e-6)));
      const double h = dt_s / steps;
      for (int k = 0; k < steps; ++k) {
        const double share = (k + 0.5) / steps;
        double effort = (1.0 - share) * s_.recorded[i] + share * s_.recorded[i + 1] - offset_;
        if (limit_ > 0.0) effort = std::clamp(effort, -limit_, limit_);
        const double load = weight(q, i);
        const double scale = 1.0 + load_share_ * std::abs(load) / parameters_.level;
        const double friction = bristle.step(v, h, scale) + asymmetry_ * std::abs(v) +
                                (ripple_ != 0.0 ? ripple_ * std::sin(order_ * q + phase_) : 0.0);
        // Viscous friction implicitly: stable at any damping.
        v = (v + h / inertia_ * (gain_ * effort - friction - load)) /
            (1.0 + h * viscous_ / inertia_);
        q += h * v;
      }
      errors.push_back(q - s_.motion.q[i + 1]);
    }
  }

  void remember(const VectorXd& memory) { memory_ = memory; }

 private:
  [[nodiscard]] double weight(double q, Index row) const {
    if (s_.weight.size() == 0) return 0.0;
    if (!pendulum_) return weight_scale_ * s_.weight[row];
    const VectorXd at = VectorXd::Constant(1, q);
    return holding_efforts(plant_, {at}).front()[0];
  }

  const Series& s_;
  double inertia_, gain_, limit_, viscous_, asymmetry_, load_share_, ripple_, order_, phase_;
  double offset_;
  bool pendulum_;
  const physics::Plant& plant_;
  double weight_scale_;
  physics::BristleFriction::Parameters parameters_;
  VectorXd memory_;
};

std::vector<double> errors_of(const Series& s, const physics::Plant& plant,
                              const std::vector<Window>& windows) {
  const auto index = plant.joint_index(s.joint);
  std::vector<double> errors;
  if (!index || s.recorded.size() == 0) return errors;
  Drive drive(s, plant, plant.joints[*index]);
  drive.remember(direction(s));
  for (const Window& w : windows) drive.run(w, errors);
  return errors;
}

double rms_of(const std::vector<double>& errors) {
  if (errors.empty()) return -1.0;
  double sum = 0.0;
  for (const double e : errors) sum += std::isfinite(e) ? std::min(e * e, 1e6) : 1e6;
  return std::sqrt(sum / static_cast<double>(errors.size()));
}

/// A number of the joint that the free run may change.
struct Handle {
  std::string id, parameter;  ///< empty id: the motor's inertia
};

std::vector<Handle> handles_of(const physics::Joint& joint) {
  std::vector<Handle> handles = {{"", ""}};
  for (const physics::Effect& e : joint.effects) {
    for (const auto& [id, parameter] :
         {std::pair{"coulomb_friction", "level"}, std::pair{"viscous_friction", "damping"},
          std::pair{"asymmetric_friction", "damping_difference"},
          std::pair{"stribeck_friction", "extra"},
          std::pair{"load_dependent_friction", "load_share"}}) {
      if (e.id == id && joint.parameter(id, parameter) != 0.0) handles.push_back({id, parameter});
    }
  }
  return handles;
}

physics::Plant scaled(const physics::Plant& plant, std::size_t joint,
                      const std::vector<Handle>& handles, const double* log_scale) {
  physics::Plant out = plant;
  physics::Joint& j = out.joints[joint];
  for (std::size_t h = 0; h < handles.size(); ++h) {
    const double factor = std::exp(log_scale[h]);
    if (handles[h].id.empty()) {
      j.motor_inertia_kg_m2 *= factor;
      continue;
    }
    for (physics::Effect& e : j.effects) {
      if (e.id == handles[h].id) e.parameters.find(handles[h].parameter)->second *= factor;
    }
  }
  return out;
}

/// Residuals of some windows, every 20th sample; friction switches, hence numeric differences.
struct Cost {
  const Series* series;
  const physics::Plant* plant;
  std::size_t joint;
  const std::vector<Handle>* handles;
  const std::vector<Window>* windows;
  double scale;
  std::size_t stride;

  bool operator()(double const* const* x, double* residuals) const {
    const physics::Plant trial = scaled(*plant, joint, *handles, x[0]);
    const std::vector<double> errors = errors_of(*series, trial, *windows);
    for (std::size_t i = 0, n = 0; i < errors.size(); i += stride, ++n)
      residuals[n] = std::isfinite(errors[i]) ? errors[i] / scale : 1e3;
    // A weak prior keeps what the windows do not fix.
    return true;
  }
};

std::vector<double> fit_scales(const Series& s, const physics::Plant& plant, std::size_t joint,
                               const std::vector<Handle>& handles,
                               const std::vector<Window>& windows) {
  std::vector<double> x(handles.size(), 0.0);
  const std::vector<double> start = errors_of(s, plant, windows);
  constexpr std::size_t kStride = 20;
  const std::size_t count = (start.size() + kStride - 1) / kStride;
  if (count < 4 * handles.size()) return x;
  auto* cost = new ceres::DynamicNumericDiffCostFunction<Cost, ceres::CENTRAL>(
      new Cost{&s, &plant, joint, &handles, &windows, std::max(rms_of(start), 1e-12), kStride});
  cost->AddParameterBlock(static_cast<int>(handles.size()));
  cost->SetNumResiduals(static_cast<int>(count));
  ceres::Problem problem;
  problem.AddResidualBlock(cost, new ceres::SoftLOneLoss(1.0), x.data());
  for (std::size_t h = 0; h < handles.size(); ++h) {
    problem.SetParameterLowerBound(x.data(), static_cast<int>(h), -0.693);
    problem.SetParameterUpperBound(x.data(), static_cast<int>(h), 0.693);
  }
  ceres::Solver::Options options;
  options.max_num_iterations = 25;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  return x;
}

}  // namespace

double free_run_rmse(const Series& drive, const physics::Plant& plant, FreeRunRows rows) {
  return rms_of(errors_of(drive, plant, windows_of(drive, rows)));
}

physics::Plant refitted_in_free_run(const Series& drive, const physics::Plant& plant) {
  const auto index = plant.joint_index(drive.joint);
  std::vector<Window> windows = windows_of(drive, FreeRunRows::kTraining);
  if (!index || windows.size() < 6 || drive.recorded.size() == 0) return plant;
  constexpr std::size_t kMostWindows = 120;
  const std::size_t stride = (windows.size() + kMostWindows - 1) / kMostWindows;
  std::vector<Window> fit;
  std::vector<Window> judge;
  for (std::size_t w = 0; w < windows.size(); w += stride)
    ((w / stride) % 2 == 0 ? fit : judge).push_back(windows[w]);
  const auto handles = handles_of(plant.joints[*index]);
  const std::vector<double> x = fit_scales(drive, plant, *index, handles, fit);
  physics::Plant better = scaled(plant, *index, handles, x.data());
  const double before = rms_of(errors_of(drive, plant, judge));
  const double after = rms_of(errors_of(drive, better, judge));
  return after < 0.95 * before ? better : plant;
}

}  // namespace ravencal::diagnose
