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
  double q = 0.0, v = 0.0, a = 0.0, residual2 = 0.0, velocity_gain = 0.0, acceleration_gain = 0.0;
};

/// Cubic around t0 over rows [begin, end); `gain` is the variance of the second derivative per
/// variance of the position.
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
  fit.q = x0 + c[0];
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

struct Window {
  double half_width_s;
  Index least_side;
};

/// Calls `use(i, fit)` for every `stride`-th row.
template <typename Use>
void for_each_fit(const Eigen::VectorXd& t, const Eigen::VectorXd& x,
                  const std::vector<char>& fresh, const Window& window, Index stride, Use&& use) {
  const Index count = t.size();
  std::vector<Index> start(static_cast<std::size_t>(count)), stop(static_cast<std::size_t>(count));
  for (Index i = 0; i < count; ++i) {
    const auto n = static_cast<std::size_t>(i);
    start[n] = (i == 0 || fresh[n] != 0) ? i : start[n - 1];
  }
  for (Index i = count; i-- > 0;) {
    const auto n = static_cast<std::size_t>(i);
    stop[n] = (i + 1 == count || fresh[n + 1] != 0) ? i + 1 : stop[n + 1];
  }
  for (Index i = 0; i < count; i += stride) {
    const auto n = static_cast<std::size_t>(i);
    Index begin = i;
    Index end = i + 1;
    while (begin > start[n] &&
           (t[i] - t[begin - 1] <= window.half_width_s || i - begin < window.least_side))
      --begin;
    while (end < stop[n] && (t[end] - t[i] <= window.half_width_s || end - i <= window.least_side))
      ++end;
    const double reach = std::max({t[i] - t[begin], t[end - 1] - t[i], 1e-9});
    use(i, fit_cubic(t, x, begin, end, i, reach));
  }
}

double chosen_half_width(const Eigen::VectorXd& t, const Eigen::VectorXd& x,
                         const std::vector<char>& fresh, const std::vector<char>& unseen,
                         int need) {
  const Index stride = std::max<Index>(1, t.size() / 3000);
  double least = 0.0;
  double kept_from = 0.0;
  for (double half_width = 0.005; half_width < 1.3; half_width *= 2.0) {
    std::vector<double> noise2;
    double derivative2 = 0.0;
    double gain = 0.0;
    double count = 0.0;
    for_each_fit(t, x, fresh, {half_width, 3}, stride, [&](Index i, const LocalFit& fit) {
      if (unseen[static_cast<std::size_t>(i)] != 0) return;
      noise2.push_back(fit.residual2);
      derivative2 += need == 1 ? fit.v * fit.v : fit.a * fit.a;
      gain += need == 1 ? fit.velocity_gain : fit.acceleration_gain;
      count += 1.0;
    });
    // The median of the residual ignores the few windows where the motion itself is not cubic.
    const double noise_power = core::upper_median(noise2) * gain / count;
    if (count == 0.0) return half_width;
    const double power = derivative2 / count;
    if (least == 0.0 && noise_power < 1e-4 * power) {
      least = half_width;
      kept_from = power;
    } else if (need == 2 && least > 0.0 && power > 0.9 * kept_from) {  // 95 % in amplitude
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
                     const std::vector<char>& fresh, const std::vector<char>& unseen, int need) {
  const Eigen::VectorXd x = without_gaps(position);
  Motion motion;
  motion.q = x;
  motion.v = Eigen::VectorXd::Zero(x.size());
  motion.a = motion.v;
  if (x.size() < 8) return motion;
  const double fine_s = chosen_half_width(t_s, x, fresh, unseen, 1);
  motion.half_width_s = need == 1 ? fine_s : chosen_half_width(t_s, x, fresh, unseen, need);
  std::vector<double> noise2;
  for_each_fit(t_s, x, fresh, {fine_s, 3}, 1, [&](Index i, const LocalFit& fit) {
    motion.v[i] = fit.v;
    motion.a[i] = fit.a;
    noise2.push_back(fit.residual2);
  });
  motion.noise = std::sqrt(core::upper_median(std::move(noise2)));
  if (motion.half_width_s == fine_s) return motion;
  for_each_fit(t_s, x, fresh, {motion.half_width_s, 3}, 1,
               [&](Index i, const LocalFit& fit) { motion.a[i] = fit.a; });
  return motion;
}

namespace {

double biweight(double u) { return (1.0 - u * u) * (1.0 - u * u); }

/// Row `i` of the filter with the rows of its stretch as they are spaced.
double filtered_at(const Eigen::VectorXd& t_s, const Eigen::VectorXd& y,
                   const std::vector<char>& fresh, double half_width_s, Index i) {
  double sum = y[i];
  double weights = 1.0;
  const auto add = [&](Index k) {
    const double w = biweight((t_s[k] - t_s[i]) / half_width_s);
    sum += w * y[k];
    weights += w;
  };
  for (Index k = i;
       k > 0 && fresh[static_cast<std::size_t>(k)] == 0 && t_s[i] - t_s[k - 1] < half_width_s; --k)
    add(k - 1);
  for (Index k = i + 1;
       k < y.size() && fresh[static_cast<std::size_t>(k)] == 0 && t_s[k] - t_s[i] < half_width_s;
       ++k)
    add(k);
  return sum / weights;
}

/// Spacing of rows [first, last) if it is even to a hundredth, else 0.
double even_spacing(const Eigen::VectorXd& t_s, Index first, Index last) {
  if (last - first < 3) return 0.0;
  const double dt = (t_s[last - 1] - t_s[first]) / static_cast<double>(last - 1 - first);
  for (Index i = first + 1; i < last; ++i) {
    if (std::abs(t_s[i] - t_s[i - 1] - dt) > 0.01 * dt) return 0.0;
  }
  return dt;
}

}  // namespace

Eigen::VectorXd filter_like_acceleration(const Eigen::VectorXd& t_s, const Eigen::VectorXd& y,
                                         const std::vector<char>& fresh, double half_width_s) {
  Eigen::VectorXd out(y.size());
  for (Index first = 0, last = 0; first < y.size(); first = last) {
    for (last = first + 1; last < y.size() && fresh[static_cast<std::size_t>(last)] == 0;) ++last;
    const double dt = even_spacing(t_s, first, last);
    const Index reach =
        dt > 0.0 ? static_cast<Index>(std::ceil(half_width_s / dt - 1e-6)) - 1 : last - first;
    const Index inner_first = std::min(first + std::max<Index>(reach, 0), last);
    const Index inner_last = std::max(inner_first, last - std::max<Index>(reach, 0));
    for (Index i = first; i < inner_first; ++i)
      out[i] = filtered_at(t_s, y, fresh, half_width_s, i);
    if (inner_last > inner_first) {
      Eigen::VectorXd weights(2 * reach + 1);
      for (Index k = -reach; k <= reach; ++k)
        weights[k + reach] = biweight(static_cast<double>(k) * dt / half_width_s);
      weights /= weights.sum();
      for (Index i = inner_first; i < inner_last; ++i)
        out[i] = weights.dot(y.segment(i - reach, 2 * reach + 1));
    }
    for (Index i = inner_last; i < last; ++i) out[i] = filtered_at(t_s, y, fresh, half_width_s, i);
  }
  return out;
}

}  // namespace ravencal::physics
