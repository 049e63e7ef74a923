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
    return shows_waves(s) ? "" : "fewer than two periods of any pulley were passed, both ways";
  }
  // From a period and a fifth over the range up to 40: beyond, the passes' positions do not repeat
  // well enough.
  std::vector<Shape> grid(const Series& s) const override { return wave_orders(s, 1.2, 40.0, 44); }
  bool continuous() const override { return true; }
  Eigen::MatrixXd columns(const Series& s, const Shape& shape) const override {
    return wave_columns(s, shape);
  }
  std::vector<FormParameter> parameters(const Series& s, const Shape& shape,
                                        const Eigen::VectorXd& b) const override {
    return wave_parameters(s, shape, b);
  }
  std::string separate_by() const override {
    return "pass the whole range slowly both ways ten times: a pulley's wave repeats at the order "
           "of a part in the drawing";
  }
};

}  // namespace

std::unique_ptr<EffectForm> eccentricity() { return std::make_unique<EccentricityForm>(); }

}  // namespace ravencal::diagnose
