// SPDX-License-Identifier: Apache-2.0
#include "diagnose/fit/spectral_line.hpp"
#include "core/constants.hpp"
#include "core/median.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <complex>
#include <unsupported/Eigen/FFT>
#include <utility>
#include <vector>

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double kLowest_hz = 0.1;
constexpr double kHighest_hz = 5.0;
/// Rows are averaged over this time: nothing up to the highest frequency is lost by more than 10 %.
constexpr double kStep_s = 0.05;
/// Bins of the spectrum to either side that say how loud noise is there, the nearest left out.
constexpr Index kAround = 40;
constexpr Index kNear = 4;
/// What repeats with the motion does not stand out more than the motion itself; a tone that shakes
/// the joint stands out in its motion as well, but much less.
constexpr double kOfMotion = 0.25;

struct Thinned {
  std::vector<double> t_s, x;
};

Thinned thinned(const VectorXd& t_s, const VectorXd& x) {
  Thinned out;
  for (Index first = 0, last = 0; first < x.size(); first = last) {
    double time = 0.0;
    double sum = 0.0;
    while (last < x.size() && (last == first || t_s[last] - t_s[first] < kStep_s)) {
      time += t_s[last];
      sum += x[last++];
    }
    const auto count = static_cast<double>(last - first);
    out.t_s.push_back(time / count);
    out.x.push_back(sum / count);
  }
  double mean = 0.0;
  for (const double value : out.x) mean += value / static_cast<double>(out.x.size());
  for (double& value : out.x) value -= mean;
  return out;
}

/// Squared amplitude at one frequency, rows [first, last).
double power_at(const Thinned& s, double hz, std::size_t first, std::size_t last) {
  std::complex<double> sum = 0.0;
  for (std::size_t i = first; i < last; ++i)
    sum += s.x[i] * std::polar(1.0, -core::kRadPerTurn * hz * s.t_s[i]);
  const double scale = 2.0 / static_cast<double>(std::max<std::size_t>(1, last - first));
  return std::norm(sum) * scale * scale;
}

/// Power over the median of its surroundings.
double prominence(const std::vector<double>& power, Index at) {
  std::vector<double> around;
  for (Index k = at - kAround; k <= at + kAround; ++k) {
    if (k < 0 || k >= static_cast<Index>(power.size()) || std::abs(k - at) <= kNear) continue;
    around.push_back(power[static_cast<std::size_t>(k)]);
  }
  if (around.size() < static_cast<std::size_t>(kAround)) return 0.0;
  const double usual = core::upper_median(std::move(around));
  return power[static_cast<std::size_t>(at)] / std::max(usual, 1e-300);
}

struct Frequencies {
  double lowest_hz;
  double step_hz;
  Index count;
};

/// Squared amplitudes at all of the frequencies, as power_at gives them, to twelve digits: samples
/// at any times are spread over an even grid by narrow Gaussians, and what these do to the spectrum
/// is known (Greengard and Lee, SIAM Review 2004).
std::vector<double> spectrum_of(const Thinned& s, const Frequencies& at) {
  constexpr Index kSpread = 12;  // cells to either side: as many digits
  const auto modes = static_cast<double>(at.count);
  const auto cells = static_cast<Index>(std::bit_ceil(static_cast<std::size_t>(2 * at.count)));
  const double over = static_cast<double>(cells) / modes;
  const double width = core::kRadPerTurn / 2.0 * static_cast<double>(kSpread) /
                       (modes * modes * over * (over - 0.5));  // tau of the source
  const double cell = core::kRadPerTurn / static_cast<double>(cells);
  const Index middle = at.count / 2;
  const double middle_hz = at.lowest_hz + static_cast<double>(middle) * at.step_hz;
  std::vector<std::complex<double>> grid(static_cast<std::size_t>(cells));
  for (std::size_t i = 0; i < s.x.size(); ++i) {
    const double phase = core::kRadPerTurn * at.step_hz * (s.t_s[i] - s.t_s.front());
    const std::complex<double> value =
        s.x[i] * std::polar(1.0, -core::kRadPerTurn * middle_hz * s.t_s[i]);
    const auto nearest = static_cast<Index>(phase / cell);
    for (Index c = nearest - kSpread + 1; c <= nearest + kSpread; ++c) {
      const double distance = phase - static_cast<double>(c) * cell;
      grid[static_cast<std::size_t>((c + cells) % cells)] +=
          value * std::exp(-distance * distance / (4.0 * width));
    }
  }
  std::vector<std::complex<double>> transform;
  Eigen::FFT<double>().fwd(transform, grid);
  const double scale = 2.0 / static_cast<double>(s.x.size()) / static_cast<double>(cells) *
                       std::sqrt(core::kRadPerTurn / 2.0 / width);
  std::vector<double> power;
  for (Index k = -middle; k < at.count - middle; ++k) {
    const double blur = std::exp(static_cast<double>(k) * static_cast<double>(k) * width);
    power.push_back(
        std::norm(transform[static_cast<std::size_t>((k + cells) % cells)] * scale * blur));
  }
  return power;
}

}  // namespace

std::optional<SpectralLine> find_line(const VectorXd& t_s, const VectorXd& residual,
                                      const VectorXd& motion, double alpha) {
  if (residual.size() < 400) return std::nullopt;
  const Thinned rest = thinned(t_s, residual);
  const Thinned moved = thinned(t_s, motion);
  const double duration_s = rest.t_s.back() - rest.t_s.front();
  const double rate_hz = static_cast<double>(rest.x.size()) / std::max(duration_s, 1e-9);
  const double highest_hz = std::min(kHighest_hz, 0.4 * rate_hz);
  const double step_hz = 0.5 / std::max(duration_s, 1e-9);
  const auto count = static_cast<Index>((highest_hz - kLowest_hz) / step_hz);
  if (count < 3 * kAround) return std::nullopt;
  const std::size_t size = rest.x.size();
  const Frequencies frequencies{kLowest_hz, step_hz, count};
  const std::vector<double> power = spectrum_of(rest, frequencies);
  const auto most = std::max_element(power.begin(), power.end()) - power.begin();
  // Noise has exponential powers: beyond k medians with chance 2^-k. Residuals are not Gaussian.
  const double needed = 1.5 * std::log2(static_cast<double>(count) / alpha);
  const double found = prominence(power, most);
  if (found < needed) return std::nullopt;
  const double hz = kLowest_hz + static_cast<double>(most) * step_hz;
  if (prominence(spectrum_of(moved, frequencies), most) > std::max(needed, kOfMotion * found))
    return std::nullopt;
  // A tone goes on: each half of the time has at least half of its amplitude.
  for (const std::size_t half : {std::size_t{0}, size / 2}) {
    const double own = power_at(rest, hz, half, half + size / 2);
    if (own < 0.25 * power[static_cast<std::size_t>(most)]) return std::nullopt;
  }
  SpectralLine line;
  line.hz = hz;
  line.rms = std::sqrt(0.5 * power[static_cast<std::size_t>(most)]);
  const double mean = residual.mean();
  line.share = line.rms * line.rms * static_cast<double>(residual.size()) /
               std::max((residual.array() - mean).square().sum(), 1e-300);
  return line;
}

}  // namespace ravencal::diagnose
