// SPDX-License-Identifier: Apache-2.0
#include "diagnose/series/series.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "core/median.hpp"

namespace ravencal::diagnose {

std::string_view stage_word(Stage stage) {
  switch (stage) {
    case Stage::kCommand:
      return "command";
    case Stage::kTransmission:
      return "transmission";
    case Stage::kDrive:
    case Stage::kTracking:
      return "drive";
  }
  return "drive";
}

void Series::mark_valid() {
  valid.assign(static_cast<std::size_t>(rows()), 1);
  for (Eigen::Index i = 0; i < rows(); ++i) {
    bool good = std::isfinite(y[i]);
    for (const Companion& load : loads) good = good && std::isfinite(load.value[i]);
    valid[static_cast<std::size_t>(i)] = good ? 1 : 0;
    if (!good) y[i] = 0.0;
    for (Companion& load : loads) {
      if (!std::isfinite(load.value[i])) load.value[i] = i > 0 ? load.value[i - 1] : 0.0;
    }
  }
}

CableMotion Series::cable_motion() const {
  const Eigen::VectorXd& winding = wound.size() > 0 ? wound : motion.q;
  return replay_cable({t_s, winding, weight, inertial, fresh, rest_width()}, cable);
}

bool Series::trains(Eigen::Index row) const {
  const auto n = static_cast<std::size_t>(row);
  return valid[n] != 0 && held_out[n] == 0 && (at_rest.empty() || at_rest[n] == 0);
}

bool Series::any_held_out() const {
  return std::any_of(held_out.begin(), held_out.end(), [](char flag) { return flag != 0; });
}

namespace {

template <typename Use>
void for_training_rows(const Series& series, Use&& use) {
  for (Eigen::Index i = 0; i < series.rows(); ++i) {
    if (series.trains(i)) use(i);
  }
}

}  // namespace

double Series::training_rms(const Eigen::VectorXd& x) const {
  double sum = 0.0;
  double count = 0.0;
  for_training_rows(*this, [&](Eigen::Index i) {
    sum += x[i] * x[i];
    count += 1.0;
  });
  return count > 0.0 ? std::sqrt(sum / count) : 0.0;
}

double Series::training_mean(const Eigen::VectorXd& x) const {
  double sum = 0.0;
  double count = 0.0;
  for_training_rows(*this, [&](Eigen::Index i) {
    sum += x[i];
    count += 1.0;
  });
  return count > 0.0 ? sum / count : 0.0;
}

std::pair<double, double> Series::training_range(const Eigen::VectorXd& x) const {
  double least = 0.0;
  double greatest = 0.0;
  bool first = true;
  for_training_rows(*this, [&](Eigen::Index i) {
    least = first ? x[i] : std::min(least, x[i]);
    greatest = first ? x[i] : std::max(greatest, x[i]);
    first = false;
  });
  return {least, greatest};
}

double Series::rest_width() const {
  // Six deviations of the position noise, and never less than a two-thousandth of the range, below
  // which a direction says nothing about a robot.
  const auto [least, greatest] = training_range(motion.q);
  return std::max({6.0 * motion.noise, 5e-4 * (greatest - least), 1e-12});
}

double Series::friction_displacement() const { return std::max(0.5 * rest_width(), presliding); }

double Series::row_period_s() const {
  constexpr Eigen::Index kRows = 2000;
  std::vector<double> periods;
  for (Eigen::Index i = 1; i < std::min(rows(), kRows); ++i)
    if (fresh[static_cast<std::size_t>(i)] == 0) periods.push_back(t_s[i] - t_s[i - 1]);
  return core::upper_median(std::move(periods));
}

Eigen::VectorXd Series::as_seen(const Eigen::VectorXd& column) const {
  if (stage != Stage::kDrive) return column;
  return physics::filter_like_acceleration(t_s, column, fresh, std::max(motion.half_width_s, 1e-9));
}

}  // namespace ravencal::diagnose
