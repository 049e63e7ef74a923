// SPDX-License-Identifier: Apache-2.0
#include "physics/predict/smoother.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "core/median.hpp"

namespace ravencal::physics {
using Eigen::Index;

Eigen::VectorXd without_gaps(const Eigen::VectorXd& values) {
  Eigen::VectorXd filled = values;
  Index last = -1;
  for (Index i = 0; i < filled.size(); ++i) {
    if (!std::isfinite(filled[i])) continue;
    for (Index k = last + 1; k < i; ++k) {
      const double share =
          last < 0 ? 1.0 : static_cast<double>(k - last) / static_cast<double>(i - last);
      filled[k] = last < 0 ? filled[i] : filled[last] + share * (filled[i] - filled[last]);
    }
    last = i;
  }
  for (Index k = last + 1; k < filled.size(); ++k) filled[k] = last < 0 ? 0.0 : filled[last];
  return filled;
}

namespace {

struct LocalFit {
  double v = 0.0, a = 0.0, residual2 = 0.0, velocity_gain = 0.0, acceleration_gain = 0.0;
};

/// Derivatives of the cubic about row `centre` over rows [begin, end); a gain is the variance of
/// one per variance of the position.
LocalFit fit_cubic(const Eigen::VectorXd& t, const Eigen::VectorXd& x, Index begin, Index end,
                   Index centre, double half_width) {
  Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
  Eigen::Vector4d right = Eigen::Vector4d::Zero();
  const double x0 = x[centre];
  double energy = 0.0;
  for (Index i = begin; i < end; ++i) {
    const double u = (t[i] - t[centre]) / half_width;
    const Eigen::Vector4d row(1.0, u, u * u, u * u * u);
    normal += row * row.transpose();
    right += row * (x[i] - x0);
    energy += (x[i] - x0) * (x[i] - x0);
  }
  normal.diagonal().array() += 1e-9 * static_cast<double>(end - begin);
  const Eigen::LDLT<Eigen::Matrix4d> solver(normal);
  const Eigen::Vector4d c = solver.solve(right);
  LocalFit fit;
  fit.v = c[1] / half_width;
  fit.a = 2.0 * c[2] / (half_width * half_width);
  const auto freedom = static_cast<double>(std::max<Index>(1, end - begin - 4));
  fit.residual2 = std::max(0.0, energy - c.dot(right)) / freedom;
  const Eigen::Vector4d slope(0.0, 1.0, 0.0, 0.0);
  const Eigen::Vector4d unit(0.0, 0.0, 1.0, 0.0);
  fit.velocity_gain = solver.solve(slope)[1] / (half_width * half_width);
  fit.acceleration_gain = 4.0 * solver.solve(unit)[2] / std::pow(half_width, 4);
  return fit;
}

/// Rows on either side of a window, however short it is.
constexpr Index kLeastSide = 3;

/// Calls `use(i, fit)` for every `stride`-th row.
template <typename Use>
void for_each_fit(const Eigen::VectorXd& t, const Eigen::VectorXd& x,
                  const std::vector<char>& fresh, double half_width_s, Index stride, Use&& use) {
  const auto starts = [&](Index i) { return fresh[static_cast<std::size_t>(i)] != 0; };
  for (Index i = 0; i < t.size(); i += stride) {
    Index begin = i;
    Index end = i + 1;
    while (begin > 0 && !starts(begin) &&
           (t[i] - t[begin - 1] <= half_width_s || i - begin < kLeastSide))
      --begin;
    while (end < t.size() && !starts(end) &&
           (t[end] - t[i] <= half_width_s || end - i <= kLeastSide))
      ++end;
    const double reach = std::max({t[i] - t[begin], t[end - 1] - t[i], 1e-9});
    use(i, fit_cubic(t, x, begin, end, i, reach));
  }
}

/// Of the window for the derivative of that order (1 or 2).
double chosen_half_width(const Eigen::VectorXd& t, const Eigen::VectorXd& x,
                         const std::vector<char>& fresh, int order) {
  const Index stride = std::max<Index>(1, t.size() / 3000);
  double least = 0.0;
  double kept_from = 0.0;
  for (double half_width = 0.005; half_width < 1.3; half_width *= 2.0) {
    std::vector<double> noise2;
    double derivative2 = 0.0, gain = 0.0;
    for_each_fit(t, x, fresh, half_width, stride, [&](Index, const LocalFit& fit) {
      noise2.push_back(fit.residual2);
      derivative2 += order == 1 ? fit.v * fit.v : fit.a * fit.a;
      gain += order == 1 ? fit.velocity_gain : fit.acceleration_gain;
    });
    const auto count = static_cast<double>(noise2.size());
    // The median of the residual ignores the few windows where the motion itself is not cubic.
    const double noise_power = core::upper_median(noise2) * gain / count;
    const double power = derivative2 / count;
    if (least == 0.0 && noise_power < 1e-4 * power) {
      least = half_width;
      kept_from = power;
    } else if (order == 2 && least > 0.0 && power > 0.9 * kept_from) {  // 95 % in amplitude
      least = half_width;
    } else if (least > 0.0) {
      return least;
    }
  }
  // Nothing is smooth enough: a tenth of a second keeps what a robot arm does.
  return least > 0.0 ? least : 0.08;
}

}  // namespace

Motion smooth_motion(const Eigen::VectorXd& t_s, const Eigen::VectorXd& position,
                     const std::vector<char>& fresh) {
  Motion motion;
  motion.q = without_gaps(position);
  const Eigen::VectorXd& x = motion.q;
  motion.v = motion.a = Eigen::VectorXd::Zero(x.size());
  if (x.size() < 8) return motion;
  const double fine_s = chosen_half_width(t_s, x, fresh, 1);
  const double wide_s = chosen_half_width(t_s, x, fresh, 2);
  std::vector<double> noise2;
  for_each_fit(t_s, x, fresh, fine_s, 1, [&](Index i, const LocalFit& fit) {
    motion.v[i] = fit.v;
    noise2.push_back(fit.residual2);
  });
  motion.noise = std::sqrt(core::upper_median(std::move(noise2)));
  for_each_fit(t_s, x, fresh, wide_s, 1,
               [&](Index i, const LocalFit& fit) { motion.a[i] = fit.a; });
  return motion;
}

}  // namespace ravencal::physics
