// SPDX-License-Identifier: Apache-2.0
#include "choice/trial.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <span>

namespace ravencal::choice {
namespace {

using Eigen::Index;

/// Sums over some rows; the design's last column is the constant 1.
struct Moments {
  Eigen::MatrixXd gram;  ///< lower half
  Eigen::VectorXd cross;
  Eigen::MatrixXd sums;        ///< of design rows, [functions x sessions]
  Eigen::VectorXd error_sums;  ///< [sessions]

  Moments(Index size, int sessions)
      : gram(Eigen::MatrixXd::Zero(size, size)),
        cross(Eigen::VectorXd::Zero(size)),
        sums(Eigen::MatrixXd::Zero(size, sessions)),
        error_sums(Eigen::VectorXd::Zero(sessions)) {}

  /// Adds the rows (sign 1) or takes them away (-1).
  void add(const Eigen::MatrixXd& design, const Eigen::VectorXd& errors,
           const std::vector<int>& session, double sign) {
    if (design.rows() == 0) return;
    gram.selfadjointView<Eigen::Lower>().rankUpdate(design.transpose(), sign);
    cross.noalias() += sign * (design.transpose() * errors);
    for (Index row = 0; row < design.rows(); ++row) {
      const Index h = session[static_cast<std::size_t>(row)];
      sums.col(h) += sign * design.row(row).transpose();
      error_sums[h] += sign * errors[row];
    }
  }
  /// Rows of a session.
  [[nodiscard]] double rows(Index session) const { return sums(sums.rows() - 1, session); }
  [[nodiscard]] bool knows(Index session) const { return rows(session) > 0.5; }
};

/// Weights of a fit, [functions]; the last is 0.
Eigen::VectorXd weights_of(const Moments& moments, double ridge) {
  Eigen::MatrixXd system = moments.gram;
  Eigen::VectorXd right = moments.cross;
  double rows = 0.0;
  for (Index h = 0; h < moments.sums.cols(); ++h) {
    if (!moments.knows(h)) continue;
    const Eigen::VectorXd mean = moments.sums.col(h) / moments.rows(h);
    system.selfadjointView<Eigen::Lower>().rankUpdate(mean, -moments.rows(h));
    right -= mean * moments.error_sums[h];
    rows += moments.rows(h);
  }
  const Index last = system.rows() - 1;
  Eigen::VectorXd weights = Eigen::VectorXd::Zero(system.rows());
  if (last == 0) return weights;
  Eigen::MatrixXd inner = system.topLeftCorner(last, last);
  inner.diagonal().array() += ridge * rows + std::numeric_limits<double>::min();
  weights.head(last) = Eigen::LDLT<Eigen::MatrixXd, Eigen::Lower>(inner).solve(right.head(last));
  return weights;
}

/// Constant of a session that has rows.
double constant_of(const Moments& moments, const Eigen::VectorXd& weights, Index session) {
  return (moments.error_sums[session] - moments.sums.col(session).dot(weights)) /
         moments.rows(session);
}

Readout readout_of(const Moments& moments, double ridge) {
  Readout readout{weights_of(moments, ridge), {}};
  for (Index h = 0; h < moments.sums.cols(); ++h) {
    if (moments.knows(h)) readout.of_sessions.push_back(constant_of(moments, readout.weights, h));
  }
  readout.weights[readout.weights.size() - 1] = mean_of(readout.of_sessions);
  return readout;
}

std::vector<int> sessions_of(const JointRows& rows, const std::vector<Index>& list) {
  std::vector<int> sessions;
  sessions.reserve(list.size());
  for (const Index row : list) sessions.push_back(rows.session[static_cast<std::size_t>(row)]);
  return sessions;
}

/// Constants that a fit to `others` gives the sessions of a list whose residuals without a constant
/// are `left`.
Eigen::VectorXd constants_for(const Moments& others, const Eigen::VectorXd& weights,
                              const Eigen::VectorXd& left, const std::vector<int>& session,
                              UnseenConstant unseen) {
  const Index sessions = others.sums.cols();
  Eigen::VectorXd own = Eigen::VectorXd::Zero(sessions);
  Eigen::VectorXd counts = Eigen::VectorXd::Zero(sessions);
  for (Index row = 0; row < left.size(); ++row) {
    const Index s = session[static_cast<std::size_t>(row)];
    own[s] -= left[row];
    counts[s] += 1.0;
  }
  std::vector<double> seen;
  for (Index s = 0; s < sessions; ++s) {
    if (others.knows(s)) seen.push_back(constant_of(others, weights, s));
  }
  Eigen::VectorXd constants = Eigen::VectorXd::Constant(sessions, mean_of(seen));
  for (Index s = 0; s < sessions; ++s) {
    if (others.knows(s)) {
      constants[s] = constant_of(others, weights, s);
    } else if (unseen == UnseenConstant::kLeftOut && counts[s] > 0.0) {
      constants[s] = own[s] / counts[s];
    }
  }
  return constants;
}

/// Prediction - error of a list's rows, by a fit to the rows of `others`.
Eigen::VectorXd left_of(const Moments& others, double ridge, const Eigen::MatrixXd& design,
                        const Eigen::VectorXd& errors, const std::vector<int>& session,
                        UnseenConstant unseen) {
  if (design.rows() == 0) return {};
  const Eigen::VectorXd weights = weights_of(others, ridge);
  Eigen::VectorXd left = design * weights - errors;
  left += constants_for(others, weights, left, session, unseen)(session);
  return left;
}

void set_rmse(Trial& trial, std::size_t parts) {
  const std::span<const Eigen::VectorXd> lists(trial.left);
  const std::vector<double> inside = mean_squares(lists.first(parts));
  const std::vector<double> outside = mean_squares(lists.subspan(parts));
  trial.inside_rmse = std::sqrt(mean_of(inside));
  trial.inside_error =
      trial.inside_rmse > 0.0 ? standard_error(inside) / (2.0 * trial.inside_rmse) : 0.0;
  trial.outside_rmse =
      outside.empty() ? std::numeric_limits<double>::quiet_NaN() : std::sqrt(mean_of(outside));
}

/// What fits of some draws leave, by one ridge.
struct LeftByDraws {
  std::vector<Eigen::VectorXd> sums;  ///< [lists][rows of the list]
  std::vector<double> squares;        ///< [lists], over rows and draws

  void add(std::size_t list, const Eigen::VectorXd& left) {
    if (sums[list].size() == 0) sums[list].setZero(left.size());
    sums[list] += left;
    squares[list] += left.squaredNorm();
  }
  /// Sets what the mean leaves, and how far chance may move it.
  void set(int draws, Trial& trial) const {
    const double count = draws;
    double most = 0.0;
    for (std::size_t list = 0; list < sums.size(); ++list) {
      trial.left.emplace_back(sums[list] / count);
      if (draws < 2 || sums[list].size() == 0) continue;
      const double about_mean = squares[list] - count * trial.left.back().squaredNorm();
      const auto rows = static_cast<double>(sums[list].size());
      most = std::max(most, about_mean / (rows * count * (count - 1.0)));
    }
    trial.left_to_chance = std::sqrt(most);
  }
};

/// Adds what fits of one basis leave, [ridges].
void add_left(const Basis& basis, const JointRows& rows, UnseenConstant unseen,
              std::vector<LeftByDraws>& by_ridge) {
  const Eigen::MatrixXd design = basis.design(rows.scaled);
  Moments all(basis.size(), rows.sessions);
  all.add(design, rows.errors, rows.session, 1.0);
  for (std::size_t p = 0; p < rows.held_out.lists.size(); ++p) {
    const auto& list = rows.held_out.lists[p];
    const Eigen::MatrixXd of_list = design(list, Eigen::all);
    const Eigen::VectorXd errors = rows.errors(list);
    const std::vector<int> sessions = sessions_of(rows, list);
    Moments others = all;
    others.add(of_list, errors, sessions, -1.0);
    for (std::size_t r = 0; r < by_ridge.size(); ++r)
      by_ridge[r].add(p, left_of(others, kRidges[r], of_list, errors, sessions, unseen));
  }
}

/// Every list divided by its least value.
std::vector<std::vector<double>> relative(std::vector<std::vector<double>> squares) {
  for (std::size_t list = 0; list < squares.front().size(); ++list) {
    double least = std::numeric_limits<double>::infinity();
    for (const auto& candidate : squares) least = std::min(least, candidate[list]);
    for (auto& candidate : squares) candidate[list] = least > 0.0 ? candidate[list] / least : 1.0;
  }
  return squares;
}

}  // namespace

std::vector<double> mean_squares(std::span<const Eigen::VectorXd> left) {
  std::vector<double> means;
  for (const Eigen::VectorXd& list : left) {
    if (list.size() > 0) means.push_back(list.squaredNorm() / static_cast<double>(list.size()));
  }
  return means;
}

double mean_of(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value;
  return values.empty() ? 0.0 : sum / static_cast<double>(values.size());
}

double standard_error(const std::vector<double>& values) {
  if (values.size() < 2) return std::numeric_limits<double>::infinity();
  const double mean = mean_of(values);
  double squares = 0.0;
  for (const double value : values) squares += (value - mean) * (value - mean);
  const auto n = static_cast<double>(values.size());
  return std::sqrt(squares / (n - 1.0) / n);
}

std::size_t simplest_of_best(const std::vector<std::vector<double>>& candidates) {
  const auto squares = relative(candidates);
  const auto best =
      std::min_element(squares.begin(), squares.end(),
                       [](const auto& a, const auto& b) { return mean_of(a) < mean_of(b); });
  for (std::size_t c = 0; c < squares.size(); ++c) {
    std::vector<double> excess(squares[c].size());
    std::transform(squares[c].begin(), squares[c].end(), best->begin(), excess.begin(),
                   std::minus<>());
    if (mean_of(excess) <= standard_error(excess)) return c;
  }
  return static_cast<std::size_t>(best - squares.begin());
}

Trial try_basis(std::string name, const BasisSpec& spec, const JointRows& rows,
                UnseenConstant unseen) {
  const std::size_t lists = rows.held_out.lists.size();
  std::vector<LeftByDraws> by_ridge(
      std::size(kRidges), {std::vector<Eigen::VectorXd>(lists), std::vector<double>(lists)});
  for (int k = 0; k < spec.draws; ++k) add_left(draw(spec, k), rows, unseen, by_ridge);
  std::vector<Trial> trials;
  std::vector<std::vector<double>> squares;
  for (std::size_t r = 0; r < by_ridge.size(); ++r) {
    Trial& trial = trials.emplace_back();
    trial.ridge = kRidges[r];
    by_ridge[r].set(spec.draws, trial);
    set_rmse(trial, rows.held_out.parts);
    squares.push_back(mean_squares(trial.left));
  }
  Trial best = std::move(trials[simplest_of_best(squares)]);
  best.name = std::move(name);
  best.basis = spec;
  return best;
}

Trial try_bias(const JointRows& rows) {
  Trial trial = try_basis("bias removed", {}, rows);
  trial.ridge = 0.0;
  return trial;
}

Readout fit_readout(const Basis& basis, double ridge, const JointRows& rows) {
  Moments moments(basis.size(), rows.sessions);
  moments.add(basis.design(rows.scaled), rows.errors, rows.session, 1.0);
  return readout_of(moments, ridge);
}

}  // namespace ravencal::choice
