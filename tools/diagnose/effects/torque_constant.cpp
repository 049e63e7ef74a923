// SPDX-License-Identifier: Apache-2.0
//
// The motor gives more or less effort than commanded: the recorded effort is the needed one over
// 1 + ratio. The needed effort is the plant's, so that recorded noise does not explain itself.
#include "diagnose/effects/effects.hpp"
#include "diagnose/effects/shapes.hpp"

namespace ravencal::diagnose {
namespace {

class TorqueConstant final : public EffectForm {
 public:
  TorqueConstant() : EffectForm("torque_constant") {}
  std::string untestable(const Series& s) const override {
    return s.weight.size() > 0 && range_of(s, s.weight) > 0.0
               ? ""
               : "no known load acts on the drive: hang a known weight on the tool";
  }
  Eigen::MatrixXd columns(const Series& s, const Shape&) const override { return -known_effort(s); }
  std::vector<FormParameter> parameters(const Series&, const Shape&,
                                        const Eigen::VectorXd& b) const override {
    return {{"ratio", b[0], "1"}};
  }
  std::string inconsistency(const Series&, const Shape&, const Eigen::VectorXd& b) const override {
    return std::abs(b[0]) < 0.7 ? "" : "no motor is that far from its data sheet";
  }
  std::vector<std::string> twins(const Series&) const override { return {"gravity", "payload"}; }
  std::string separate_by() const override {
    return "the same motion with a known weight on the tool: a wrong torque constant scales it, a "
           "wrong mass adds to it";
  }
};

}  // namespace

std::unique_ptr<EffectForm> torque_constant() { return std::make_unique<TorqueConstant>(); }

}  // namespace ravencal::diagnose
