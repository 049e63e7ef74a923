// SPDX-License-Identifier: Apache-2.0
#include "prove/generator/beyond.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

namespace ravencal::prove {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// RMS of what no combination of the columns takes.
double left_by(const MatrixXd& x, const VectorXd& d) {
  VectorXd rest = d;
  if (x.cols() > 0) {
    // Scaled, so that a column's unit does not decide its rank.
    MatrixXd scaled = x;
    for (Index c = 0; c < x.cols(); ++c) scaled.col(c) /= x.col(c).norm() + 1e-300;
    rest -= scaled * scaled.colPivHouseholderQr().solve(d);
  }
  return std::sqrt(rest.squaredNorm() / static_cast<double>(d.size()));
}

}  // namespace

std::optional<Imitation> best_imitation(const record::Recording& with,
                                        const record::Recording& without, const NominalRobot& plant,
                                        std::size_t joint, bool position, std::string_view own) {
  const Signals a = signals_of(with, plant, joint), b = signals_of(without, plant, joint);
  if ((position ? a.truth : a.effort).size() == 0) return std::nullopt;
  const auto library = position ? position_library : drive_library;
  const TermLibrary known = library(a, plant, joint);
  const Index rows = std::min(a.rows(), b.rows());
  const VectorXd d = known.y.head(rows) - library(b, plant, joint).y.head(rows);
  const MatrixXd nuisance = known.nuisance.topRows(rows);
  const double whole = left_by(nuisance, d);
  Imitation best{"parameters", whole};
  for (const TermLibrary::Group& group : known.groups) {
    if (group.id == own) continue;
    MatrixXd x(rows, nuisance.cols() + group.columns.cols());
    x << nuisance, group.columns.topRows(rows);
    // Parameters alone stay the answer unless the effect takes a clear part of what they leave.
    if (const double left = left_by(x, d); left < std::min(best.left, 0.9 * whole))
      best = {group.id, left};
  }
  return best;
}

}  // namespace ravencal::prove
