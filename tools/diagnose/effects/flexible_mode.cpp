// SPDX-License-Identifier: Apache-2.0
//
// A mass on a spring behind the joint: below its frequency it adds to the inertia, near it it rings
// after every edge of the motion. The column is the acceleration of a unit mass carried by the
// recorded motion; the drive feels its inertial force.
#include <algorithm>
#include <cmath>

#include "core/constants.hpp"
#include "diagnose/effects/effects.hpp"
#include "diagnose/effects/shapes.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;

/// Bolted and cabled arms damp their modes by 1 to 5 % of critical (Rivin, Mechanical Design of
/// Robots, 1988).
constexpr double kDamping = 0.03;
constexpr double kLowestMode_hz = 1.5;

/// Above it the recording has fewer than six rows in a period, or the filter that efforts are seen
/// through (the kernel (1 - u^2)^2 over +-half_width_s) takes half of it away.
double highest_hz(const Series& s) {
  const double period_s = s.row_period_s();
  const double by_rate = 1.0 / (6.0 * (period_s > 0.0 ? period_s : 1.0));
  const double by_filter = 0.55 / std::max(s.motion.half_width_s, 1e-6);
  return std::min({by_rate, by_filter, 40.0});
}

class FlexibleMode final : public EffectForm {
 public:
  explicit FlexibleMode(const EffectKind& kind) : EffectForm(kind) {}
  std::string untestable(const Series& s) const override {
    if (highest_hz(s) > 1.3 * kLowestMode_hz) return {};
    return "this recording's rate, or the averaging that its noise asks for, hides oscillations of "
           "more than " +
           std::to_string(highest_hz(s)).substr(0, 4) +
           " Hz: record at 500 Hz or more, with sharp edges of the motion";
  }
  std::vector<Shape> grid(const Series& s) const override {
    return log_grid(kLowestMode_hz, highest_hz(s), 16);
  }
  bool continuous() const override { return true; }
  /// Free oscillator x'' = w^2 (q - x) + 2 d w (q' - x'), exact between rows of straight motion.
  Eigen::MatrixXd columns(const Series& s, const Shape& shape) const override {
    const double w = core::kRadPerTurn * shape[0];
    const double decay = kDamping * w;
    const double wd = w * std::sqrt(1.0 - kDamping * kDamping);
    Eigen::VectorXd force(s.rows());
    double stretch = 0.0;  // of the spring: q - x
    double rate = 0.0;     // of the stretch
    for (Index i = 0; i < s.rows(); ++i) {
      if (i == 0 || s.fresh[static_cast<std::size_t>(i)] != 0) {
        stretch = rate = 0.0;
      } else {
        // A change of the motion's velocity kicks the stretch; then it swings freely.
        rate += s.motion.v[i] - s.motion.v[i - 1];
        const double h = s.t_s[i] - s.t_s[i - 1];
        const double fade = std::exp(-decay * h);
        const double c = std::cos(wd * h);
        const double n = std::sin(wd * h) / wd;
        const double next = fade * (stretch * (c + decay * n) + rate * n);
        rate = fade * (rate * (c - decay * n) - stretch * w * w * n);
        stretch = next;
      }
      force[i] = w * w * stretch + 2.0 * decay * rate;
    }
    return force;
  }
  std::vector<FormParameter> parameters(const Series& s, const Shape& shape,
                                        const Eigen::VectorXd& b) const override {
    return {{"inertia", b[0], s.prismatic ? "kg" : "kg_m2"}, {"frequency", shape[0], "Hz"}};
  }
  std::string inconsistency(const Series& s, const Shape&,
                            const Eigen::VectorXd& b) const override {
    if (b[0] <= 0.0) return "a mass cannot be negative";
    return s.inertia <= 0.0 || b[0] < s.inertia ? "" : "more mass would swing than the joint has";
  }
  std::string separate_by() const override {
    return "steps of the desired position at 500 Hz or more: a mode rings at one frequency, "
           "inertia "
           "does not ring";
  }
};

class FlexibleModeKind final : public EffectKind {
 public:
  FlexibleModeKind()
      : EffectKind("flexible_mode", Stage::kDrive,
                   {.probes = Probe::kPulses, .sentence = "the joint swings behind its drive"}) {}
  void add_forms(const FormContext& context, Forms& forms) const override {
    if (context.series.stage == Stage::kDrive)
      forms.push_back(std::make_unique<FlexibleMode>(*this));
  }
};

}  // namespace

const EffectKind& flexible_mode_kind() {
  static const FlexibleModeKind kind;
  return kind;
}

}  // namespace ravencal::diagnose
