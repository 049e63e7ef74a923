// SPDX-License-Identifier: Apache-2.0
#include "diagnose/channel/command_pulses.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/median.hpp"
#include "diagnose/effects/effects.hpp"
#include "diagnose/findings/policy.hpp"
#include "diagnose/findings/quantiles.hpp"
#include "diagnose/fit/sign_flip.hpp"
#include "diagnose/selection/posterior.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr Index kReach = 2;  ///< an edge may spread over two samples of a filtered signal
constexpr std::size_t kMostListed = 200;  ///< of the pulses' begins, as parameters

VectorXd edges_of(const Series& s, const ControlLaw& law) {
  VectorXd edges = VectorXd::Zero(s.rows());
  for (Index i = kReach; i < s.rows(); ++i) {
    const auto n = static_cast<std::size_t>(i);
    if (s.held_out[n] == 0 && s.recording[n] == s.recording[n - kReach])
      edges[i] = law.residual[i] - law.residual[i - kReach];
  }
  return edges;
}

/// First rows of stretches between edges, and the number of rows at the end.
std::vector<Index> cut_at(const VectorXd& edges, double threshold, const Series& s) {
  std::vector<Index> cuts = {0};
  for (Index i = kReach; i + 1 < s.rows(); ++i) {
    const auto n = static_cast<std::size_t>(i);
    const bool begins = s.fresh[n] != 0 || s.held_out[n] != s.held_out[n - 1];
    if (begins && i > cuts.back()) cuts.push_back(i);
    const double edge = std::abs(edges[i]);
    const bool peak =
        edge > threshold && edge >= std::abs(edges[i - 1]) && edge > std::abs(edges[i + 1]);
    if (peak && i - 1 - cuts.back() > 3) cuts.push_back(i - 1);
  }
  cuts.push_back(s.rows());
  return cuts;
}

/// Half a pulse with the rest beside it is an observation: one half has the begin, the other one
/// the end.
double chance_of(const std::vector<Pulse>& pulses, const Series& s, const VectorXd& gain) {
  std::vector<Index> begins;  // of observations: in the middle of a pulse or of the rest
  for (std::size_t p = 0; p < pulses.size(); ++p) {
    begins.push_back(p == 0 ? 0 : (pulses[p - 1].last + pulses[p].first) / 2);
    begins.push_back((pulses[p].first + pulses[p].last) / 2);
  }
  begins.push_back(s.rows());
  const auto observed = static_cast<Index>(begins.size()) - 1;
  VectorXd sums = VectorXd::Zero(observed);
  for (Index k = 0; k < observed; ++k) {
    for (Index i = begins[static_cast<std::size_t>(k)]; i < begins[static_cast<std::size_t>(k) + 1];
         ++i) {
      if (s.trains(i)) sums[k] += gain[i];
    }
  }
  return exact_sign_flip_p(sums);
}

void add_parameters(const std::vector<Pulse>& pulses, const Series& s, double size,
                    NamedEffect& effect) {
  std::vector<double> sizes, durations;
  for (const Pulse& pulse : pulses) {
    sizes.push_back(pulse.size);
    durations.push_back(pulse.end_s - pulse.begin_s);
  }
  const auto count = static_cast<double>(pulses.size());
  const double chance = kNormal95 * core::normal_deviation(sizes, size) / std::sqrt(count);
  // With and without a pulse the command is cut to whole steps, which no repetition averages out.
  const double spread = std::hypot(chance, resolution_of(s) / std::sqrt(2.0));
  const double duration = core::upper_median(durations);
  const double step_s =
      s.rows() > 1 ? (s.t_s[s.rows() - 1] - s.t_s[0]) / static_cast<double>(s.rows() - 1) : 0.0;
  effect.parameters = {{"size", size, s.unit, {size - spread, size + spread}},
                       {"count", count, "1", {count, count}},
                       {"duration", duration, "s", {duration - step_s, duration + step_s}}};
  for (std::size_t p = 0; p < std::min(pulses.size(), kMostListed); ++p) {
    const double begin_s = pulses[p].begin_s;
    effect.parameters.push_back(
        {fmt::format("begin_{}", p + 1), begin_s, "s", {begin_s - step_s, begin_s + step_s}});
  }
}

Mismatch mismatch_of(const std::vector<Pulse>& pulses, const NamedEffect& effect) {
  Mismatch m;
  m.joint = effect.joint;
  m.stage = effect.stage;
  m.regime = {"events"};
  for (const Pulse& pulse : pulses) m.interval_s.emplace_back(pulse.begin_s, pulse.end_s);
  m.excess_rmse = effect.held_out_before;
  m.floor = effect.held_out_after;
  m.unit = effect.unit;
  m.p_value = effect.p_value;
  return m;
}

}  // namespace

Pulses find_pulses(const Series& s, const ControlLaw& law) {
  Pulses found;
  const VectorXd edges = edges_of(s, law);
  found.threshold =
      std::max(kEdgeDeviations * core::normal_deviation(edges), kLeastEdge * s.training_rms(s.y));
  const std::vector<Index> cuts = cut_at(edges, found.threshold, s);
  std::vector<double> levels;
  for (std::size_t c = 0; c + 1 < cuts.size(); ++c)
    levels.push_back(
        core::upper_median(VectorXd(law.residual.segment(cuts[c], cuts[c + 1] - cuts[c]))));
  // Rest is the level next to zero: a law's own offset is small against what counts as a pulse.
  found.baseline = *std::min_element(levels.begin(), levels.end(),
                                     [](double a, double b) { return std::abs(a) < std::abs(b); });
  for (std::size_t c = 0; c + 1 < cuts.size(); ++c) {
    const auto first = static_cast<std::size_t>(cuts[c]);
    const double size = levels[c] - found.baseline;
    if (std::abs(size) < kLeastLevel * found.threshold || s.held_out[first] != 0) continue;
    const Index next = cuts[c + 1];
    const bool same =
        next < s.rows() && s.recording[static_cast<std::size_t>(next)] == s.recording[first];
    found.pulses.push_back({cuts[c], next, s.t_s[cuts[c]], s.t_s[same ? next : next - 1], size});
  }
  return found;
}

bool name_pulses(const Pulses& found, const Series& s, const ControlLaw& law, double chance,
                 ChannelFindings& findings) {
  NamedEffect effect;
  effect.id = input_disturbance_kind().id();
  effect.joint = s.joint;
  effect.stage = stage_word(s.stage);
  std::vector<double> sizes;
  for (const Pulse& pulse : found.pulses) sizes.push_back(pulse.size);
  const double size = core::upper_median(std::move(sizes));
  add_parameters(found.pulses, s, size, effect);
  const VectorXd without = law.residual.array() - found.baseline;
  VectorXd with = without;
  for (const Pulse& pulse : found.pulses)
    with.segment(pulse.first, pulse.last - pulse.first).array() -= size;
  effect.held_out_before = s.training_rms(without);
  effect.held_out_after = s.training_rms(with);
  effect.unit = s.unit;
  effect.p_value = chance_of(found.pulses, s, without.array().square() - with.array().square());
  effect.probability = probability_at(effect.p_value);
  effect.size = std::abs(size);
  effect.separate_by =
      "record the command that leaves the controller and the one that reaches the drive";
  if (effect.p_value > chance ||
      effect.held_out_after >= kMostLeftOfPulses * effect.held_out_before)
    return false;
  findings.mismatch.push_back(mismatch_of(found.pulses, effect));
  findings.effects.push_back(std::move(effect));
  return true;
}

int least_pulses(double chance) {
  int pulses = 1;
  while (pulses < kMostExactFlips / 2 && least_exact_p(2 * pulses) > chance) ++pulses;
  return pulses;
}

}  // namespace ravencal::diagnose
