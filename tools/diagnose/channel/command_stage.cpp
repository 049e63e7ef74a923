// SPDX-License-Identifier: Apache-2.0
//
// The command stage: what the controller should have asked of the drive, from its own inputs,
// against what was recorded. Gains come from differences between samples, in which a disturbance
// shows only at its edges, so that a disturbance that is on half of the time cannot bend them.
#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "diagnose/channel/channel.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

double median_of(std::vector<double> x) {
  if (x.empty()) return 0.0;
  const auto middle = x.begin() + static_cast<std::ptrdiff_t>(x.size() / 2);
  std::nth_element(x.begin(), middle, x.end());
  return *middle;
}

double robust_scale(const VectorXd& x) {
  std::vector<double> magnitude(x.data(), x.data() + x.size());
  for (double& value : magnitude) value = std::abs(value);
  return 1.4826 * median_of(std::move(magnitude));
}

struct Law {
  VectorXd gains;     ///< of position error, measured rate, desired rate
  VectorXd residual;  ///< recorded minus law, all rows; level as recorded
  std::vector<char> usable;
};

/// Samples at the drive's limit say nothing about gains.
std::vector<char> unsaturated(const Series& s) {
  const double limit = s.y.cwiseAbs().maxCoeff();
  int at_limit = 0;
  for (Index i = 0; i < s.rows(); ++i) at_limit += std::abs(s.y[i]) >= limit * (1.0 - 1e-9) ? 1 : 0;
  std::vector<char> usable(s.valid);
  for (Index i = 0; i < s.rows() && at_limit >= 5; ++i) {
    if (std::abs(s.y[i]) >= limit * (1.0 - 1e-9)) usable[static_cast<std::size_t>(i)] = 0;
  }
  return usable;
}

/// Rows in 0.1 s, at least one.
Index rows_in_tenth_second(const Series& s) {
  std::vector<double> steps;
  for (Index i = 1; i < std::min<Index>(s.rows(), 2000); ++i) {
    if (s.fresh[static_cast<std::size_t>(i)] == 0) steps.push_back(s.t_s[i] - s.t_s[i - 1]);
  }
  const double usual_s = median_of(std::move(steps));
  return usual_s > 0.0 ? std::clamp<Index>(std::lround(0.1 / usual_s), 1, 200) : 1;
}

/// Weighted least squares on differences over `lag` rows, weights after Tukey's biweight, for rows
/// in [first, last).
Law fit_differences(const Series& s, Index first, Index last, Index lag) {
  Law law;
  law.usable = unsaturated(s);
  MatrixXd x(s.rows(), 3);
  x << s.position_error, s.measured_rate, s.desired_rate;
  std::vector<Index> rows;
  Index stretch = 0;  // usable rows in a row up to this one
  for (Index i = first; i < last; ++i) {
    const auto n = static_cast<std::size_t>(i);
    const bool usable = law.usable[n] != 0 && s.held_out[n] == 0;
    stretch = usable ? (s.fresh[n] != 0 ? 1 : stretch + 1) : 0;
    if (stretch > lag) rows.push_back(i);
  }
  const auto count = static_cast<Index>(rows.size());
  MatrixXd dx(count, 3);
  VectorXd dy(count);
  for (Index r = 0; r < count; ++r) {
    const Index i = rows[static_cast<std::size_t>(r)];
    dx.row(r) = x.row(i) - x.row(i - lag);
    dy[r] = s.y[i] - s.y[i - lag];
  }
  const VectorXd column_scale = (dx.colwise().norm().array() + 1e-300).matrix().transpose();
  const MatrixXd z = dx * column_scale.cwiseInverse().asDiagonal();
  VectorXd weight = VectorXd::Ones(count);
  VectorXd gains = VectorXd::Zero(3);
  MatrixXd normal;
  for (int round = 0; round < 8 && count > 10; ++round) {
    normal = z.transpose() * weight.asDiagonal() * z;
    normal.diagonal().array() += 1e-9;
    gains = normal.ldlt().solve(z.transpose() * weight.asDiagonal() * dy);
    const VectorXd r = dy - z * gains;
    const double scale = std::max(robust_scale(r), 1e-12 * dy.norm());
    weight = (1.0 - (r / (6.0 * scale)).array().square()).max(0.0).square();
  }
  law.gains = gains.cwiseQuotient(column_scale);
  law.residual = s.y - x * law.gains;
  return law;
}

/// What a law leaves of the command's changes over `lag` rows.
double left_over(const Law& law, Index first, Index last, Index lag) {
  VectorXd left(std::max<Index>(0, last - first - lag));
  for (Index i = 0; i < left.size(); ++i)
    left[i] = law.residual[first + i + lag] - law.residual[first + i];
  return left.size() > 0 ? robust_scale(left) : 0.0;
}

/// Differences between neighbours, or over a tenth of a second where quantisation outweighs the
/// motion between neighbours and pulls their gains towards zero: then the law from neighbours
/// leaves clearly more of the longer differences.
Law fit_law(const Series& s, Index first, Index last) {
  const Index lag = rows_in_tenth_second(s);
  Law near = fit_differences(s, first, last, 1);
  Law far = fit_differences(s, first, last, lag);
  const bool biased = left_over(far, first, last, lag) < 0.8 * left_over(near, first, last, lag);
  return biased ? far : near;
}

struct Pulse {
  Index first = 0;
  Index last = 0;  ///< one past the end
  double begin_s = 0.0;
  double end_s = 0.0;
  double size = 0.0;
};

/// Stretches of constant disturbance between edges of the law's residual.
std::vector<Pulse> find_pulses(const Series& s, const Law& law, double& baseline,
                               double& threshold) {
  constexpr Index kReach = 2;  // an edge may spread over two samples of a filtered signal
  VectorXd edges = VectorXd::Zero(s.rows());
  for (Index i = kReach; i < s.rows(); ++i) {
    if (s.held_out[static_cast<std::size_t>(i)] != 0) continue;
    if (s.recording[static_cast<std::size_t>(i)] !=
        s.recording[static_cast<std::size_t>(i - kReach)])
      continue;
    edges[i] = law.residual[i] - law.residual[i - kReach];
  }
  threshold = std::max(12.0 * robust_scale(edges), 0.02 * s.training_rms(s.y));
  std::vector<Index> cuts = {0};
  for (Index i = kReach; i + 1 < s.rows(); ++i) {
    const bool begins =
        s.fresh[static_cast<std::size_t>(i)] != 0 ||
        (s.held_out[static_cast<std::size_t>(i)] != s.held_out[static_cast<std::size_t>(i - 1)]);
    if (begins && i > cuts.back()) cuts.push_back(i);
    const bool peak = std::abs(edges[i]) > threshold &&
                      std::abs(edges[i]) >= std::abs(edges[i - 1]) &&
                      std::abs(edges[i]) > std::abs(edges[i + 1]);
    if (peak && i - 1 - cuts.back() > 3) cuts.push_back(i - 1);
  }
  cuts.push_back(s.rows());
  std::vector<double> levels;
  for (std::size_t c = 0; c + 1 < cuts.size(); ++c) {
    const Index first = cuts[c];
    const Index length = cuts[c + 1] - first;
    std::vector<double> inside(law.residual.data() + first, law.residual.data() + first + length);
    levels.push_back(median_of(std::move(inside)));
  }
  // Rest is the level next to zero: a law's own offset is small against what counts as a pulse.
  baseline = *std::min_element(levels.begin(), levels.end(),
                               [](double a, double b) { return std::abs(a) < std::abs(b); });
  std::vector<Pulse> pulses;
  for (std::size_t c = 0; c + 1 < cuts.size(); ++c) {
    if (std::abs(levels[c] - baseline) < 0.5 * threshold ||
        s.held_out[static_cast<std::size_t>(cuts[c])] != 0)
      continue;
    const Index next = cuts[c + 1];
    const bool same = next < s.rows() && s.recording[static_cast<std::size_t>(next)] ==
                                             s.recording[static_cast<std::size_t>(cuts[c])];
    const double end = s.t_s[same ? next : next - 1];
    pulses.push_back({cuts[c], cuts[c + 1], s.t_s[cuts[c]], end, levels[c] - baseline});
  }
  return pulses;
}

/// Least step between neighbouring commands: the converter's, which cuts all of them alike.
double resolution_of(const Series& s) {
  const double least = 1e-9 * s.y.cwiseAbs().maxCoeff();
  double step = std::numeric_limits<double>::infinity();
  for (Index i = 1; i < s.rows(); ++i) {
    const double change = std::abs(s.y[i] - s.y[i - 1]);
    if (change > least) step = std::min(step, change);
  }
  return std::isfinite(step) ? step : 0.0;
}

constexpr int kSegments = 24;

/// A gain is a number in software, which only a converter's steps and a filter bend.
constexpr double kGainTolerance = 0.02;

/// A law that leaves more than this share of the recorded command is not the one that made it.
constexpr double kExplained = 0.5;

/// Chance that sums over equal segments of time agree in sign as well as these.
double segment_p(const Series& s, const VectorXd& gain) {
  VectorXd sums = VectorXd::Zero(kSegments);
  for (Index i = 0; i < s.rows(); ++i) sums[i * kSegments / s.rows()] += gain[i];
  return sign_flip_p(sums, 1);
}

bool name_pulses(const std::vector<Pulse>& pulses, const Series& s, const Law& law, double baseline,
                 ChannelFindings& findings) {
  NamedEffect effect;
  effect.id = "input_disturbance";
  effect.joint = s.joint;
  effect.stage = "command";
  std::vector<double> sizes, durations;
  for (const Pulse& pulse : pulses) {
    sizes.push_back(pulse.size);
    durations.push_back(pulse.end_s - pulse.begin_s);
  }
  const double size = median_of(sizes);
  std::vector<double> from_median = sizes;
  for (double& value : from_median) value = std::abs(value - size);
  const double chance =
      1.96 * 1.4826 * median_of(from_median) / std::sqrt(static_cast<double>(sizes.size()));
  // With and without a pulse the command is cut to whole steps, which no repetition averages out.
  const double spread = std::hypot(chance, resolution_of(s) / std::sqrt(2.0));
  const auto count = static_cast<double>(pulses.size());
  const double step_s =
      s.rows() > 1 ? (s.t_s[s.rows() - 1] - s.t_s[0]) / static_cast<double>(s.rows() - 1) : 0.0;
  effect.parameters = {{"size", size, s.unit, {size - spread, size + spread}},
                       {"count", count, "1", {count, count}},
                       {"duration",
                        median_of(durations),
                        "s",
                        {median_of(durations) - step_s, median_of(durations) + step_s}}};
  for (std::size_t p = 0; p < pulses.size() && p < 200; ++p) {
    effect.parameters.push_back({fmt::format("begin_{}", p + 1),
                                 pulses[p].begin_s,
                                 "s",
                                 {pulses[p].begin_s - step_s, pulses[p].begin_s + step_s}});
  }
  VectorXd without = law.residual.array() - baseline;
  VectorXd with = without;
  for (const Pulse& pulse : pulses)
    with.segment(pulse.first, pulse.last - pulse.first).array() -= size;
  effect.held_out_before = s.training_rms(without);
  effect.held_out_after = s.training_rms(with);
  effect.unit = s.unit;
  effect.p_value = segment_p(s, without.array().square() - with.array().square());
  effect.size = std::abs(size);
  effect.separate_by =
      "record the command that leaves the controller and the one that reaches the drive";
  const bool explains =
      effect.p_value <= 0.01 && effect.held_out_after < 0.5 * effect.held_out_before;
  if (!explains) return false;
  Mismatch m;
  m.joint = s.joint;
  m.stage = "command";
  m.regime = {"events"};
  for (const Pulse& pulse : pulses) m.interval_s.emplace_back(pulse.begin_s, pulse.end_s);
  m.excess_rmse = effect.held_out_before;
  m.floor = effect.held_out_after;
  m.unit = s.unit;
  m.p_value = effect.p_value;
  findings.mismatch.push_back(std::move(m));
  findings.effects.push_back(std::move(effect));
  return true;
}

/// Rows [first, last) and what to call them.
struct Stretch {
  Index first = 0;
  Index last = 0;
  std::string suffix;
};

void name_gain(const Series& s, const Stretch& stretch, double nominal, double tolerance,
               ChannelFindings& findings) {
  const Law law = fit_law(s, stretch.first, stretch.last);
  const double ratio = law.gains[0] / nominal;
  // Segments of time are the observations: neighbouring samples share their errors.
  VectorXd ratios(kSegments / 2);
  for (Index k = 0; k < ratios.size(); ++k) {
    const Index length = stretch.last - stretch.first;
    ratios[k] = fit_law(s, stretch.first + length * k / ratios.size(),
                        stretch.first + length * (k + 1) / ratios.size())
                    .gains[0] /
                nominal;
  }
  std::vector<double> off(ratios.data(), ratios.data() + ratios.size());
  for (double& value : off) value = std::abs(value - ratio);
  const double chance =
      1.96 * 1.4826 * median_of(off) / std::sqrt(static_cast<double>(ratios.size()));
  // A converter that cuts towards zero takes half a step off each command, which no repetition
  // averages out.
  const double mean = s.y.segment(stretch.first, stretch.last - stretch.first).cwiseAbs().mean();
  const double cut = 0.5 * resolution_of(s) / std::max(mean, 1e-300);
  const double error = chance + cut * std::abs(ratio);
  if (std::abs(ratio - 1.0) <= tolerance + error) return;
  const VectorXd law_change = s.position_error * (law.gains[0] - nominal);
  NamedEffect effect;
  effect.id = "controller_gain";
  effect.joint = s.joint;
  effect.stage = "command";
  effect.parameters = {{"ratio" + stretch.suffix, ratio, "1", {ratio - error, ratio + error}}};
  effect.unit = s.unit;
  const double middle =
      median_of({law.residual.data() + stretch.first, law.residual.data() + stretch.last});
  double before = 0.0, after = 0.0, change = 0.0, count = 0.0;
  for (Index i = stretch.first; i < stretch.last; ++i) {
    if (law.usable[static_cast<std::size_t>(i)] == 0) continue;
    const double residual = law.residual[i] - middle;
    after += residual * residual;
    before += std::pow(residual + law_change[i], 2);
    change += law_change[i] * law_change[i];
    count += 1.0;
  }
  effect.held_out_after = std::sqrt(after / std::max(1.0, count));
  effect.held_out_before = std::sqrt(before / std::max(1.0, count));
  effect.p_value = sign_flip_p(ratios.array() - 1.0, 1);
  effect.size = std::sqrt(change / std::max(1.0, count));
  effect.separate_by = "read the gain from the controller's configuration";
  if (effect.p_value <= 0.01 && effect.held_out_after < 0.5 * effect.held_out_before &&
      effect.held_out_after < kExplained * s.training_rms(s.y))
    findings.effects.push_back(std::move(effect));
}

}  // namespace

Eigen::Vector3d recorded_gains(const Series& series, Index first, Index last) {
  return fit_law(series, first, last).gains;
}

ChannelFindings analyse_command(const Series& series, const physics::Plant& plant,
                                const ChannelOptions& /*options*/) {
  ChannelFindings findings;
  findings.joint = series.joint;
  findings.stage = Stage::kCommand;
  findings.unit = series.unit;
  const physics::Joint& joint = plant.joints[plant.joint_index(series.joint).value_or(0)];
  const double nominal =
      joint.controller->kp_n_m_per_rad * joint.reduction * joint.reduction / joint.gearbox_ratio;
  const auto tolerance_entry = joint.tolerance.find("controller_gain");
  const double tolerance =
      tolerance_entry == joint.tolerance.end() ? kGainTolerance : tolerance_entry->second;
  const Law law = fit_law(series, 0, series.rows());
  if (nominal > 0.0) {
    const int recordings = series.recording.back() + 1;
    for (int r = 0; r < recordings; ++r) {
      const auto begin = std::lower_bound(series.recording.begin(), series.recording.end(), r) -
                         series.recording.begin();
      const auto end = std::upper_bound(series.recording.begin(), series.recording.end(), r) -
                       series.recording.begin();
      Index usable = 0;
      for (auto i = begin; i < end; ++i)
        usable += law.usable[static_cast<std::size_t>(i)] != 0 ? 1 : 0;
      if (usable < 200 || series.held_out[static_cast<std::size_t>(begin)] != 0) continue;
      name_gain(series, {begin, end, recordings == 1 ? "" : fmt::format("_recording_{}", r + 1)},
                nominal, tolerance, findings);
    }
  }
  double baseline = 0.0;
  double threshold = 0.0;
  const std::vector<Pulse> pulses = find_pulses(series, law, baseline, threshold);
  const auto long_enough = [&](const Pulse& pulse) {
    return pulse.end_s - pulse.begin_s < 0.5 * series.t_s[series.rows() - 1];
  };
  const bool found = !pulses.empty() && std::all_of(pulses.begin(), pulses.end(), long_enough) &&
                     pulses.size() < 1000;
  if (!found || !name_pulses(pulses, series, law, baseline, findings)) {
    findings.not_found.push_back(
        {"input_disturbance", series.joint, threshold, series.unit, "", "size"});
  }
  const bool gain_named =
      std::any_of(findings.effects.begin(), findings.effects.end(),
                  [](const NamedEffect& e) { return e.id == "controller_gain"; });
  if (!gain_named && nominal > 0.0)
    findings.not_found.push_back({"controller_gain", series.joint, tolerance, "1", "", "ratio"});
  return findings;
}

}  // namespace ravencal::diagnose
