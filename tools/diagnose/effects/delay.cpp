// SPDX-License-Identifier: Apache-2.0
//
// Two streams are stamped at different times, or the servo lags: the error grows with speed and
// changes its sign with it.
#include "diagnose/effects/effects.hpp"
#include "diagnose/effects/shapes.hpp"

namespace ravencal::diagnose {
namespace {

class Delay final : public EffectForm {
 public:
  Delay() : EffectForm("delay") {}
  std::string untestable(const Series& s) const override {
    if (s.training_rms(s.motion.v) <= 0.0) return "the joint does not move";
    const double period_s =
        s.rows() > 1 ? (s.t_s[s.rows() - 1] - s.t_s[0]) / static_cast<double>(s.rows() - 1) : 1.0;
    return std::abs(period_s) < 0.1 ? "" : "samples are further apart than any delay";
  }
  Eigen::MatrixXd columns(const Series& s, const Shape&) const override { return -s.motion.v; }
  std::vector<FormParameter> parameters(const Series&, const Shape&,
                                        const Eigen::VectorXd& b) const override {
    return {{"delay", b[0], "s"}};
  }
  std::string inconsistency(const Series& s, const Shape&,
                            const Eigen::VectorXd& b) const override {
    if (s.stage == Stage::kTracking && b[0] < 0.0)
      return "the joint would know its command in advance";
    return std::abs(b[0]) < 0.2 ? "" : "no stream or servo is late by a fifth of a second";
  }
  std::vector<std::string> twins(const Series& s) const override {
    if (s.stage == Stage::kTracking) return {"viscous_friction"};
    return {};
  }
  std::string separate_by() const override {
    return "repeat the motion at half and at double speed: a delay's error follows the speed, "
           "hysteresis keeps its loop";
  }
};

}  // namespace

std::unique_ptr<EffectForm> delay() { return std::make_unique<Delay>(); }

}  // namespace ravencal::diagnose
