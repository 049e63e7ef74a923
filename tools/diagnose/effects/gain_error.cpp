// SPDX-License-Identifier: Apache-2.0
//
// The transmission ratio is not the one in the plant: the error grows with the joint's own
// position, the same in both directions and under all loads.
#include "diagnose/effects/effects.hpp"
#include "diagnose/effects/shapes.hpp"

namespace ravencal::diagnose {
namespace {

class GainError final : public EffectForm {
 public:
  GainError() : EffectForm("gain_error") {}
  std::string untestable(const Series& s) const override {
    return range_of(s, s.motion.q) > 20.0 * s.rest_width() ? "" : "the joint hardly moves";
  }
  Eigen::MatrixXd columns(const Series& s, const Shape&) const override {
    return s.motion.q;  // about the joint's zero, so that a constant is left to homing_offset
  }
  std::vector<FormParameter> parameters(const Series&, const Shape&,
                                        const Eigen::VectorXd& b) const override {
    return {{"ratio", b[0], "1"}};
  }
  std::string inconsistency(const Series&, const Shape&, const Eigen::VectorXd& b) const override {
    return std::abs(b[0]) < 0.5 ? "" : "a ratio cannot be wrong by half";
  }
  std::vector<std::string> twins(const Series& s) const override {
    if (weighs_by_stretch(s) && s.weight.size() == 0) return {"gravity"};
    return {};
  }
  std::string separate_by() const override {
    return "repeat the same motion with 0.5 kg on the tool: a wrong ratio stays, stretch grows";
  }
};

}  // namespace

std::unique_ptr<EffectForm> gain_error() { return std::make_unique<GainError>(); }

}  // namespace ravencal::diagnose
