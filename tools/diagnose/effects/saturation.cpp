// SPDX-License-Identifier: Apache-2.0
//
// The drive gives no more than a limit: the joint lags or stalls while its controller asks for
// more. The column is what the plant's control law asks for beyond the limit, from recorded
// positions alone, never from the recorded effort. Friction that is higher than the plant's looks
// alike for a moment; but a servo overcomes it and follows, whereas a drive at its limit delivers
// the same whatever is asked of it, and its joint falls behind and catches up as that lets it.
#include <algorithm>
#include <cmath>
#include <utility>

#include "core/median.hpp"
#include "diagnose/effects/effects.hpp"
#include "diagnose/effects/shapes.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// The law must ask for this much more than the plant needs: its numbers are good to a tenth each.
constexpr double kExcess = 1.3;
/// Share of the usual speed below which a joint stands, or by which it must fall behind.
constexpr double kSlow = 0.1;
constexpr double kLeastTime_s = 1.0;
/// What the drive delivers at its limit is the limit, as well as the plant's numbers say it.
constexpr double kSameEffort = 0.15;
/// A joint that falls behind and catches up at its drive's limit misses its speed by this share of
/// the usual one; a servo that follows misses a tenth of it.
constexpr double kLeastLag = 0.4;

/// Share of the moving rows in which the drive gives no more than what counts as its most.
constexpr double kMost = 0.99;

struct Limit {
  double value = 0.0;  ///< 0: none found
  std::string why;     ///< then
};

/// Change per second over some rows to either side.
VectorXd rate_of(const Series& s, const VectorXd& x) {
  VectorXd rate = VectorXd::Zero(x.size());
  constexpr double kReach_s = 0.05;
  for (Index i = 1; i + 1 < x.size(); ++i) {
    Index a = i;
    Index b = i;
    while (a > 0 && s.fresh[static_cast<std::size_t>(a)] == 0 &&
           (a == i || s.t_s[i] - s.t_s[a - 1] < kReach_s))
      --a;
    while (b + 1 < x.size() && s.fresh[static_cast<std::size_t>(b + 1)] == 0 &&
           (b == i || s.t_s[b + 1] - s.t_s[i] < kReach_s))
      ++b;
    const double dt_s = s.t_s[b] - s.t_s[a];
    if (b > a && dt_s > 0.0 && std::isfinite(x[b] - x[a])) rate[i] = (x[b] - x[a]) / dt_s;
  }
  return rate;
}

/// What the controller asks for at these positions; with the desired rate fed forward if that is
/// nearer to what the motion needs.
VectorXd law_of(const Series& s, const VectorXd& needed, const VectorXd& lag_rate) {
  VectorXd damped(s.rows());
  VectorXd fed(s.rows());
  for (Index i = 0; i < s.rows(); ++i) {
    const double error = std::isfinite(s.tracking_error[i]) ? s.tracking_error[i] : 0.0;
    damped[i] = s.servo->effort(error, s.motion.v[i]);
    // The same gain on both rates damps their difference alone.
    fed[i] = s.servo->effort(error, -lag_rate[i]);
  }
  return s.training_rms(s.as_seen(fed) - needed) < s.training_rms(s.as_seen(damped) - needed)
             ? fed
             : damped;
}

/// The effort that moved the joint wherever its controller asked for clearly more than it was
/// ever given.
Limit limit_of(const Series& s, const VectorXd& needed, const VectorXd& law,
               const VectorXd& lag_rate) {
  const VectorXd asked = s.as_seen(law);
  const double speed = s.training_rms(s.motion.v);
  const auto counts = [&](Index i) {
    const auto n = static_cast<std::size_t>(i);
    return s.valid[n] != 0 && s.held_out[n] == 0;
  };
  // A joint that stands says nothing: its friction takes up whatever the drive gives.
  const auto moves = [&](Index i, double side) { return side * s.motion.v[i] > kSlow * speed; };
  std::vector<double> given;
  for (Index i = 0; i < s.rows(); ++i) {
    const double side = s.motion.v[i] < 0.0 ? -1.0 : 1.0;
    if (counts(i) && moves(i, side)) given.push_back(side * needed[i]);
  }
  const double most = core::upper_quantile(std::move(given), kMost);
  std::vector<double> moved;
  double time_s = 0.0;
  double rows = 0.0;
  double missed = 0.0;
  for (Index i = 1; i < s.rows(); ++i) {
    if (!counts(i) || most <= 0.0 || std::abs(asked[i]) < kExcess * most) continue;
    const double side = asked[i] < 0.0 ? -1.0 : 1.0;
    if (moves(i, side)) moved.push_back(side * needed[i]);
    if (s.fresh[static_cast<std::size_t>(i)] == 0) time_s += s.t_s[i] - s.t_s[i - 1];
    rows += 1.0;
    missed += lag_rate[i] * lag_rate[i];
  }
  if (moved.size() < 10 || time_s < kLeastTime_s)
    return {0.0, "the drive was never asked for clearly more than it gave"};
  const double limit = core::upper_median(moved);
  double other = 0.0;
  for (const double effort : moved) other += std::pow(effort / limit - 1.0, 2);
  if (limit <= 0.0 || other > kSameEffort * kSameEffort * static_cast<double>(moved.size()))
    return {0.0, "where the controller asked for more, the drive gave more"};
  if (missed < std::pow(kLeastLag * speed, 2) * rows)
    return {0.0, "where the controller asked for more, the joint followed"};
  return {limit, ""};
}

class Saturation final : public EffectForm {
 public:
  Saturation(const EffectKind& kind, const Series& s, const VectorXd& needed) : EffectForm(kind) {
    if (!s.servo || s.tracking_error.size() == 0) {
      limit_.why = "what the controller asks for is not known: record the desired position";
      return;
    }
    const VectorXd lag_rate = rate_of(s, s.tracking_error);
    law_ = law_of(s, needed, lag_rate);
    limit_ = limit_of(s, needed, law_, lag_rate);
  }

  std::string untestable(const Series&) const override { return limit_.why; }
  std::vector<Shape> grid(const Series&) const override {
    return log_grid(0.75 * limit_.value, 1.33 * limit_.value, 7);
  }
  bool continuous() const override { return true; }
  bool occasional() const override { return true; }
  Eigen::MatrixXd columns(const Series&, const Shape& shape) const override {
    return law_ - law_.cwiseMax(-shape[0]).cwiseMin(shape[0]);
  }
  std::vector<FormParameter> parameters(const Series& s, const Shape& shape,
                                        const VectorXd& b) const override {
    return {{"limit", shape.empty() ? 0.0 : delivered(shape[0], b[0]), effort_unit(s)}};
  }
  std::string inconsistency(const Series&, const Shape&, const VectorXd& b) const override {
    return b[0] > 0.6 && b[0] < 1.6 ? "" : "what the law asks beyond a limit is missing in full";
  }
  std::string separate_by() const override {
    return "record the drive's current as well, or repeat the motion at a third of the speed with "
           "the weight taken off: friction stays, the limit is not reached";
  }

 private:
  /// What is left of the law where it asks for more than `limit` and `share` of that is missing: a
  /// law that runs into a bound of its own leaves open which of the two is off.
  double delivered(double limit, double share) const {
    const VectorXd asked = law_.cwiseAbs();
    const VectorXd beyond = (asked.array() - limit).cwiseMax(0.0);
    const double weight = beyond.sum();
    return weight > 0.0 ? (asked - share * beyond).dot(beyond) / weight : limit;
  }

  VectorXd law_;  ///< at all rows
  Limit limit_;
};

class SaturationKind final : public EffectKind {
 public:
  SaturationKind() : EffectKind("saturation", Stage::kDrive, {.probes = Probe::kPulses}) {}
  void add_forms(const FormContext& context, Forms& forms) const override {
    if (context.series.stage == Stage::kDrive)
      forms.push_back(saturation(context.series, context.nominal.prediction));
  }
  [[nodiscard]] PlantValues plant_values(const NamedEffect& e,
                                         const physics::Joint&) const override {
    return same_values(e, {"limit"});
  }
};

}  // namespace

const EffectKind& saturation_kind() {
  static const SaturationKind kind;
  return kind;
}

std::unique_ptr<EffectForm> saturation(const Series& series, const VectorXd& needed) {
  return std::make_unique<Saturation>(saturation_kind(), series, needed);
}

}  // namespace ravencal::diagnose
