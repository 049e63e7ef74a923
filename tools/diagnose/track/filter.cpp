// SPDX-License-Identifier: Apache-2.0
#include "diagnose/track/filter.hpp"

#include <algorithm>

namespace ravencal::diagnose {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

/// Mean over `width` rows, of which one more lies after the row than before it if `width` is even.
VectorXd moving_mean(const VectorXd& x, Index width) {
  const Index rows = x.size();
  VectorXd sums(rows + 1);
  sums[0] = 0.0;
  for (Index i = 0; i < rows; ++i) sums[i + 1] = sums[i] + x[i];
  VectorXd means(rows);
  for (Index i = 0; i < rows; ++i) {
    const Index first = std::max<Index>(0, i - (width - 1) / 2);
    const Index last = std::min(rows, i + width / 2 + 1);
    means[i] = (sums[last] - sums[first]) / static_cast<double>(last - first);
  }
  return means;
}

}  // namespace

VectorXd tent(const VectorXd& x, Index half_width) {
  if (half_width < 2) return x;
  // Backwards the second time: an even width is then symmetric.
  const VectorXd backwards = moving_mean(x, half_width).reverse();
  return moving_mean(backwards, half_width).reverse();
}

VectorXd first_difference(const VectorXd& x, double period_s) {
  VectorXd v = VectorXd::Zero(x.size());
  for (Index i = 1; i + 1 < x.size(); ++i) v[i] = (x[i + 1] - x[i - 1]) / (2.0 * period_s);
  return v;
}

VectorXd second_difference(const VectorXd& x, double period_s) {
  VectorXd a = VectorXd::Zero(x.size());
  for (Index i = 1; i + 1 < x.size(); ++i)
    a[i] = (x[i + 1] - 2.0 * x[i] + x[i - 1]) / (period_s * period_s);
  return a;
}

}  // namespace ravencal::diagnose
