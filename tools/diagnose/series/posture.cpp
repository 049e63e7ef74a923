// SPDX-License-Identifier: Apache-2.0
#include "diagnose/series/posture.hpp"

#include <Eigen/Dense>
#include <cmath>
#include <map>

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Range (rad or m) of a joint below which its slope is the noise's.
constexpr double kLeastRange = 1e-3;
constexpr Index kLeastRows = 50;

/// A constant and the joints that move, at the rows of one recording.
MatrixXd columns_at(const std::vector<VectorXd>& believed, const std::vector<Index>& rows) {
  MatrixXd columns = MatrixXd::Ones(static_cast<Index>(rows.size()), 1);
  for (const VectorXd& position : believed) {
    if (position.size() == 0) continue;
    const VectorXd own = position(rows);
    if (!own.allFinite() || own.maxCoeff() - own.minCoeff() < kLeastRange) continue;
    columns.conservativeResize(Eigen::NoChange, columns.cols() + 1);
    columns.rightCols(1) = (own.array() - own.mean()).matrix();
  }
  return columns;
}

}  // namespace

std::vector<VectorXd> posture_of(const std::vector<VectorXd>& believed,
                                 const std::vector<VectorXd>& truth,
                                 const std::vector<int>& recording) {
  std::map<int, std::vector<Index>> rows_of;
  for (std::size_t i = 0; i < recording.size(); ++i)
    rows_of[recording[i]].push_back(static_cast<Index>(i));
  std::vector<VectorXd> posture = believed;
  for (const auto& [number, rows] : rows_of) {
    const MatrixXd columns = columns_at(believed, rows);
    for (std::size_t j = 0; j < believed.size(); ++j) {
      if (truth[j].size() == 0 || believed[j].size() == 0) continue;
      const VectorXd error = truth[j](rows) - believed[j](rows);
      std::vector<Index> read;
      for (Index n = 0; n < error.size(); ++n) {
        if (std::isfinite(error[n])) read.push_back(n);
      }
      if (read.empty()) continue;
      const Index width = static_cast<Index>(read.size()) < kLeastRows ? 1 : columns.cols();
      const VectorXd b =
          columns(read, Eigen::seqN(0, width)).colPivHouseholderQr().solve(error(read));
      posture[j](rows) += columns.leftCols(width) * b;
    }
  }
  return posture;
}

}  // namespace ravencal::diagnose
