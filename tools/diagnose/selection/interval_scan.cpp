// SPDX-License-Identifier: Apache-2.0
#include "diagnose/selection/interval_scan.hpp"

#include <algorithm>
#include <cmath>

namespace ravencal::diagnose {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Excess over the noise below which a cell is as the plant says.
constexpr double kLeastExcess = 0.25;
/// Of the greatest excess of a cell: less is the mismatch's fringe. A tenth of its height and less
/// is 5 % of its square at the most.
constexpr double kFringe = 0.05;
/// Cells without evidence of their own are not worth a boundary: Akaike's price of a free cell.
constexpr double kCellPrice = 2.0;
/// Costs of two places that differ by less cannot be told apart.
constexpr double kSame = 6.0;
/// Share of the rows that the plant must account for elsewhere: fitted to a corner it fits always.
constexpr double kLeastOutside = 0.2;

using Range = std::pair<std::size_t, std::size_t>;

class Scan {
 public:
  Scan(const ScanAxis& axis, const VectorXd& precision, const ScanNoise& noise)
      : axis_(axis),
        precision_(precision),
        unit_(std::max(noise.variance * noise.correlation_rows, 1e-300)),
        noise_(noise),
        total_(MatrixXd::Zero(axis.moments.front().rows(), axis.moments.front().cols())) {
    for (const MatrixXd& m : axis.moments) total_ += m;
  }

  /// The cheapest stretch.
  [[nodiscard]] Range cheapest() const {
    const std::size_t count = axis_.rows.size();
    Range best{0, count - 1};
    double least = data_cost(best) + price(best);
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t j = i; j < count; ++j) {
        if (outside_rows({i, j}) < kLeastOutside * outside_rows({1, 0})) continue;
        const double cost = data_cost({i, j}) + price({i, j});
        if (cost >= least) continue;
        least = cost;
        best = {i, j};
      }
    }
    return best;
  }

  /// What the rows cost: outside under the plant fitted there, inside under the best prediction.
  [[nodiscard]] double data_cost(const Range& in) const {
    MatrixXd outside = total_;
    double inside = 0.0;
    for (std::size_t c = in.first; c <= in.second; ++c) {
      outside -= axis_.moments[c];
      inside += axis_.best[c];
    }
    if (in.first == 0 && in.second + 1 == axis_.rows.size()) return inside / unit_;
    return (squared_error(outside, solve(outside, precision_)) + inside) / unit_;
  }

  /// Without the cells at the stretch's ends that hold its fringe only.
  [[nodiscard]] Range trimmed(Range in) const {
    if (in.first == 0 && in.second + 1 == axis_.rows.size()) return in;
    MatrixXd outside = total_;
    for (std::size_t c = in.first; c <= in.second; ++c) outside -= axis_.moments[c];
    const VectorXd plant = solve(outside, precision_);
    const auto excess = [&](std::size_t c) {
      if (axis_.rows[c] <= 0.0) return 0.0;
      return (squared_error(axis_.moments[c], plant) - axis_.best[c]) / axis_.rows[c];
    };
    double most = 0.0;
    for (std::size_t c = in.first; c <= in.second; ++c) most = std::max(most, excess(c));
    while (in.first < in.second && excess(in.first) < kFringe * most) ++in.first;
    while (in.first < in.second && excess(in.second) < kFringe * most) --in.second;
    return in;
  }

 private:
  /// Rows of the cells before and after; an empty range leaves all of them.
  [[nodiscard]] double outside_rows(const Range& in) const {
    double sum = 0.0;
    for (std::size_t c = 0; c < axis_.rows.size(); ++c)
      sum += c >= in.first && c <= in.second ? 0.0 : axis_.rows[c];
    return sum;
  }

  [[nodiscard]] double price(const Range& in) const {
    double sum = 0.0;
    for (std::size_t c = in.first; c <= in.second; ++c)
      sum += kCellPrice + kLeastExcess * axis_.rows[c] / noise_.correlation_rows;
    return sum;
  }

  const ScanAxis& axis_;
  const VectorXd& precision_;
  double unit_;
  ScanNoise noise_;
  MatrixXd total_;
};

}  // namespace

std::optional<Range> scan(const ScanAxis& axis, const VectorXd& precision, const ScanNoise& noise,
                          bool prefer_later) {
  if (axis.rows.empty()) return std::nullopt;
  const Scan over(axis, precision, noise);
  const std::size_t last = axis.rows.size() - 1;
  Range found = over.cheapest();
  if (prefer_later && found.first == 0 && found.second < last) {
    // The change lies within the last cell, which belongs to both sides.
    const Range later{found.second, last};
    if (over.data_cost(later) <= over.data_cost(found) + kSame) found = later;
  }
  return over.trimmed(found);
}

}  // namespace ravencal::diagnose
