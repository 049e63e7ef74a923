// SPDX-License-Identifier: Apache-2.0
//
// The motor side is known in steps coarser than the plant's encoder has: the error follows the
// saw-tooth between the steps. The column is the smooth motion minus the recorded one; the
// recording itself says how wide its steps are.
#include <algorithm>
#include <cmath>

#include "core/median.hpp"
#include "diagnose/effects/effects.hpp"
#include "diagnose/effects/shapes.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// Steps below this share of the range are counts of an encoder and no mismatch.
constexpr double kLeastStepShare = 1e-3;
/// Share of the rows that repeat the value before, or leave it by whole steps.
constexpr double kLeastOnSteps = 0.95;

/// Width of the recorded position's steps; 0 if it has none.
double step_of(const Series& s) {
  std::vector<double> changes;
  double moving = 0.0;
  for (Index i = 1; i < s.rows(); ++i) {
    if (s.fresh[static_cast<std::size_t>(i)] != 0 || !s.trains(i)) continue;
    moving += 1.0;
    const double change = std::abs(s.motion.q[i] - s.motion.q[i - 1]);
    if (change > 1e-12) changes.push_back(change);
  }
  if (changes.size() < 20 || moving < 200.0) return 0.0;
  const double step = core::upper_quantile(changes, 0.1);
  double on_steps = 0.0;
  for (const double change : changes) {
    const double count = std::round(change / step);
    on_steps += count >= 1.0 && std::abs(change / step - count) < 0.05 * count ? 1.0 : 0.0;
  }
  return on_steps >= kLeastOnSteps * static_cast<double>(changes.size()) ? step : 0.0;
}

class Quantisation final : public EffectForm {
 public:
  explicit Quantisation(const EffectKind& kind) : EffectForm(kind) {}
  std::string untestable(const Series& s) const override {
    const double step = step_of(s);
    if (step == 0.0) return "the recorded position has no steps of one width";
    return step > kLeastStepShare * range_of(s, s.motion.q)
               ? ""
               : "the recorded position's steps are below a thousandth of its range";
  }
  /// Between two changes of the recorded value the motion went on evenly.
  Eigen::MatrixXd columns(const Series& s, const Shape&) const override {
    VectorXd saw = VectorXd::Zero(s.rows());
    Index last = -1;      // row of the change before
    double before = 0.0;  // position that it left
    const double widest = 1.5 * step_of(s);
    for (Index i = 1; i < s.rows(); ++i) {
      if (s.fresh[static_cast<std::size_t>(i)] != 0) last = -1;
      const double change = s.motion.q[i] - s.motion.q[i - 1];
      if (std::abs(change) < 1e-12) continue;
      const bool even = last >= 0 && std::abs(change) < widest &&
                        (s.motion.q[i] - s.motion.q[last]) * (s.motion.q[last] - before) >= 0.0;
      for (Index k = last; even && k < i; ++k) {
        const double share = (s.t_s[k] - s.t_s[last]) / (s.t_s[i] - s.t_s[last]);
        saw[k] = (share - 0.5) * change;
      }
      before = s.motion.q[i - 1];
      last = i;
    }
    return saw;
  }
  std::vector<FormParameter> parameters(const Series& s, const Shape&,
                                        const VectorXd& b) const override {
    return {{"step", std::abs(b[0]) * step_of(s), position_unit(s)}};
  }
  std::string inconsistency(const Series&, const Shape&, const VectorXd& b) const override {
    return b[0] > 0.67 && b[0] < 1.5 ? "" : "the error does not fit the width of the steps";
  }
  std::string separate_by() const override {
    return "pass a few degrees very slowly: the error repeats with every count";
  }
};

class QuantisationKind final : public EffectKind {
 public:
  QuantisationKind()
      : EffectKind(
            "quantisation", Stage::kTransmission,
            {.sentence = "the encoder resolves less than the plant's", .enters_at = "sensor"}) {}
  void add_forms(const FormContext& context, Forms& forms) const override {
    if (context.series.stage == Stage::kTransmission)
      forms.push_back(std::make_unique<Quantisation>(*this));
  }
};

}  // namespace

const EffectKind& quantisation_kind() {
  static const QuantisationKind kind;
  return kind;
}

}  // namespace ravencal::diagnose
