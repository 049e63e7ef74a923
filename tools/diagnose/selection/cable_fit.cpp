// SPDX-License-Identifier: Apache-2.0
#include "diagnose/selection/cable_fit.hpp"

#include <ceres/ceres.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "diagnose/effects/shapes.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Rows of the thinned replay: the stretch turns over in tenths of seconds, not in milliseconds.
constexpr Index kThinnedRows = 5000;
constexpr int kRounds = 20;
/// Of a logarithm, from which its derivatives are taken.
constexpr double kDifference = 0.02;
/// Of a logarithm: a three-thousandth of a size is none, and nothing holds it there.
constexpr double kMostChange = 8.0;

}  // namespace

CableFit::CableFit(const ChannelModel& rest) : series_(*rest.series) {
  const Series& s = series_;
  const Index stride = std::max<Index>(1, s.rows() / kThinnedRows);
  std::vector<Index> rows;
  std::vector<Index> thinned(static_cast<std::size_t>(s.rows()), -1);
  for (Index i = 0; i < s.rows(); ++i) {
    const bool fresh = s.fresh[static_cast<std::size_t>(i)] != 0;
    if (i % stride != 0 && !fresh) continue;
    thinned[static_cast<std::size_t>(i)] = static_cast<Index>(rows.size());
    rows.push_back(i);
    fresh_.push_back(fresh ? 1 : 0);
  }
  const auto pick = [&](const VectorXd& x) {
    return x.size() > 0 ? VectorXd(x(rows)) : VectorXd();
  };
  t_s_ = pick(s.t_s);
  motor_ = pick(s.motion.q);
  weight_ = pick(s.weight);
  inertial_ = pick(s.inertial);
  std::vector<Index> training;
  for (std::size_t n = 0; n < rest.blocks.rows.size(); ++n) {
    const Index at = thinned[static_cast<std::size_t>(rest.blocks.rows[n])];
    if (at < 0) continue;
    used_.push_back(at);
    training.push_back(static_cast<Index>(n));
  }
  MatrixXd columns = rest.columns();
  VectorXd target = rest.target;
  limit_ = VectorXd::Constant(columns.cols(), std::numeric_limits<double>::infinity());
  for (std::size_t term = 0; term < rest.limit.size(); ++term) {
    const Index column = static_cast<Index>(term) + 1;
    limit_[column] = rest.limit[term];
    if (rest.held[term] == 0.0) continue;
    // Held without the set is not held with it.
    columns.col(column) = rest.free_base.col(column);
    target += rest.held[term] * columns.col(column);
  }
  linear_ = columns(training, Eigen::all);
  target_ = target(training);
  const double share =
      static_cast<double>(training.size()) / static_cast<double>(rest.target.size());
  precision_ = share * rest.column_precision(columns.cols());
  normal_ = linear_.transpose() * linear_;
  nominal_stretch_ =
      replay_cable({t_s_, motor_, weight_, inertial_, fresh_, s.rest_width()}, s.cable).stretch;
  left_ = std::sqrt(error_of(VectorXd::Zero(target_.size())));
}

VectorXd CableFit::change(const CableNumbers& cable) const {
  const VectorXd stretch =
      replay_cable({t_s_, motor_, weight_, inertial_, fresh_, series_.rest_width()}, cable).stretch;
  return (nominal_stretch_ - stretch)(used_);
}

VectorXd CableFit::linear_fit(const VectorXd& y) const {
  const Index k = linear_.cols();
  MatrixXd moments(k + 1, k + 1);
  moments.topLeftCorner(k, k) = normal_;
  moments.topRightCorner(k, 1) = linear_.transpose() * y;
  moments.bottomLeftCorner(1, k) = moments.topRightCorner(k, 1).transpose();
  moments(k, k) = y.squaredNorm();
  return solve_within(moments, precision_, limit_);
}

double CableFit::error_of(const VectorXd& change) const {
  const VectorXd y = target_ - change;
  const VectorXd b = linear_fit(y);
  const double left = (y - linear_ * b).squaredNorm() + precision_.dot(b.cwiseAbs2());
  return left / static_cast<double>(y.size());
}

/// What a set and its linear terms leave, the price of these terms behind it, over `scale`. The
/// linear terms are eliminated: every evaluation fits them anew (variable projection).
class CableFit::Cost final : public ceres::CostFunction {
 public:
  Cost(const CableFit& fit, const CableSubset& set, double scale)
      : fit_(fit), set_(set), scale_(scale) {
    Index count = 0;
    for (const VectorXd& values : set.log_values) count += values.size();
    set_num_residuals(static_cast<int>(fit.target_.size() + fit.linear_.cols()));
    mutable_parameter_block_sizes()->push_back(static_cast<int>(count));
  }

  bool Evaluate(double const* const* x, double* residuals, double** jacobians) const override {
    const CableSubset set = placed(x[0]);
    // The derivatives are asked for where the error has just been.
    if (set.log_values != now_at_) {
      now_ = fit_.change(cable_with(fit_.series_, set));
      now_at_ = set.log_values;
    }
    const VectorXd y = fit_.target_ - now_;
    const VectorXd b = fit_.linear_fit(y);
    Eigen::Map<VectorXd> out(residuals, num_residuals());
    out << (y - fit_.linear_ * b) / scale_, fit_.precision_.cwiseSqrt().cwiseProduct(b) / scale_;
    if (!out.allFinite()) return false;
    if (jacobians == nullptr || jacobians[0] == nullptr) return true;
    Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>> jacobian(
        jacobians[0], num_residuals(), parameter_block_sizes()[0]);
    differentiate(set, b, jacobian);
    return jacobian.allFinite();
  }

  /// The set at these logarithms.
  [[nodiscard]] CableSubset placed(const double* x) const {
    CableSubset set = set_;
    for (VectorXd& values : set.log_values) {
      values = Eigen::Map<const VectorXd>(x, values.size());
      x += values.size();
    }
    return set;
  }

 private:
  /// Linear terms at their limits stay there.
  void differentiate(
      const CableSubset& set, const VectorXd& b,
      Eigen::Ref<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>> out)
      const {
    MatrixXd change(fit_.target_.size(), out.cols());
    Index at = 0;
    for (std::size_t m = 0; m < set.members.size(); ++m) {
      for (Index p = 0; p < set.log_values[m].size(); ++p) {
        CableSubset moved = set;
        moved.log_values[m][p] += kDifference;
        change.col(at++) = (fit_.change(cable_with(fit_.series_, moved)) - now_) / kDifference;
      }
    }
    std::vector<Index> free;
    for (Index i = 0; i < b.size(); ++i)
      if (std::abs(b[i]) < fit_.limit_[i]) free.push_back(i);
    const MatrixXd linear = fit_.linear_(Eigen::all, free);
    MatrixXd inner = fit_.normal_(free, free);
    inner.diagonal() += fit_.precision_(free);
    inner.diagonal() += 1e-9 * (inner.diagonal().array() + 1e-300).matrix();
    const MatrixXd taken = inner.ldlt().solve(linear.transpose() * change);
    const Index rows = change.rows();
    out.setZero();
    out.topRows(rows) = (linear * taken - change) / scale_;
    for (std::size_t i = 0; i < free.size(); ++i)
      out.row(rows + free[i]) =
          -std::sqrt(fit_.precision_[free[i]]) / scale_ * taken.row(static_cast<Index>(i));
  }

  const CableFit& fit_;
  const CableSubset& set_;
  double scale_;
  mutable std::vector<VectorXd> now_at_;
  mutable VectorXd now_;
};

CableSubset CableFit::improved(CableSubset start) const {
  std::vector<double> x, low, high;
  for (std::size_t m = 0; m < start.members.size(); ++m) {
    const CableMember& member = *start.members[m];
    start.log_values[m] = start.log_values[m].cwiseMax(member.low).cwiseMin(member.high);
    x.insert(x.end(), start.log_values[m].begin(), start.log_values[m].end());
    const VectorXd least =
        member.low.cwiseMax((start.log_values[m].array() - kMostChange).matrix());
    const VectorXd most =
        member.high.cwiseMin((start.log_values[m].array() + kMostChange).matrix());
    low.insert(low.end(), least.begin(), least.end());
    high.insert(high.end(), most.begin(), most.end());
  }
  const double error = error_of(change(cable_with(series_, start)));
  const double scale = std::sqrt(std::max(error, 1e-300) * static_cast<double>(target_.size()));
  auto* cost = new Cost(*this, start, scale);
  ceres::Problem problem;
  problem.AddResidualBlock(cost, nullptr, x.data());
  for (std::size_t i = 0; i < x.size(); ++i) {
    const int parameter = static_cast<int>(i);
    problem.SetParameterLowerBound(x.data(), parameter, low[i]);
    // The solver wants some room between two bounds.
    problem.SetParameterUpperBound(x.data(), parameter, std::max(high[i], low[i] + 1e-9));
  }
  ceres::Solver::Options options;
  options.max_num_iterations = kRounds;
  options.linear_solver_type = ceres::DENSE_NORMAL_CHOLESKY;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  options.initial_trust_region_radius = 100.0;
  options.max_trust_region_radius = 1e4;
  options.min_trust_region_radius = 1e-3;
  options.function_tolerance = 1e-4;
  options.parameter_tolerance = 1e-3;
  // A step that a bound cuts short is taken or not, as any other.
  options.max_num_line_search_step_size_iterations = 0;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  CableSubset best = cost->placed(x.data());
  best.error = error_of(change(cable_with(series_, best)));
  return best;
}

CableSubset CableFit::fit(const std::vector<const CableMember*>& members) const {
  CableSubset start{members, {}, 0.0};
  for (const CableMember* member : members) start.log_values.push_back(member->start);
  CableSubset best = improved(start);
  // Wider strands and slower creep are valleys of their own.
  for (std::size_t m = 0; m < members.size(); ++m) {
    if (members[m]->start.size() < 2) continue;
    CableSubset other = start;
    other.log_values[m][1] += std::log(4.0);
    other = improved(std::move(other));
    if (other.error < best.error) best = std::move(other);
  }
  return best;
}

}  // namespace ravencal::diagnose
