// SPDX-License-Identifier: Apache-2.0
//
// The cable yields slowly under load and recovers slowly (standard linear solid): the stretch that
// is still to come is the load minus its lagged self.
#include "diagnose/effects/effects.hpp"
#include "diagnose/effects/shapes.hpp"

namespace ravencal::diagnose {
namespace {

class CreepForm final : public EffectForm {
 public:
  CreepForm() : EffectForm("creep") {}
  std::string untestable(const Series& s) const override {
    if (s.transmitted.size() == 0 && s.loads.size() != 1) {
      return "no single load on this joint is known";
    }
    return duration(s) > 30.0 ? "" : "the recording is shorter than 30 s";
  }
  std::vector<Shape> grid(const Series& s) const override {
    return log_grid(3.0, std::max(6.0, duration(s) / 4.0), 6);
  }
  bool continuous() const override { return true; }
  Eigen::MatrixXd columns(const Series& s, const Shape& shape) const override {
    if (replayed(s)) {
      CableNumbers changed = s.cable;
      const double load = std::max(1e-12, s.training_rms(s.transmitted));
      changed.creep_compliance = 3.0 * s.rest_width() / load;
      changed.creep_time_s = shape[0];
      return cable_change(s, changed) / changed.creep_compliance;
    }
    const Eigen::VectorXd& load = s.transmitted.size() > 0 ? s.transmitted : s.loads.front().value;
    return -low_pass(load, s.t_s, shape[0], s.fresh);
  }
  std::vector<FormParameter> parameters(const Series& s, const Shape& shape,
                                        const Eigen::VectorXd& b) const override {
    return {{"compliance", b[0], per(amplitude_unit(s), effort_unit(s))}, {"time", shape[0], "s"}};
  }
  std::string inconsistency(const Series&, const Shape&, const Eigen::VectorXd& b) const override {
    return b[0] > 0.0 ? "" : "the cable would shorten under load";
  }
  std::string separate_by() const override {
    return "hold a loaded pose for three minutes, then the opposite pose: creep relaxes with the "
           "load's sign, drift does not";
  }

 private:
  static double duration(const Series& s) { return range_of(s, s.t_s); }
};

}  // namespace

std::unique_ptr<EffectForm> creep() { return std::make_unique<CreepForm>(); }

}  // namespace ravencal::diagnose
