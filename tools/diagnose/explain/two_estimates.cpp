// SPDX-License-Identifier: Apache-2.0
//
// Where a model has the laws of the robot, estimates that weigh its errors differently agree; where
// it lacks one, each puts what is missing into other numbers (Hausman 1978).
#include <ceres/ceres.h>
#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "core/median.hpp"
#include "core/side_by_side.hpp"
#include "diagnose/explain/models.hpp"
#include "diagnose/explain/plant_drive.hpp"
#include "diagnose/findings/policy.hpp"
#include "diagnose/findings/quantiles.hpp"
#include "diagnose/findings/verdict.hpp"
#include "diagnose/findings/words.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kWindow_s = 1.0;
constexpr std::size_t kFewestWindows = 20;
constexpr int kIterations = 6;
/// Deviation that an estimator leaves of a prior's: beyond, it says nothing of its own.
constexpr double kMostOfPrior = 0.5;

/// The place in Model::free() of everything that moves this drive.
std::vector<std::size_t> places_of(const std::vector<const Parameter*>& free, std::size_t joint) {
  std::vector<std::size_t> out;
  for (std::size_t k = 0; k < free.size(); ++k) {
    const Parameter& p = *free[k];
    const bool moves = p.reaches == Reaches::kDrive || p.reaches == Reaches::kCable ||
                       p.reaches == Reaches::kLinkLoad || p.reaches == Reaches::kEverything;
    if (p.joint == joint && p.in_plant && !p.recording && moves) out.push_back(k);
  }
  return out;
}

/// Errors of a joint's free runs over the parameters that move it, every window worth one
/// observation.
class FreeRuns {
 public:
  FreeRuns(const Models& models, std::size_t joint, std::vector<Parameter> parameters)
      : training_(models.training),
        state_(models.moved.state_for(models.training)),
        joint_(joint),
        parameters_(std::move(parameters)) {
    std::vector<double> sizes;
    const std::vector<VectorXd> windows = errors_at(start());
    for (const VectorXd& window : windows) sizes.push_back(rms_of(window));
    if (sizes.size() < kFewestWindows) return;
    const double usual = core::upper_median(sizes);
    if (!(usual > 0.0)) return;
    for (std::size_t w = 0; w < windows.size(); ++w) {
      const double beyond = std::max(1.0, sizes[w] / (kHuber * usual));
      const auto rows = static_cast<double>(windows[w].size());
      for (Index i = 0; i < windows[w].size(); ++i) {
        weights_.push_back(1.0 / (usual * std::sqrt(rows * beyond)));
        window_.push_back(static_cast<Index>(w));
      }
    }
    window_count_ = static_cast<Index>(windows.size());
  }

  [[nodiscard]] bool enough() const { return window_count_ > 0; }
  [[nodiscard]] const std::vector<Parameter>& parameters() const { return parameters_; }
  [[nodiscard]] VectorXd start() const {
    VectorXd x(static_cast<Index>(parameters_.size()));
    for (std::size_t k = 0; k < parameters_.size(); ++k)
      x[static_cast<Index>(k)] = parameters_[k].x;
    return x;
  }

  /// Weighted, stacked.
  [[nodiscard]] VectorXd residuals(const VectorXd& x) const {
    VectorXd out(static_cast<Index>(weights_.size()));
    Index at = 0;
    for (const VectorXd& window : errors_at(x))
      for (const double error : window) {
        out[at] = error * weights_[static_cast<std::size_t>(at)];
        ++at;
      }
    return out;
  }

  [[nodiscard]] MatrixXd slopes(const VectorXd& x, const VectorXd& at) const {
    MatrixXd out(at.size(), x.size());
    core::for_each_index(parameters_.size(), training_.threads(), [&](std::size_t k) {
      const Parameter& p = parameters_[k];
      const auto i = static_cast<Index>(k);
      const double step = x[i] + p.step > p.high ? -p.step : p.step;
      VectorXd moved = x;
      moved[i] += step;
      out.col(i) = (residuals(moved) - at) / step;
    });
    return out;
  }

  /// Of x, windows as observations.
  [[nodiscard]] MatrixXd covariance(const VectorXd& x) const {
    const VectorXd left = residuals(x);
    const MatrixXd columns = slopes(x, left);
    MatrixXd priors = MatrixXd::Zero(x.size(), x.size());
    for (Index k = 0; k < x.size(); ++k)
      priors(k, k) = std::pow(parameters_[static_cast<std::size_t>(k)].deviation, -2);
    MatrixXd scores = MatrixXd::Zero(window_count_, x.size());
    for (Index i = 0; i < left.size(); ++i)
      scores.row(window_[static_cast<std::size_t>(i)]) += left[i] * columns.row(i);
    const MatrixXd inverse = (columns.transpose() * columns + priors)
                                 .ldlt()
                                 .solve(MatrixXd::Identity(x.size(), x.size()));
    return inverse * (scores.transpose() * scores + priors) * inverse;
  }

 private:
  static double rms_of(const VectorXd& window) {
    return window.norm() / std::sqrt(static_cast<double>(std::max<Index>(1, window.size())));
  }

  [[nodiscard]] std::vector<VectorXd> errors_at(const VectorXd& x) const {
    State state = state_;
    for (std::size_t k = 0; k < parameters_.size(); ++k) {
      Parameter p = parameters_[k];
      p.x = x[static_cast<Index>(k)];
      p.apply(state);
    }
    return PlantDrive(state.plant, training_, joint_).windows_under_effort(kWindow_s);
  }

  const Likelihood& training_;
  State state_;
  std::size_t joint_;
  std::vector<Parameter> parameters_;
  std::vector<double> weights_;
  std::vector<Index> window_;  ///< of each row
  Index window_count_ = 0;
};

/// Weighted errors and priors, for Ceres.
class Residuals : public ceres::CostFunction {
 public:
  explicit Residuals(const FreeRuns& runs, Index rows) : runs_(runs), rows_(rows) {
    const auto count = static_cast<int>(runs.parameters().size());
    mutable_parameter_block_sizes()->push_back(count);
    set_num_residuals(static_cast<int>(rows) + count);
  }

  bool Evaluate(double const* const* at, double* residuals, double** jacobians) const override {
    const auto count = static_cast<Index>(runs_.parameters().size());
    const VectorXd x = Eigen::Map<const VectorXd>(at[0], count);
    const VectorXd left = runs_.residuals(x);
    Eigen::Map<VectorXd>(residuals, rows_) = left;
    for (Index k = 0; k < count; ++k) {
      const Parameter& p = runs_.parameters()[static_cast<std::size_t>(k)];
      residuals[rows_ + k] = (x[k] - p.mean) / p.deviation;
    }
    if (jacobians == nullptr || jacobians[0] == nullptr) return true;
    Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>> jacobian(
        jacobians[0], rows_ + count, count);
    jacobian.setZero();
    jacobian.topRows(rows_) = runs_.slopes(x, left);
    for (Index k = 0; k < count; ++k)
      jacobian(rows_ + k, k) = 1.0 / runs_.parameters()[static_cast<std::size_t>(k)].deviation;
    return true;
  }

 private:
  const FreeRuns& runs_;
  Index rows_;
};

VectorXd fitted(const FreeRuns& runs) {
  VectorXd x = runs.start();
  ceres::Problem problem;
  problem.AddResidualBlock(new Residuals(runs, runs.residuals(x).size()), nullptr, x.data());
  for (std::size_t k = 0; k < runs.parameters().size(); ++k) {
    const Parameter& p = runs.parameters()[k];
    if (std::isfinite(p.low)) problem.SetParameterLowerBound(x.data(), static_cast<int>(k), p.low);
    if (std::isfinite(p.high))
      problem.SetParameterUpperBound(x.data(), static_cast<int>(k), p.high);
  }
  ceres::Solver::Options options;
  options.max_num_iterations = kIterations;
  options.linear_solver_type = ceres::DENSE_NORMAL_CHOLESKY;
  options.line_search_interpolation_type = ceres::QUADRATIC;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  return x;
}

Interval interval(const Parameter& p, double deviation) {
  const double half = kNormal95 * deviation * std::abs(p.slope());
  return {p.value() - half, p.value() + half};
}

std::string note_of(const TwoEstimates& e) {
  return fmt::format(
      "joint {}'s {} of {} is {} by the efforts along the recorded motion and {} by the motion "
      "under the recorded efforts, further apart than the {} that both leave open: its drive has a "
      "law that the improved plant lacks, and neither value holds elsewhere",
      e.joint, words_of(e.parameter), words_of(e.id), quantity(e.equation_error, e.unit),
      quantity(e.free_run, e.unit), quantity(e.allowed, e.unit));
}

void add_of_joint(const Models& models, std::size_t joint, Report& report) {
  const std::vector<const Parameter*> free = models.moved.free();
  const std::vector<std::size_t> places = places_of(free, joint);
  if (places.empty()) return;
  std::vector<Parameter> parameters;
  for (const std::size_t k : places) parameters.push_back(*free[k]);
  const FreeRuns runs(models, joint, parameters);
  if (!runs.enough()) return;
  const VectorXd x = fitted(runs);
  const MatrixXd covariance = runs.covariance(x);
  for (std::size_t n = 0; n < places.size(); ++n) {
    const auto i = static_cast<Index>(n);
    const auto k = static_cast<Index>(places[n]);
    const Parameter& by_efforts = parameters[n];
    Parameter by_motion = by_efforts;
    by_motion.x = x[i];
    const double of_motion = std::sqrt(std::max(0.0, covariance(i, i)));
    const double of_efforts = std::sqrt(models.moved.judgement.covariance(k, k));
    const bool known = std::max(of_motion, of_efforts) < kMostOfPrior * by_efforts.deviation;
    if (!by_efforts.said || !known || by_efforts.at_bound() || by_motion.at_bound()) continue;
    const double slope = std::abs(by_efforts.slope());
    const double allowed =
        kClear_z * std::hypot(slope * of_motion, slope * of_efforts, deviation_of_form(by_efforts));
    const bool agree = std::abs(by_motion.x - by_efforts.x) * slope <= allowed;
    report.two_estimates.push_back({models.given.joints[joint].name, by_efforts.effect,
                                    by_efforts.name, by_efforts.unit, by_efforts.value(),
                                    interval(by_efforts, of_efforts), by_motion.value(),
                                    interval(by_motion, of_motion), allowed, agree});
    if (!report.two_estimates.back().agree)
      report.notes.push_back(note_of(report.two_estimates.back()));
  }
}

}  // namespace

double deviation_of_form(const Parameter& parameter) {
  const double whole = parameter.is_relative_change() ? 1.0 : 0.0;
  return kModelForm * std::abs(whole + parameter.value());
}

void add_two_estimates(const Models& models, Report& report) {
  for (std::size_t j = 0; j < models.given.joints.size(); ++j) add_of_joint(models, j, report);
}

}  // namespace ravencal::diagnose
