// SPDX-License-Identifier: Apache-2.0
//
// A pulley runs out of true: a wave over the joint's position, the same in both directions.
#include "diagnose/effects/effects.hpp"
#include "diagnose/effects/shapes.hpp"

namespace ravencal::diagnose {
namespace {

class EccentricityForm final : public EffectForm {
 public:
  EccentricityForm() : EffectForm("eccentricity") {}
  std::string untestable(const Series& s) const override {
    return reversals(s) >= 4 && range_of(s, s.motion.q) > 100.0 * s.rest_width()
               ? ""
               : "fewer than two periods of any pulley were passed, both ways";
  }
  // From a period and a fifth over the range up to 40: beyond, the passes' positions do not repeat
  // well enough.
  std::vector<Shape> grid(const Series& s) const override {
    const double range = range_of(s, s.motion.q);
    constexpr double kTurn = 2.0 * 3.14159265358979323846;
    return log_grid(1.2 * kTurn / range, 40.0 * kTurn / range, 44);
  }
  bool continuous() const override { return true; }
  Eigen::MatrixXd columns(const Series& s, const Shape& shape) const override {
    Eigen::MatrixXd out(s.rows(), 2);
    out.col(0) = (shape[0] * s.motion.q.array()).sin();
    out.col(1) = (shape[0] * s.motion.q.array()).cos();
    return out;
  }
  std::vector<FormParameter> parameters(const Series& s, const Shape& shape,
                                        const Eigen::VectorXd& b) const override {
    return {{"amplitude", b.norm(), amplitude_unit(s)},
            {"order", shape[0], s.prismatic ? "rad_per_m" : "1"},
            {"phase", std::atan2(b[1], b[0]), "rad"}};
  }
  std::string separate_by() const override {
    return "pass the whole range slowly both ways ten times: a pulley's wave repeats at the order "
           "of a part in the drawing";
  }
};

}  // namespace

std::unique_ptr<EffectForm> eccentricity() { return std::make_unique<EccentricityForm>(); }

}  // namespace ravencal::diagnose
