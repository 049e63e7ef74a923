// SPDX-License-Identifier: Apache-2.0
#include "diagnose/series/rest.hpp"

#include <algorithm>
#include <cmath>

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double kSticks = 0.02;      ///< of the usual speed
constexpr double kSettles = 0.1;      ///< of the speed at which the joint is moved
constexpr double kStill_s = 0.25;     ///< a command that is older than any period of its sender
constexpr double kLeastMoved = 0.05;  ///< of the rows; a set of poses has no speed of its own

/// Displacements over which the longest bristles of a simulation forget how a rest left them.
constexpr double kForgotten = 6.0;

/// 1 where the command stands still for kStill_s or longer; zeros without a command.
std::vector<char> rows_held(const Series& series, const VectorXd& desired) {
  std::vector<char> held(static_cast<std::size_t>(series.rows()), 0);
  for (Index first = 0, last = 0; first < desired.size(); first = last) {
    last = first + 1;
    while (last < desired.size() && series.fresh[static_cast<std::size_t>(last)] == 0 &&
           desired[last] == desired[first])
      ++last;
    if (series.t_s[last - 1] - series.t_s[first] >= kStill_s)
      std::fill(held.begin() + first, held.begin() + last, 1);
  }
  return held;
}

/// Root mean square speed of the rows that are not held; 0 where those are too few for one.
double speed_when_moved(const Series& series, const std::vector<char>& held) {
  double sum = 0.0, moved = 0.0, rows = 0.0;
  for (Index i = 0; i < series.rows(); ++i) {
    if (!series.trains(i)) continue;
    rows += 1.0;
    if (held[static_cast<std::size_t>(i)] != 0) continue;
    sum += series.motion.v[i] * series.motion.v[i];
    moved += 1.0;
  }
  return moved > kLeastMoved * rows ? std::sqrt(sum / moved) : 0.0;
}

}  // namespace

std::vector<char> rows_at_rest(const Series& series, const VectorXd& desired) {
  const std::vector<char> held = rows_held(series, desired);
  const double sticks = kSticks * series.training_rms(series.motion.v);
  const double settles = kSettles * speed_when_moved(series, held);
  const double forgotten = kForgotten * series.friction_displacement();
  std::vector<char> rest(held.size(), 0);
  Index settled = -1;  // last row of the settling whose friction is not forgotten yet
  for (Index i = 0; i < series.rows(); ++i) {
    const auto n = static_cast<std::size_t>(i);
    const double speed = std::abs(series.motion.v[i]);
    const bool settling = held[n] != 0 && speed < settles;
    const bool forgets =
        settled >= 0 && std::abs(series.motion.q[i] - series.motion.q[settled]) > forgotten;
    if (settling) {
      settled = i;
    } else if (forgets || series.fresh[n] != 0) {
      settled = -1;
    }
    rest[n] = speed < sticks || settled >= 0 ? 1 : 0;
  }
  return rest;
}

}  // namespace ravencal::diagnose
