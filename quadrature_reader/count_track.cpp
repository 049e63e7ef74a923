// SPDX-License-Identifier: Apache-2.0
#include "quadrature_reader/count_track.hpp"
#include "core/constants.hpp"

#include <algorithm>

namespace ravencal::quadrature_reader {
namespace {

// Knots kept before the present one: half an encoder cycle for the velocity, and one to spare.
constexpr std::size_t kHistory = 3;

}  // namespace

void CountTrack::add_edge(std::int64_t t_ns, std::int64_t before, std::int64_t after) {
  const double boundary = 0.5 * (static_cast<double>(before) + static_cast<double>(after));
  const auto step = static_cast<std::int8_t>(after > before ? 1 : -1);
  const bool broken = !knots_.empty() && knots_.back().broken_after;
  knots_.push_back(
      {t_ns, boundary, static_cast<double>(after), step, broken, false, uncertainty_counts_});
}

void CountTrack::add_count(std::int64_t t_ns, std::int64_t count) {
  const auto position = static_cast<double>(count);
  const bool broken = !knots_.empty() && (knots_.back().broken_after ||
                                          (stale_ns_ > 0 && t_ns - knots_.back().t_ns > stale_ns_));
  knots_.push_back({t_ns, position, position, 0, broken, false, uncertainty_counts_});
}

void CountTrack::add_gap(std::int64_t from_ns, std::int64_t to_ns, std::int64_t count) {
  while (!knots_.empty() && knots_.back().t_ns > from_ns) knots_.pop_back();
  if (!knots_.empty()) knots_.back().broken_after = true;
  begin(to_ns, count);
}

void CountTrack::interrupt(std::int64_t t_ns) {
  if (knots_.empty() || knots_.back().broken_after) return;
  const double rest = knots_.back().rest_counts;
  if (t_ns > knots_.back().t_ns)
    knots_.push_back({t_ns, rest, rest, 0, false, true, uncertainty_counts_});
  knots_.back().broken_after = true;
}

void CountTrack::begin(std::int64_t t_ns, std::int64_t count) {
  const auto position = static_cast<double>(count);
  const bool broken = !knots_.empty() && knots_.back().broken_after;
  knots_.push_back({t_ns, position, position, 0, broken, false, uncertainty_counts_});
}

void CountTrack::set_uncertainty_of_all(std::int64_t counts) {
  uncertainty_counts_ = counts;
  for (auto& knot : knots_) knot.uncertainty_counts = counts;
}

TrackSample CountTrack::sample(std::int64_t t_ns) {
  const auto after =
      std::upper_bound(knots_.begin(), knots_.end(), t_ns,
                       [](std::int64_t t, const Knot& knot) { return t < knot.t_ns; });
  auto next = static_cast<std::size_t>(after - knots_.begin());
  if (next == 0) return {};
  if (next > kHistory + 1) {
    knots_.erase(knots_.begin(), knots_.begin() + static_cast<std::ptrdiff_t>(next - kHistory - 1));
    next = kHistory + 1;
  }
  const std::size_t k = next - 1;
  const bool next_known = next < knots_.size() && knots_[next].t_ns <= t_ns + latency_ns_;
  if (knots_[k].broken_after) return {};
  if (next < knots_.size() && knots_[next].broken_before) return {};
  if (stale_ns_ > 0 && !next_known && t_ns - knots_[k].t_ns > stale_ns_) return {};
  return {true, position_at(k, next_known, t_ns), velocity_at(k, t_ns),
          knots_[k].uncertainty_counts};
}

double CountTrack::position_at(std::size_t k, bool next_known, std::int64_t t_ns) const {
  const Knot& here = knots_[k];
  const auto since = static_cast<double>(t_ns - here.t_ns);
  if (next_known) {
    const Knot& next = knots_[k + 1];
    const auto span = static_cast<double>(next.t_ns - here.t_ns);
    if (next.t_ns - here.t_ns <= latency_ns_ && here.step != 0 && next.step == -here.step) {
      return here.position_counts + excursion(k, since / span);
    }
    if (stale_ns_ > 0 || next.t_ns - here.t_ns <= latency_ns_) {
      return here.position_counts + (next.position_counts - here.position_counts) * since / span;
    }
  } else if (stale_ns_ > 0) {
    return here.position_counts;
  }
  // A long rest: leave the boundary, stay at the count, approach the next boundary.
  const double ramp = 0.5 * static_cast<double>(latency_ns_);
  if (since < ramp) {
    return here.position_counts + (here.rest_counts - here.position_counts) * since / ramp;
  }
  if (next_known) {
    const Knot& next = knots_[k + 1];
    const auto until = static_cast<double>(next.t_ns - t_ns);
    if (until < ramp) {
      return next.position_counts + (here.rest_counts - next.position_counts) * until / ramp;
    }
  }
  return here.rest_counts;
}

double CountTrack::excursion(std::size_t k, double share) const {
  // A turn: out over a boundary and back. A parabola that starts at the speed of the edge before,
  // and stays within the count that the encoder says it was in.
  const Knot& out = knots_[k];
  double height_counts = 0.5;
  if (k > 0 && knots_[k - 1].step == out.step && !out.broken_before) {
    const auto before_ns = static_cast<double>(out.t_ns - knots_[k - 1].t_ns);
    const auto away_ns = static_cast<double>(knots_[k + 1].t_ns - out.t_ns);
    height_counts = before_ns > 0.0 ? std::min(1.0, 0.25 * away_ns / before_ns) : 1.0;
  }
  return 4.0 * height_counts * share * (1.0 - share) * out.step;
}

double CountTrack::velocity_at(std::size_t k, std::int64_t t_ns) const {
  const std::int64_t horizon_ns = t_ns + latency_ns_;
  if (k + 1 >= knots_.size() || knots_[k + 1].t_ns > horizon_ns) return 0.0;
  const std::int64_t span_ns = knots_[k + 1].t_ns - knots_[k].t_ns;
  if (stale_ns_ == 0 && span_ns > latency_ns_) return 0.0;
  std::size_t first = k;
  std::size_t last = k + 1;
  // One whole cycle of A and B, centred: unequal phases and duty then cancel.
  const std::int8_t step = knots_[k].step;
  if (step != 0 && k >= 2 && k + 2 < knots_.size() && knots_[k + 2].t_ns <= horizon_ns) {
    bool steady = true;
    for (std::size_t i = k - 2; i <= k + 2; ++i) {
      steady = steady && knots_[i].step == step && (i == k - 2 || !knots_[i].broken_before);
    }
    if (steady) {
      first = k - 2;
      last = k + 2;
    }
  }
  const auto dt_ns = static_cast<double>(knots_[last].t_ns - knots_[first].t_ns);
  if (dt_ns <= 0.0) return 0.0;
  return (knots_[last].position_counts - knots_[first].position_counts) /
         (dt_ns * core::kSecondsPerNs);
}

}  // namespace ravencal::quadrature_reader
