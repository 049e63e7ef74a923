// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "prove/baselines.hpp"

namespace ravencal::prove {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

MatrixXd joined(const TermLibrary& library, const std::vector<std::size_t>& groups) {
  Index width = library.nuisance.cols();
  for (const std::size_t g : groups) width += library.groups[g].columns.cols();
  MatrixXd x(library.y.size(), width);
  x.leftCols(library.nuisance.cols()) = library.nuisance;
  Index at = library.nuisance.cols();
  for (const std::size_t g : groups) {
    x.middleCols(at, library.groups[g].columns.cols()) = library.groups[g].columns;
    at += library.groups[g].columns.cols();
  }
  return x;
}

double bic_of(const TermLibrary& library, const MatrixXd& x, double rss) {
  const auto n = static_cast<double>(library.y.size());
  return n * std::log(rss / n + 1e-300) + static_cast<double>(x.cols()) * std::log(n);
}

VectorXd solve(const MatrixXd& x, const VectorXd& y) {
  if (x.cols() == 0) return {};
  MatrixXd normal = x.transpose() * x;
  normal.diagonal() *= 1.0 + 1e-9;
  normal.diagonal().array() += 1e-300;
  return normal.ldlt().solve(x.transpose() * y);
}

double rss_of(const MatrixXd& x, const VectorXd& y) {
  return x.cols() == 0 ? y.squaredNorm() : (y - x * solve(x, y)).squaredNorm();
}

}  // namespace

std::vector<std::size_t> bic_forward(const TermLibrary& library) {
  std::vector<std::size_t> chosen;
  MatrixXd x = library.nuisance;
  double best = bic_of(library, x, rss_of(x, library.y));
  while (chosen.size() < library.groups.size()) {
    std::size_t winner = library.groups.size();
    for (std::size_t g = 0; g < library.groups.size(); ++g) {
      if (std::find(chosen.begin(), chosen.end(), g) != chosen.end()) continue;
      auto trial = chosen;
      trial.push_back(g);
      const MatrixXd wider = joined(library, trial);
      const double bic = bic_of(library, wider, rss_of(wider, library.y));
      if (bic < best) {
        best = bic;
        winner = g;
      }
    }
    if (winner == library.groups.size()) break;
    chosen.push_back(winner);
  }
  return chosen;
}

std::vector<std::size_t> stlsq(const TermLibrary& library) {
  std::vector<std::size_t> kept(library.groups.size());
  std::iota(kept.begin(), kept.end(), std::size_t{0});
  for (int round = 0; round < 20 && !kept.empty(); ++round) {
    const MatrixXd x = joined(library, kept);
    const VectorXd b = solve(x, library.y);
    std::vector<std::size_t> next;
    Index at = library.nuisance.cols();
    for (const std::size_t g : kept) {
      const Index width = library.groups[g].columns.cols();
      const VectorXd part = x.middleCols(at, width) * b.segment(at, width);
      const double rms = std::sqrt(part.squaredNorm() / static_cast<double>(part.size()));
      if (rms >= library.smallest) next.push_back(g);
      at += width;
    }
    if (next.size() == kept.size()) break;
    kept = std::move(next);
  }
  return kept;
}

std::vector<std::size_t> lasso(const TermLibrary& library) {
  std::vector<std::size_t> all(library.groups.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  MatrixXd x = joined(library, all);
  const Index fixed = library.nuisance.cols();
  const auto n = static_cast<double>(library.y.size());
  for (Index c = 0; c < x.cols(); ++c) x.col(c) /= std::sqrt(x.col(c).squaredNorm() / n) + 1e-300;
  const MatrixXd gram = x.transpose() * x / n;
  const VectorXd inner = x.transpose() * library.y / n;
  const double yy = library.y.squaredNorm() / n;
  VectorXd b = VectorXd::Zero(x.cols()), best_b = b;
  double best = std::numeric_limits<double>::infinity();
  double penalty = inner.tail(x.cols() - fixed).cwiseAbs().maxCoeff();
  for (int step = 0; step < 40; ++step, penalty *= 0.8) {
    for (int sweep = 0; sweep < 200; ++sweep) {
      double moved = 0.0;
      for (Index c = 0; c < x.cols(); ++c) {
        const double r = inner[c] - gram.row(c).dot(b) + gram(c, c) * b[c];
        const double limit = c < fixed ? 0.0 : penalty;
        const double shrunk = r > limit ? r - limit : (r < -limit ? r + limit : 0.0);
        const double value = shrunk / std::max(gram(c, c), 1e-12);
        moved = std::max(moved, std::abs(value - b[c]));
        b[c] = value;
      }
      if (moved < 1e-6 * std::sqrt(yy)) break;
    }
    const double rss = yy - 2.0 * inner.dot(b) + b.dot(gram * b);
    const double bic = n * std::log(std::max(rss, 1e-300)) +
                       static_cast<double>((b.array() != 0.0).count()) * std::log(n);
    if (bic < best) {
      best = bic;
      best_b = b;
    }
  }
  std::vector<std::size_t> chosen;
  Index at = fixed;
  for (const std::size_t g : all) {
    const Index width = library.groups[g].columns.cols();
    if ((best_b.segment(at, width).array() != 0.0).any()) chosen.push_back(g);
    at += width;
  }
  return chosen;
}

}  // namespace ravencal::prove
