// SPDX-License-Identifier: Apache-2.0
//
// Orders of waves by what is left over a motor's angle: a periodogram in octaves, each of the rows
// slow enough for the filter to pass it.
#include "diagnose/search/orders.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>
#include <unsupported/Eigen/FFT>

#include "diagnose/track/filter.hpp"

namespace ravencal::diagnose {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

/// Of a wave, what the filter passes at least in the rows that are asked for its order.
constexpr double kLeastPassed = 0.25;
/// Half the phase that passes within the filter's half width at most, for the highest order of an
/// octave: sinc^2(1.6) = 0.39 of the wave is left.
constexpr double kPassedAngle_rad = 1.6;
constexpr Index kFewestRowsOfWave = 50;
/// Periods that a motion passes at least: less of a wave is a curve.
constexpr double kFewestWavePeriods = 2.0;
/// Twice the power over the rows is chi-squared of two degrees in noise: beyond chance in some
/// thousand orders.
constexpr double kLeastPower = 20.0;
constexpr std::size_t kMostOrders = 3;
/// Times that the reach around a line of the periodogram is halved to find its peak.
constexpr int kRefinements = 6;
constexpr int kCellsPerPeriod = 4;

/// What the channel leaves, over the angle of its motor and with its speed.
struct OverAngle {
  std::vector<double> angle, speed, left;
  double lowest = 1e300, highest = -1e300;
};

OverAngle over_angle(const Likelihood& likelihood, const Channel& channel, const VectorXd& left) {
  OverAngle out;
  for (std::size_t r = 0; r < likelihood.tracks().size(); ++r) {
    const physics::Motion& motor = likelihood.tracks()[r].forced.motors[channel.joint];
    for (std::size_t n = 0; n < channel.used[r].size(); ++n) {
      const Index i = channel.used[r][n];
      out.angle.push_back(motor.q[i]);
      out.speed.push_back(std::abs(motor.v[i]));
      out.left.push_back(left[channel.first[r] + static_cast<Index>(n)]);
      out.lowest = std::min(out.lowest, motor.q[i]);
      out.highest = std::max(out.highest, motor.q[i]);
    }
  }
  return out;
}

/// What the filter leaves of a wave of that order.
double passed(double order, double speed) {
  const double x = 0.5 * order * speed * kTentS;
  return x < 1e-6 ? 1.0 : std::pow(std::sin(x) / x, 2);
}

/// Twice the squared correlation with a wave of that order.
double power(const OverAngle& rows, double order) {
  double sine = 0.0, cosine = 0.0, sines = 0.0, cosines = 0.0;
  for (std::size_t i = 0; i < rows.angle.size(); ++i) {
    const double share = passed(order, rows.speed[i]);
    if (share < kLeastPassed) continue;
    const double s = share * std::sin(order * rows.angle[i]);
    const double c = share * std::cos(order * rows.angle[i]);
    sine += s * rows.left[i];
    cosine += c * rows.left[i];
    sines += s * s;
    cosines += c * c;
  }
  return sines > 0.0 && cosines > 0.0 ? sine * sine / sines + cosine * cosine / cosines : 0.0;
}

struct Peak {
  double order = 0.0;
  double power = 0.0;
};

/// Local maxima of the periodogram between two orders.
void add_peaks(const OverAngle& rows, double lowest, double highest, std::vector<Peak>& peaks) {
  const double cell = 2.0 * std::numbers::pi / (highest * kCellsPerPeriod);
  const double range = rows.highest - rows.lowest;
  const std::size_t cells = std::bit_ceil(2 * static_cast<std::size_t>(range / cell) + 2);
  VectorXd values = VectorXd::Zero(static_cast<Index>(cells));
  double count = 0.0;
  for (std::size_t i = 0; i < rows.angle.size(); ++i) {
    if (0.5 * highest * rows.speed[i] * kTentS > kPassedAngle_rad) continue;
    values[static_cast<Index>((rows.angle[i] - rows.lowest) / cell)] += rows.left[i];
    count += 1.0;
  }
  if (count < kFewestRowsOfWave) return;
  Eigen::FFT<double> fft;
  Eigen::VectorXcd spectrum;
  fft.fwd(spectrum, values);
  const VectorXd powers = 2.0 / count * spectrum.cwiseAbs2();
  const double step = 2.0 * std::numbers::pi / (static_cast<double>(cells) * cell);
  const auto last = std::min<Index>(static_cast<Index>(cells / 2) - 1,
                                    static_cast<Index>(std::ceil(highest / step)));
  for (Index k = std::max<Index>(1, static_cast<Index>(lowest / step)); k < last; ++k)
    if (powers[k] >= powers[k - 1] && powers[k] > powers[k + 1] && powers[k] > kLeastPower)
      peaks.push_back({static_cast<double>(k) * step, powers[k]});
}

/// The order of the greatest power within half a line of the periodogram.
double refined(const OverAngle& rows, double order) {
  double reach = std::numbers::pi / (rows.highest - rows.lowest);
  double greatest = power(rows, order);
  for (int pass = 0; pass < kRefinements; ++pass, reach *= 0.5) {
    for (const double tried : {order - 0.5 * reach, order + 0.5 * reach}) {
      const double by = power(rows, tried);
      if (by <= greatest) continue;
      greatest = by;
      order = tried;
    }
  }
  return order;
}

}  // namespace

std::vector<double> orders_in(const Likelihood& likelihood, const Channel& channel,
                              const VectorXd& left, double highest) {
  const OverAngle rows = over_angle(likelihood, channel, left);
  const double range = rows.highest - rows.lowest;
  if (!(range > 0.0)) return {};
  std::vector<Peak> peaks;
  for (double low = kFewestWavePeriods * 2.0 * std::numbers::pi / range; low < highest; low *= 2.0)
    add_peaks(rows, low, 2.0 * low, peaks);
  std::sort(peaks.begin(), peaks.end(),
            [](const Peak& a, const Peak& b) { return a.power > b.power; });
  peaks.resize(std::min(peaks.size(), kMostOrders));
  std::vector<double> orders;
  for (const Peak& peak : peaks) orders.push_back(refined(rows, peak.order));
  return orders;
}

}  // namespace ravencal::diagnose
