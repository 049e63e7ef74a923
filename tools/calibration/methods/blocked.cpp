// SPDX-License-Identifier: Apache-2.0
#include "methods/blocked.hpp"

#include <cmath>
#include <limits>

namespace ravencal::methods {

Fold make_fold(std::span<const Series> all, int fold) {
  Fold result;
  const Eigen::Index rows = count_training_rows(all);
  const Eigen::Index from = rows * fold / kFolds;
  const Eigen::Index to = rows * (fold + 1) / kFolds;
  const auto add = [](std::vector<Series>& list, const Series& s, Eigen::Index a, Eigen::Index b) {
    if (b > a) list.push_back(slice(s, a, b - a));
  };
  Eigen::Index at = 0;
  for (const Series& series : all) {
    const Eigen::Index a = row_after(series, from - at);
    const Eigen::Index b = row_after(series, to - at);
    add(result.train, series, 0, a);
    add(result.held_out, series, a, b);
    add(result.train, series, b, series.rows());
    at += count_training_rows(std::span(&series, 1));
  }
  return result;
}

double score(Predictor& predictor, std::span<const Series> series) {
  Eigen::ArrayXd squares;
  Eigen::Index count = 0;
  for (const Series& s : series) {
    const Eigen::MatrixXd left = s.errors - predictor.predict(s);
    if (squares.size() == 0) squares = Eigen::ArrayXd::Zero(left.cols());
    for (Eigen::Index row = 0; row < left.rows(); ++row) {
      if (!left.row(row).allFinite()) continue;
      squares += left.row(row).transpose().array().square();
      ++count;
    }
  }
  if (count == 0) return std::numeric_limits<double>::infinity();
  return std::exp(0.5 * (squares / static_cast<double>(count)).max(1e-300).log().mean());
}

core::Result<std::size_t> choose(std::span<const Series> train, std::size_t count,
                                 const FitCandidate& fit) {
  if (count <= 1) return std::size_t{0};
  std::vector<double> logs(count, 0.0);
  for (int f = 0; f < kFolds; ++f) {
    const Fold fold = make_fold(train, f);
    for (std::size_t c = 0; c < count; ++c) {
      RAVENCAL_ASSIGN_OR_RETURN(const std::unique_ptr<Predictor> predictor, fit(c, fold.train));
      logs[c] += std::log(score(*predictor, fold.held_out));
    }
  }
  std::size_t best = 0;
  for (std::size_t c = 1; c < count; ++c) {
    if (!std::isfinite(logs[best]) || logs[c] < logs[best]) best = c;
  }
  return best;
}

}  // namespace ravencal::methods
