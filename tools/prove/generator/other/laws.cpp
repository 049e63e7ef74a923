// SPDX-License-Identifier: Apache-2.0
#include "prove/generator/other/laws.hpp"

#include <algorithm>
#include <cmath>

namespace ravencal::prove {
namespace {

constexpr double kPressedIn = 0.1;  // of the play's half width at the usual effort

}  // namespace

double dahl_after(double effort, double level, double slope, double exponent, double travel) {
  if (travel == 0.0) return effort;
  const double side = travel > 0.0 ? 1.0 : -1.0;
  // r = 1 - F s / level obeys dr/da = -|r|^i sign(r) over a = slope |x| / level.
  const double r = 1.0 - effort * side / level;
  const double a = slope * std::abs(travel) / level;
  double left = std::abs(r);
  if (std::abs(exponent - 1.0) < 1e-6)
    left *= std::exp(-a);
  else if (left > 0.0)
    left = std::pow(std::max(0.0, std::pow(left, 1.0 - exponent) - (1.0 - exponent) * a),
                    1.0 / (1.0 - exponent));
  return side * level * (1.0 - (r < 0.0 ? -left : left));
}

double hess_soom_level(double coulomb, double extra, double stribeck_velocity, double velocity) {
  const double ratio = velocity / stribeck_velocity;
  return coulomb + extra / (1.0 + ratio * ratio);
}

double IwanStops::move(double stiffness, double yield, double stretch) {
  double sum = 0.0;
  for (int n = 0; n < kCount; ++n) {
    const double threshold = 2.0 * yield * (n + 0.5) / kCount;
    double& d = deflection_[static_cast<std::size_t>(n)];
    d = std::clamp(d + stretch, -threshold, threshold);
    sum += d;
  }
  return stiffness * sum / kCount;
}

double stretch_behind_play(double elastic, double half_width, double stiffness,
                           double usual_effort) {
  if (half_width <= 0.0) return elastic;
  const double reach = std::abs(elastic) - half_width;
  if (reach <= 0.0) return 0.0;
  // Press-in d: usual (d / (0.1 b))^1.5 = k (reach - d). Convex, so that Newton's steps from the
  // upper side stay there.
  const double pressed = kPressedIn * half_width;
  double d = std::min(reach, pressed * std::pow(stiffness * reach / usual_effort, 2.0 / 3.0));
  for (int n = 0; n < 8; ++n) {
    const double root = std::sqrt(d / pressed);
    const double off = usual_effort * root * d / pressed - stiffness * (reach - d);
    d -= off / (1.5 * usual_effort * root / pressed + stiffness);
  }
  return std::copysign(reach - d, elastic);
}

double contact_share(double stretch, double half_width) {
  if (half_width <= 0.0) return 1.0;
  return std::abs(stretch) / (std::abs(stretch) + kPressedIn * half_width);
}

void PronyCreep::step(double effort, double compliance, double time_s, double dt_s) {
  const double spread = std::sqrt(10.0);
  fast_ += dt_s * (0.5 * compliance * effort - fast_) / (time_s / spread);
  slow_ += dt_s * (0.5 * compliance * effort - slow_) / (time_s * spread);
}

double soft_limit(double effort, double limit) {
  if (limit <= 0.0) return effort;
  constexpr double kKnee = 10.0;
  return effort / std::pow(1.0 + std::pow(std::abs(effort) / limit, kKnee), 1.0 / kKnee);
}

}  // namespace ravencal::prove
