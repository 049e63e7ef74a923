// SPDX-License-Identifier: Apache-2.0
#include "diagnose/free_run/fit.hpp"

#include <ceres/ceres.h>
#include <ceres/jet.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "diagnose/effects/effect_kind.hpp"
#include "diagnose/effects/nominal.hpp"
#include "diagnose/fit/derived_seed.hpp"
#include "diagnose/fit/standard_normal.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using physics::field_of;

constexpr std::size_t kMostWindows = 80;
constexpr int kSamplesPerWindow = 25;
constexpr int kStarts = 4;
constexpr int kDraws = 400;
constexpr std::size_t kGroups = 20;

/// The same numbers in another number type.
template <typename T>
physics::DriveNumbers<T> converted(const physics::DriveNumbers<double>& n) {
  return {T(n.inertia),
          T(n.weight_scale),
          T(n.torque_ratio),
          T(n.level),
          T(n.load_share),
          T(n.stribeck_extra),
          T(n.stribeck_velocity),
          T(n.presliding),
          T(n.viscous),
          T(n.asymmetry),
          T(n.asymmetric_level),
          T(n.ripple),
          T(n.ripple_order),
          T(n.ripple_phase),
          T(n.offset)};
}

template <typename T>
physics::DriveNumbers<T> numbers_at(const physics::DriveNumbers<double>& start,
                                    const std::vector<DriveHandle>& handles, const T* x) {
  using std::exp;
  physics::DriveNumbers<T> n = converted<T>(start);
  for (std::size_t h = 0; h < handles.size(); ++h) {
    const DriveHandle& handle = handles[h];
    field_of(n, handle.field) =
        handle.positive ? T(handle.value) * exp(x[h]) : T(handle.value) + handle.scale * x[h];
  }
  return n;
}

/// Errors of one window at evenly spread samples, each over `scale`.
class WindowCost final : public ceres::CostFunction {
 public:
  WindowCost(const FreeRun& run, const physics::DriveNumbers<double>& start,
             const std::vector<DriveHandle>& handles, const FreeRunWindow& window, double scale)
      : run_(run), start_(start), handles_(handles), window_(window) {
    const Index samples = window.last - window.first - 1;
    stride_ = std::max<Index>(1, samples / kSamplesPerWindow);
    const auto count = static_cast<int>(samples / stride_);
    scale_ = scale * std::sqrt(static_cast<double>(count));
    set_num_residuals(count);
    mutable_parameter_block_sizes()->push_back(static_cast<int>(handles.size()));
  }

  bool Evaluate(double const* const* x, double* residuals, double** jacobians) const override {
    if (jacobians == nullptr || jacobians[0] == nullptr) {
      visit(x[0], [&](Index i, double error) { residuals[i] = error; });
      return true;
    }
    // Derivatives that nobody asks for cost as much as the others.
    if (handles_.size() <= 4)
      differentiate<4>(x[0], residuals, jacobians[0]);
    else if (handles_.size() <= 8)
      differentiate<8>(x[0], residuals, jacobians[0]);
    else
      differentiate<physics::kDriveFields>(x[0], residuals, jacobians[0]);
    for (Index i = 0; i < num_residuals(); ++i) {
      if (!std::isfinite(residuals[i])) return false;
    }
    return true;
  }

 private:
  template <int kWidth>
  void differentiate(const double* x, double* residuals, double* jacobian) const {
    using Jet = ceres::Jet<double, kWidth>;
    const auto width = static_cast<Index>(handles_.size());
    std::array<Jet, kWidth> at;
    for (Index h = 0; h < width; ++h)
      at[static_cast<std::size_t>(h)] = Jet(x[h], static_cast<int>(h));
    visit(at.data(), [&](Index i, const Jet& error) {
      residuals[i] = error.a;
      for (Index h = 0; h < width; ++h) jacobian[i * width + h] = error.v[h];
    });
  }

  template <typename T, typename Use>
  void visit(const T* x, Use&& use) const {
    const Series& s = run_.series();
    run_.run(numbers_at(start_, handles_, x), window_, [&](Index row, const T& position) {
      const Index sample = row - window_.first;
      if (sample % stride_ != 0 || sample / stride_ > num_residuals()) return;
      use(sample / stride_ - 1, T((position - s.motion.q[row]) / scale_));
    });
  }

  const FreeRun& run_;
  const physics::DriveNumbers<double>& start_;
  const std::vector<DriveHandle>& handles_;
  FreeRunWindow window_;
  Index stride_ = 1;
  double scale_ = 1.0;
};

/// Keeps a handle near its start as far as windows do not say otherwise.
struct Prior {
  std::size_t handle;
  double centre;
  double deviation;

  template <typename T>
  bool operator()(T const* const* x, T* residual) const {
    residual[0] = (x[0][handle] - centre) / deviation;
    return true;
  }
};

struct Solution {
  std::vector<double> x;
  double cost = 0.0;
};

Solution solve(const FreeRun& run, const physics::DriveNumbers<double>& start,
               const std::vector<DriveHandle>& handles, const std::vector<FreeRunWindow>& windows,
               double scale, std::vector<double> x, int iterations) {
  ceres::Problem problem;
  const auto width = static_cast<int>(handles.size());
  for (const FreeRunWindow& w : windows) {
    // A window in which the joint sticks on one side only must not decide.
    problem.AddResidualBlock(new WindowCost(run, start, handles, w, scale),
                             new ceres::SoftLOneLoss(1.0), x.data());
  }
  for (std::size_t h = 0; h < handles.size(); ++h) {
    auto* cost = new ceres::DynamicAutoDiffCostFunction<Prior, physics::kDriveFields>(
        new Prior{h, handles[h].centre, handles[h].prior});
    cost->AddParameterBlock(width);
    cost->SetNumResiduals(1);
    problem.AddResidualBlock(cost, nullptr, x.data());
    problem.SetParameterLowerBound(x.data(), static_cast<int>(h),
                                   handles[h].centre - handles[h].bound);
    problem.SetParameterUpperBound(x.data(), static_cast<int>(h),
                                   handles[h].centre + handles[h].bound);
  }
  ceres::Solver::Options options;
  options.max_num_iterations = iterations;
  options.linear_solver_type = ceres::DENSE_QR;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  return {std::move(x), summary.final_cost};
}

/// The best of several starts, polished.
Solution best_solution(const FreeRun& run, const physics::DriveNumbers<double>& start,
                       const std::vector<DriveHandle>& handles,
                       const std::vector<FreeRunWindow>& windows, double scale,
                       std::uint64_t seed) {
  std::mt19937_64 engine(seed);
  Solution best;
  for (int k = 0; k < kStarts; ++k) {
    std::vector<double> x(handles.size(), 0.0);
    for (std::size_t h = 0; h < handles.size() && k > 0; ++h) {
      const double uniform = static_cast<double>(engine() >> 11U) * 0x1p-53;
      x[h] = handles[h].centre + (2.0 * uniform - 1.0) * 0.6 * handles[h].bound;
    }
    Solution trial = solve(run, start, handles, windows, scale, std::move(x), 8);
    if (k == 0 || trial.cost < best.cost) best = std::move(trial);
  }
  return solve(run, start, handles, windows, scale, best.x, 30);
}

/// Neighbouring windows share their noise: sums over groups of them, about kGroups in number.
template <typename T>
std::vector<T> grouped(const std::vector<T>& parts) {
  const std::size_t size = std::max<std::size_t>(1, parts.size() / kGroups);
  std::vector<T> sums;
  for (std::size_t k = 0; k < parts.size(); ++k) {
    if (k % size == 0 && (k + size <= parts.size() || sums.empty()))
      sums.push_back(parts[k]);
    else
      sums.back() += parts[k];
  }
  return sums;
}

/// Draws of x: groups of windows with replacement, one Gauss-Newton step each.
MatrixXd bootstrap(const FreeRun& run, const physics::DriveNumbers<double>& start,
                   const std::vector<DriveHandle>& handles,
                   const std::vector<FreeRunWindow>& windows, double scale,
                   const std::vector<double>& x, std::uint64_t seed) {
  const auto width = static_cast<Index>(handles.size());
  std::vector<MatrixXd> curvature;
  std::vector<VectorXd> slope;
  for (const FreeRunWindow& w : windows) {
    const WindowCost cost(run, start, handles, w, scale);
    VectorXd r(cost.num_residuals());
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> j(r.size(), width);
    const double* at = x.data();
    double* jacobian = j.data();
    if (!cost.Evaluate(&at, r.data(), &jacobian)) continue;
    const double weight = 1.0 / std::sqrt(1.0 + r.squaredNorm());  // of SoftLOneLoss
    curvature.push_back(weight * j.transpose() * j);
    slope.push_back(weight * j.transpose() * r);
  }
  curvature = grouped(curvature);
  slope = grouped(slope);
  MatrixXd draws(kDraws, width);
  std::mt19937_64 engine(seed);
  const VectorXd centre = Eigen::Map<const VectorXd>(x.data(), width);
  for (int d = 0; d < kDraws; ++d) {
    MatrixXd h = MatrixXd::Zero(width, width);
    VectorXd g = VectorXd::Zero(width);
    for (std::size_t k = 0; k < curvature.size(); ++k) {
      const std::size_t pick = engine() % curvature.size();
      h += curvature[pick];
      g += slope[pick];
    }
    for (Index p = 0; p < width; ++p) {
      const double precision = std::pow(handles[static_cast<std::size_t>(p)].prior, -2.0);
      h(p, p) += precision;
      // The prior's own centre is as uncertain as it says.
      const double normal = standard_normal(engine);
      const DriveHandle& handle = handles[static_cast<std::size_t>(p)];
      g[p] += precision * (centre[p] - handle.centre - normal * handle.prior);
    }
    draws.row(d) = (centre - h.ldlt().solve(g)).transpose();
  }
  return draws;
}

/// Where a fit of that number starts; 0: the drive is without it.
double start_of(const DriveParameter& p, const EffectKind& kind,
                const physics::DriveNumbers<double>& n, const physics::Joint& joint,
                bool has_weight) {
  switch (p.field) {
    case physics::DriveField::kWeight:
      return has_weight ? n.weight_scale : 0.0;
    case physics::DriveField::kPresliding:
      return joint.parameter(kind.id(), p.parameter);
    case physics::DriveField::kRipplePhase:
      return n.ripple != 0.0 ? 1.0 : 0.0;
    default:
      return field_of(n, p.field);
  }
}

VectorXd window_squares(const std::vector<std::vector<double>>& errors) {
  VectorXd squares(static_cast<Index>(errors.size()));
  for (std::size_t w = 0; w < errors.size(); ++w)
    squares[static_cast<Index>(w)] = std::pow(rms_of({errors[w]}), 2);
  return squares;
}

}  // namespace

double DriveHandle::at(double x) const {
  return positive ? value * std::exp(x) : value + scale * x;
}

std::vector<DriveHandle> drive_handles(const physics::DriveNumbers<double>& n,
                                       const physics::DriveNumbers<double>& nominal,
                                       const physics::Joint& joint, bool has_weight,
                                       const std::vector<std::string>& named) {
  std::vector<DriveHandle> handles;
  for (const EffectKind* kind : effect_kinds()) {
    for (const DriveParameter& p : kind->drive_parameters()) {
      const double value = start_of(p, *kind, n, joint, has_weight);
      if (value == 0.0 || (p.positive && value < 0.0)) continue;
      const std::string parameter(p.parameter);
      const bool free =
          std::find(named.begin(), named.end(), kind->id() + "." + parameter) != named.end();
      const double tolerance =
          free ? 0.7 : std::max(1e-4, tolerance_of(joint, kind->id(), parameter));
      DriveHandle handle{p.field, kind->id(), parameter, value, std::abs(value), p.positive};
      handle.prior = tolerance;
      handle.bound = tolerance;
      const double centre = field_of(nominal, p.field);
      if (!free && p.positive && centre > 0.0) handle.centre = std::log(centre / value);
      // What the screening has moved beyond its tolerance stays where it is.
      handle.centre = std::clamp(handle.centre, -0.9 * tolerance, 0.9 * tolerance);
      if (p.field == physics::DriveField::kRipplePhase) handle.value = n.ripple_phase;
      handles.push_back(handle);
    }
  }
  std::stable_sort(handles.begin(), handles.end(),
                   [](const DriveHandle& a, const DriveHandle& b) { return a.field < b.field; });
  const double effort = n.level + std::abs(n.offset) + 1e-9;
  handles.push_back({physics::DriveField::kOffset, "", "", n.offset, effort, false, 0.0, 0.5, 2.0});
  return handles;
}

DriveFit fit_drive(const FreeRun& run, const physics::DriveNumbers<double>& start,
                   std::vector<DriveHandle> handles, std::uint64_t seed) {
  DriveFit fit;
  fit.handles = std::move(handles);
  fit.x.assign(fit.handles.size(), 0.0);
  fit.numbers = start;
  const std::vector<FreeRunWindow> all = free_run_windows(run.series(), FreeRunRows::kTraining);
  if (!run.possible() || all.size() < 6) return fit;
  const std::size_t stride = (all.size() + kMostWindows - 1) / kMostWindows;
  std::vector<FreeRunWindow> used, half, judge;
  for (std::size_t w = 0; w < all.size(); w += stride) {
    used.push_back(all[w]);
    ((w / stride) % 2 == 0 ? half : judge).push_back(all[w]);
  }
  const double scale = std::max(rms_of(free_run_errors(run, start, used)), 1e-12);
  const Solution deciding =
      best_solution(run, start, fit.handles, half, scale, derived_seed(seed, "starts"));
  const auto before = free_run_errors(run, start, judge);
  const auto after = free_run_errors(run, numbers_at(start, fit.handles, deciding.x.data()), judge);
  fit.judged_before = rms_of(before);
  fit.judged_after = rms_of(after);
  fit.judged_windows = window_squares(fit.better() ? after : before);
  if (!fit.better()) return fit;
  fit.x = solve(run, start, fit.handles, used, scale, deciding.x, 30).x;
  fit.numbers = numbers_at(start, fit.handles, fit.x.data());
  const double left = std::max(rms_of(free_run_errors(run, fit.numbers, used)), 1e-12);
  fit.draws =
      bootstrap(run, start, fit.handles, used, left, fit.x, derived_seed(seed, "bootstrap"));
  return fit;
}

}  // namespace ravencal::diagnose
