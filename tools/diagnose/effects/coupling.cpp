// SPDX-License-Identifier: Apache-2.0
//
// Another joint's motion moves this one more or less than the plant says.
#include "diagnose/effects/effects.hpp"
#include "diagnose/effects/shapes.hpp"

namespace ravencal::diagnose {
namespace {

class Coupling final : public EffectForm {
 public:
  explicit Coupling(const std::string& from) : EffectForm("coupling", from) {}
  std::string untestable(const Series& s) const override {
    const Companion& other = companion(s);
    const double range = range_of(s, other.value);
    return range > 1e-4 ? "" : "joint " + from() + " hardly moves";
  }
  Eigen::MatrixXd columns(const Series& s, const Shape&) const override {
    return companion(s).value;
  }
  std::vector<FormParameter> parameters(const Series& s, const Shape&,
                                        const Eigen::VectorXd& b) const override {
    return {{"error_from_" + from(), b[0], per(amplitude_unit(s), companion(s).unit)}};
  }
  std::string separate_by() const override {
    return "move joint " + from() + " alone over its range while this joint holds still";
  }

 private:
  [[nodiscard]] const Companion& companion(const Series& s) const {
    for (const Companion& other : s.others) {
      if (other.name == from()) return other;
    }
    return s.others.front();
  }
};

}  // namespace

std::unique_ptr<EffectForm> coupling(const std::string& from) {
  return std::make_unique<Coupling>(from);
}

}  // namespace ravencal::diagnose
