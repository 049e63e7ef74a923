// SPDX-License-Identifier: Apache-2.0
#include "diagnose/channel/error_left.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <random>
#include <utility>
#include <vector>

#include "core/median.hpp"
#include "diagnose/channel/homings.hpp"
#include "diagnose/effects/regimes.hpp"
#include "diagnose/explain/repetition.hpp"
#include "diagnose/findings/policy.hpp"
#include "diagnose/findings/quantiles.hpp"
#include "diagnose/fit/derived_seed.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Mean square, over that of the floor, of an error in which nothing without a name is as large as
/// the gates ask for.
double floor_factor2() { return 1.0 + kUnnamedPerFloor * kUnnamedPerFloor; }

/// Rate of a recorded position, over the window in which the joint's own was smoothed.
VectorXd rate_of(const Series& s, const VectorXd& x) {
  VectorXd rate = VectorXd::Zero(x.size());
  const double reach_s = std::max(s.motion.half_width_s, s.row_period_s());
  Index first = 0, last = 0;
  for (Index i = 0; i < x.size(); ++i) {
    if (s.fresh[static_cast<std::size_t>(i)] != 0) first = i;
    while (s.t_s[first] < s.t_s[i] - reach_s) ++first;
    last = std::max(last, i);
    while (last + 1 < x.size() && s.fresh[static_cast<std::size_t>(last + 1)] == 0 &&
           s.t_s[last + 1] <= s.t_s[i] + reach_s)
      ++last;
    if (s.t_s[last] > s.t_s[first]) rate[i] = (x[last] - x[first]) / (s.t_s[last] - s.t_s[first]);
  }
  return rate;
}

/// Over its own deviation at the training rows.
VectorXd scaled(const Series& s, const VectorXd& x) {
  const VectorXd centred = x.array() - s.training_mean(x);
  const double deviation = s.training_rms(centred);
  return deviation > 0.0 ? VectorXd(centred / deviation) : VectorXd(VectorXd::Zero(x.size()));
}

/// What physics of any name may depend on, [quantities x rows]: the joint's own circumstances and
/// acceleration, and those of all joints as well.
struct Surroundings {
  MatrixXd own, all;
};

Surroundings surroundings_of(const Series& s) {
  std::vector<VectorXd> own{scaled(s, s.motion.v)}, others;
  if (s.motion.a.size() == s.rows()) own.push_back(scaled(s, s.motion.a));
  for (const RegimeOf& c : circumstances(s)) {
    // The velocity holds both.
    if (c.name == "speed" || c.name == "direction") continue;
    (c.name.starts_with("position of") ? others : own).push_back(scaled(s, c.value));
  }
  for (const Companion& other : s.others) others.push_back(scaled(s, rate_of(s, other.value)));
  const auto count = static_cast<Index>(own.size() + others.size());
  Surroundings out;
  out.all.resize(count, s.rows());
  for (Index k = 0; k < count; ++k) {
    const auto n = static_cast<std::size_t>(k);
    out.all.row(k) = (n < own.size() ? own[n] : others[n - own.size()]).transpose();
  }
  out.own = out.all.topRows(static_cast<Index>(own.size()));
  return out;
}

/// Those rows of the series, cut into passes.
Passes passes_of(const ChannelFit& fit, const MatrixXd& circumstances,
                 const std::vector<Index>& rows, const VectorXd& residual) {
  const Series& s = *fit.model.series;
  const double most = std::max(1.0, kCorrelationsPerPass * fit.model.correlation_rows);
  Passes out{MatrixXd(circumstances.rows(), static_cast<Index>(rows.size())), residual, {}};
  int pass = -1;
  double length = 0.0;
  for (std::size_t n = 0; n < rows.size(); ++n) {
    const Index row = rows[n];
    const bool begins = n == 0 || length >= most || s.fresh[static_cast<std::size_t>(row)] != 0 ||
                        s.recording[static_cast<std::size_t>(row)] !=
                            s.recording[static_cast<std::size_t>(rows[n - 1])];
    if (begins) {
      ++pass;
      length = 0.0;
    }
    length += 1.0;
    out.circumstances.col(static_cast<Index>(n)) = circumstances.col(row);
    out.pass.push_back(pass);
  }
  return out;
}

/// Held-out rows in motion: at rest friction may be anything.
std::vector<Index> unseen_rows(const Series& s) {
  std::vector<Index> rows;
  for (Index i = 0; i < s.rows(); ++i) {
    const auto n = static_cast<std::size_t>(i);
    if (s.held_out[n] != 0 && s.valid[n] != 0 && (s.at_rest.empty() || s.at_rest[n] == 0))
      rows.push_back(i);
  }
  return rows;
}

/// Least step between recorded values that differ; 0 where they have none.
double step_of(const Series& s, const VectorXd& x) {
  constexpr double kOnStep = 0.05, kLeastOnSteps = 0.95;
  std::vector<double> changes;
  for (Index i = 1; i < x.size(); ++i) {
    const double change = std::abs(x[i] - x[i - 1]);
    if (s.fresh[static_cast<std::size_t>(i)] == 0 && s.trains(i) && change > 0.0)
      changes.push_back(change);
  }
  if (changes.empty()) return 0.0;
  const double step = core::upper_quantile(changes, 0.02);
  const auto on = std::count_if(changes.begin(), changes.end(), [step](double change) {
    return std::abs(change / step - std::round(change / step)) < kOnStep;
  });
  return static_cast<double>(on) >= kLeastOnSteps * static_cast<double>(changes.size()) ? step
                                                                                        : 0.0;
}

/// Deviation of what the sensor adds to each value: a third of neighbours against the line through
/// the two beside it (Gasser, Sroka, Jennen-Steinmetz, Biometrika 1986), by the median, which
/// stick and slip leave alone; and no less than rounding to its steps.
double resolution_of(const Series& s, const VectorXd& x) {
  constexpr double kMedianOfNormal = 0.6745;
  std::vector<double> scatter;
  for (Index i = 1; i + 1 < x.size(); ++i) {
    if (s.fresh[static_cast<std::size_t>(i)] != 0 ||
        s.fresh[static_cast<std::size_t>(i + 1)] != 0 || !s.trains(i) ||
        !(s.t_s[i + 1] > s.t_s[i - 1]))
      continue;
    const double share = (s.t_s[i] - s.t_s[i - 1]) / (s.t_s[i + 1] - s.t_s[i - 1]);
    const double between = (1.0 - share) * x[i - 1] + share * x[i + 1];
    scatter.push_back(std::abs(x[i] - between) /
                      std::sqrt(1.0 + share * share + (1.0 - share) * (1.0 - share)));
  }
  const double deviation =
      scatter.empty() ? 0.0 : core::upper_median(std::move(scatter)) / kMedianOfNormal;
  return std::max(deviation, step_of(s, x) / std::sqrt(12.0));
}

/// What the stage's filter leaves of noise that differs from row to row.
double noise_gain(const Series& s, std::uint64_t seed) {
  std::mt19937_64 engine(seed);
  VectorXd signs(s.rows());
  for (double& sign : signs) sign = (engine() & 1U) != 0 ? 1.0 : -1.0;
  return s.training_rms(s.as_seen(signs));
}

double mean_square(const VectorXd& x) {
  return x.size() > 0 ? x.squaredNorm() / static_cast<double>(x.size()) : 0.0;
}

/// Rows whose error is judged, and that error before and after the findings.
struct Judged {
  std::vector<Index> rows;
  VectorXd before, left;
  bool held_out = false;  ///< else cross-validated: the training rows
};

Judged judged_of(const ChannelFit& fit) {
  const Series& s = *fit.model.series;
  Judged j;
  j.rows = unseen_rows(s);
  j.held_out = !j.rows.empty();
  if (!j.held_out) j.rows = fit.model.blocks.rows;
  j.left = fit.held_out_residual;
  j.before = error_of_plant(fit)(j.rows);
  if (j.held_out) j.left = error_of_findings(fit)(j.rows);
  return j;
}

/// Takes the floor from passes that met the same circumstances; false where too few did.
bool measured_by_repetition(const ChannelFit& fit, const Judged& judged, ErrorLeft& e) {
  const double per_floor = floor_factor2();
  const Surroundings around = surroundings_of(*fit.model.series);
  std::optional<Repetition> best;
  for (const MatrixXd* circumstances : {&around.own, &around.all}) {
    const Passes known =
        passes_of(fit, *circumstances, fit.model.blocks.rows, fit.held_out_residual);
    const Passes asked =
        judged.held_out ? passes_of(fit, *circumstances, judged.rows, judged.left) : known;
    const auto found = repetition_of(asked, known, !judged.held_out, per_floor);
    if (!found || found->passes < kFewestPasses || found->agreement < kLeastAgreement) continue;
    // Neither is below the noise.
    if (!best || found->differs < best->differs) best = found;
  }
  if (!best) return false;
  const double quantile = kNormal95 * student_per_normal95(static_cast<double>(best->passes) - 1.0);
  const double form = least_remainder(fit);
  const double allowed2 =
      per_floor * best->differs + form * form + quantile * best->excess_deviation;
  e.measured_by = "repetition";
  e.floor = std::sqrt(best->differs);
  e.compared_rows = best->rows;
  e.agreement = best->agreement;
  e.allowed = std::sqrt(allowed2);
  e.reached = best->left <= allowed2;
  return true;
}

/// RMS of what was recorded, about its mean: the effort, or the position that an error adds to.
double signal_of(const Series& s) {
  const VectorXd& signal = s.stage == Stage::kDrive ? s.y : s.motion.q;
  return s.training_rms(signal.array() - s.training_mean(signal));
}

/// Takes the floor from what the channel's sensors resolve; false where they show nothing. A sensor
/// wanders by more than it resolves, and without repetition nobody knows by how much: the alarm
/// waits until most of what was recorded is left.
bool measured_by_resolution(const ChannelFit& fit, ErrorLeft& e) {
  const Series& s = *fit.model.series;
  const bool filtered = s.recorded.size() > 0;
  e.floor = resolution_of(s, filtered ? s.recorded : s.y);
  if (filtered) e.floor *= noise_gain(s, derived_seed(1, "noise gain"));
  if (!(e.floor > 0.0)) return false;
  e.measured_by = "resolution";
  e.allowed = std::max(std::hypot(std::sqrt(floor_factor2()) * e.floor, least_remainder(fit)),
                       std::sqrt(kMostOfSignal) * signal_of(s));
  e.reached = e.left <= e.allowed;
  return true;
}

}  // namespace

void add_error_left(const ChannelFit& fit, ChannelFindings& findings) {
  const Judged judged = judged_of(fit);
  if (judged.rows.empty()) return;
  ErrorLeft e;
  e.joint = findings.joint;
  e.stage = stage_word(findings.stage);
  e.unit = findings.unit;
  e.before = std::sqrt(mean_square(judged.before));
  e.left = std::sqrt(mean_square(judged.left));
  if (!measured_by_repetition(fit, judged, e) && !measured_by_resolution(fit, e))
    e.measured_by = "none";
  findings.left = std::move(e);
}

}  // namespace ravencal::diagnose
