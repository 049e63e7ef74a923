// SPDX-License-Identifier: Apache-2.0
#include "quadrature_reader/homing.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <vector>

namespace ravencal::quadrature_reader {
namespace {

constexpr double kAround = 9.0;  // a visit is what lies within so many widths of the extreme
// Share of N(9d) within d for a parabola, the shape of every smooth turn.
constexpr double kTurnShare = 1.0 / 3.0;
// Log likelihood ratio beyond doubt: one false stop in a million turns.
constexpr double kBeyondDoubt = 13.8;
constexpr double kWidthStep = 1.15;

/// The visit to the extreme as distances from it, in time order.
struct Visit {
  std::size_t first = 0;
  std::size_t last = 0;
};

/// Largest contiguous run of samples around `peak` that stays within `distance` of the extreme.
Visit visit_within(std::span<const double> distances, std::size_t peak, double distance) {
  Visit visit{peak, peak};
  while (visit.first > 0 && distances[visit.first - 1] <= distance) --visit.first;
  while (visit.last + 1 < distances.size() && distances[visit.last + 1] <= distance) ++visit.last;
  return visit;
}

/// Log likelihood of "share within d is what was seen" over "share is that of a turn".
double log_ratio(std::int64_t inside, std::int64_t all) {
  const double share = static_cast<double>(inside) / static_cast<double>(all);
  if (share <= kTurnShare) return 0.0;
  const double inside_term = static_cast<double>(inside) * std::log(share / kTurnShare);
  const double outside_term = inside == all ? 0.0
                                            : static_cast<double>(all - inside) *
                                                  std::log((1.0 - share) / (1.0 - kTurnShare));
  return inside_term + outside_term;
}

struct Candidate {
  double width = 0.0;
  double log_ratio = 0.0;
  Visit visit;
};

Candidate examine(std::span<const double> distances, std::size_t peak, double width) {
  const Visit visit = visit_within(distances, peak, kAround * width);
  const auto run = distances.subspan(visit.first, visit.last - visit.first + 1);
  const auto inside =
      std::count_if(run.begin(), run.end(), [width](double d) { return d <= width; });
  // A visit that is still going on has no edge yet: it may be a pause anywhere.
  const bool arrived = visit.first > 0;
  return {width, arrived ? log_ratio(inside, static_cast<std::int64_t>(run.size())) : 0.0, visit};
}

HardStop describe(std::span<const std::int64_t> t_ns, std::span<const double> positions,
                  std::span<const double> distances, const Candidate& best) {
  std::vector<double> plateau;
  HardStop stop;
  stop.from_ns = INT64_MAX;
  for (std::size_t i = best.visit.first; i <= best.visit.last; ++i) {
    if (distances[i] > best.width) continue;
    plateau.push_back(positions[i]);
    stop.from_ns = std::min(stop.from_ns, t_ns[i]);
    stop.to_ns = std::max(stop.to_ns, t_ns[i]);
  }
  double mean = 0.0;
  for (const double value : plateau) mean += value / static_cast<double>(plateau.size());
  double variance = 1.0 / 12.0;  // of a count's quantisation
  for (const double value : plateau)
    variance += (value - mean) * (value - mean) / static_cast<double>(plateau.size());
  const auto middle = plateau.begin() + static_cast<std::ptrdiff_t>(plateau.size() / 2);
  std::nth_element(plateau.begin(), middle, plateau.end());
  stop.position_counts = *middle;
  stop.spread_counts = std::sqrt(variance);
  stop.width_counts = best.width;
  stop.samples = static_cast<std::int64_t>(plateau.size());
  stop.confidence = 1.0 / (1.0 + std::exp(-best.log_ratio));
  return stop;
}

}  // namespace

std::optional<HardStop> find_hard_stop(std::span<const std::int64_t> t_ns,
                                       std::span<const double> position_counts, bool at_maximum) {
  assert(t_ns.size() == position_counts.size());
  if (position_counts.size() < 3) return std::nullopt;
  const auto [smallest, largest] =
      std::minmax_element(position_counts.begin(), position_counts.end());
  const double range = *largest - *smallest;
  const double extreme = at_maximum ? *largest : *smallest;
  const auto peak =
      static_cast<std::size_t>((at_maximum ? largest : smallest) - position_counts.begin());
  std::vector<double> distances;
  distances.reserve(position_counts.size());
  for (const double position : position_counts) distances.push_back(std::abs(position - extreme));

  std::optional<Candidate> best;
  for (double width = 1.0; kAround * width < range; width *= kWidthStep) {
    const Candidate candidate = examine(distances, peak, width);
    if (best && candidate.log_ratio < best->log_ratio) break;
    if (candidate.log_ratio >= kBeyondDoubt) best = candidate;
  }
  if (!best) return std::nullopt;
  return describe(t_ns, position_counts, distances, *best);
}

}  // namespace ravencal::quadrature_reader
