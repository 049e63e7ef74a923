// SPDX-License-Identifier: Apache-2.0
//
// Cable and arm stretch under load: position = motor - load * compliance. The load is recorded, or
// the weight that the plant's links put on the joint. With recorded loads, variants let the
// compliance depend on posture (free cable length, levers) and on the load itself (cables stiffen).
#include <fmt/format.h>

#include "diagnose/effects/effects.hpp"
#include "diagnose/effects/nominal_builder.hpp"
#include "diagnose/effects/shapes.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

class Compliance final : public EffectForm {
 public:
  explicit Compliance(const EffectKind& kind) : EffectForm(kind) {}

  std::string untestable(const Series& s) const override {
    if (s.loads.empty() && s.transmitted.size() == 0) {
      return "no load was recorded and the plant's links have no weight";
    }
    for (const Companion& load : s.loads) {
      if (range_of(s, load.value) > 0.0) return {};
    }
    if (s.transmitted.size() > 0 && range_of(s, s.transmitted) > 0.0) return {};
    return "the load on this joint never changes";
  }
  std::vector<Shape> grid(const Series& s) const override {
    if (replayed(s)) {
      // Compliances that stretch the cable from a third of what counts as motion to a tenth of it.
      const double load = s.training_rms(s.transmitted);
      return log_grid(0.3 * s.rest_width() / load, 0.1 * range_of(s, s.motion.q) / load, 6);
    }
    if (s.loads.empty()) return {{0.0, 0.0}};
    // Plain, with one joint's posture, with all of them; each also with stiffening. Simplest first.
    std::vector<Shape> grid;
    const std::size_t postures = 2 + s.others.size();
    for (std::size_t posture = 0; posture <= postures; ++posture) {
      for (const double stiffening : {0.0, 1.0})
        grid.push_back({static_cast<double>(posture), stiffening});
    }
    return grid;
  }
  bool ordinary(const Series& s) const override { return replayed(s); }
  bool unit_coefficient(const Series& s) const override { return replayed(s); }
  MatrixXd columns(const Series& s, const Shape& shape) const override {
    if (replayed(s)) {
      CableNumbers changed = s.cable;
      changed.compliance += shape[0];
      return cable_change(s, changed);
    }
    if (s.loads.empty()) return -s.transmitted;
    std::vector<Eigen::VectorXd> columns;
    for (const Companion& load : s.loads) columns.emplace_back(-load.value);
    for (const Companion& load : s.loads) {
      for (const Companion& posture : postures(s, shape))
        columns.emplace_back(-load.value.cwiseProduct(scaled(s, posture.value)));
    }
    if (shape[1] > 0.0) {
      for (const Companion& load : s.loads)
        columns.emplace_back(-load.value.cwiseProduct(load.value.cwiseAbs()));
    }
    MatrixXd out(s.rows(), static_cast<Index>(columns.size()));
    for (std::size_t c = 0; c < columns.size(); ++c) out.col(static_cast<Index>(c)) = columns[c];
    return out;
  }
  std::vector<FormParameter> parameters(const Series& s, const Shape& shape,
                                        const Eigen::VectorXd& b) const override {
    if (replayed(s))
      return {{"compliance", shape[0] * b[0], per(amplitude_unit(s), effort_unit(s))}};
    if (s.loads.empty()) return {{"compliance", b[0], per(amplitude_unit(s), effort_unit(s))}};
    std::vector<FormParameter> out;
    for (std::size_t n = 0; n < s.loads.size(); ++n) {
      out.push_back({"compliance_to_" + s.loads[n].name, b[static_cast<Index>(n)],
                     per(amplitude_unit(s), s.loads[n].unit)});
    }
    const auto loads = static_cast<Index>(s.loads.size());
    add_posture(s, shape, b, out);
    if (shape[1] <= 0.0) return out;
    for (Index n = 0; n < loads; ++n) {
      const Companion& load = s.loads[static_cast<std::size_t>(n)];
      out.push_back({"stiffening_to_" + load.name, b[b.size() - loads + n],
                     per(amplitude_unit(s), load.unit + "2")});
    }
    return out;
  }
  std::size_t sizes(const Series& s) const override {
    return std::max<std::size_t>(1, s.loads.size());
  }
  std::string inconsistency(const Series& s, const Shape&,
                            const Eigen::VectorXd& b) const override {
    if (replayed(s)) return b[0] > 0.67 && b[0] < 1.5 ? "" : "the stretch does not fit its load";
    return s.loads.empty() && b[0] < 0.0 ? "nothing stretches against its load" : "";
  }
  std::string separate_by() const override {
    return "repeat the same motion with 0.5 kg on the tool: stretch grows with the load, a wrong "
           "ratio does not";
  }

 private:
  /// Positions on which the compliance depends: none, own, one other joint's, all.
  static std::vector<Companion> postures(const Series& s, const Shape& shape) {
    std::vector<Companion> all = {{s.joint, position_unit(s), s.motion.q}};
    all.insert(all.end(), s.others.begin(), s.others.end());
    const auto which = static_cast<std::size_t>(shape[0]);
    if (which == 0) return {};
    if (which > all.size()) return all;
    return {all[which - 1]};
  }

  /// Where the plain compliance holds, and its slope over each posture.
  static void add_posture(const Series& s, const Shape& shape, const Eigen::VectorXd& b,
                          std::vector<FormParameter>& out) {
    const std::vector<Companion> used = postures(s, shape);
    for (std::size_t p = 0; p < used.size(); ++p) {
      out.push_back({"centre_of_" + used[p].name, s.training_mean(used[p].value), used[p].unit});
      const double spread = s.training_rms(centred(s, used[p].value));
      for (std::size_t n = 0; n < s.loads.size(); ++n) {
        // As columns() has them: after the plain ones, load by load.
        const auto at = static_cast<Index>(s.loads.size() + n * used.size() + p);
        out.push_back({"slope_to_" + s.loads[n].name + "_by_" + used[p].name,
                       spread > 0.0 ? b[at] / spread : 0.0,
                       per(per(amplitude_unit(s), s.loads[n].unit), used[p].unit)});
      }
    }
  }
};

class ComplianceKind final : public EffectKind {
 public:
  ComplianceKind()
      : EffectKind(
            "compliance", Stage::kTransmission,
            {.abscissa = Abscissa::kLoad, .probes = Probe::kLoaded, .cable = CablePart::kSpring}) {}
  void add_forms(const FormContext& context, Forms& forms) const override {
    if (context.series.stage == Stage::kTransmission)
      forms.push_back(std::make_unique<Compliance>(*this));
  }
  void predict(NominalBuilder& builder) const override {
    const Series& s = builder.series();
    const CableNumbers& cable = s.cable;
    if (builder.in(Stage::kTransmission))
      builder.of_cable(*this, "stiffness", per(effort_unit(s), position_unit(s)),
                       cable.compliance > 0.0 ? 1.0 / cable.compliance : 0.0,
                       [](CableNumbers& n, double f) { n.compliance /= f; });
    // How friction behind the cable builds up at the drive is the cable's microphysics.
    if (!builder.in(Stage::kDrive) || cable.friction_level <= 0.0) return;
    NominalTerm* term = builder.of_cable(*this, "stiffness", "1", cable.compliance,
                                         [](CableNumbers& n, double f) { n.compliance *= f; });
    if (term != nullptr) term->be_form(1.0);
  }
  [[nodiscard]] PlantValues plant_values(const NamedEffect& e,
                                         const physics::Joint& joint) const override {
    const double found = plant_value(e, "compliance");
    if (found <= 0.0) return {};
    const double stiffness = joint.parameter(id(), "stiffness");
    const double whole = found + (stiffness > 0.0 ? 1.0 / stiffness : 0.0);
    // The recording says nothing about damping; a hundredth of the stiffness per second is stable.
    return {{"stiffness", 1.0 / whole},
            {"damping", std::max(joint.parameter(id(), "damping"), 0.01 / whole)}};
  }
  bool improve(physics::Plant& improved, const PlantFinding& finding) const override {
    const bool of_loads = finding.effect.parameters.front().name.starts_with(kLoad);
    if (!of_loads) return EffectKind::improve(improved, finding);
    set_load_compliance(improved.joints[finding.joint], finding.effect);
    return true;
  }

 private:
  static constexpr std::string_view kLoad = "compliance_to_", kPosture = "centre_of_";

  /// Compliance to recorded loads: an effect for each load and each posture on which it depends.
  /// Those that the plant had are replaced.
  static void set_load_compliance(physics::Joint& improved, const NamedEffect& e) {
    std::erase_if(improved.effects, [&](const physics::Effect& effect) {
      return effect.id == e.id && !effect.from.empty();
    });
    for (const NamedParameter& p : e.parameters) {
      if (!p.name.starts_with(kLoad)) continue;
      const std::string load = p.name.substr(kLoad.size());
      physics::Effect plain{e.id, load, {}};
      double at_zero = p.value;
      for (const NamedParameter& centre : e.parameters) {
        if (!centre.name.starts_with(kPosture)) continue;
        const std::string posture = centre.name.substr(kPosture.size());
        const double slope = plant_value(e, fmt::format("slope_to_{}_by_{}", load, posture));
        at_zero -= slope * centre.value;
        improved.effects.push_back(
            {e.id,
             load,
             {{"stretch_per_load", 0.0}, {"stretch_per_load_and_posture", slope}},
             posture});
      }
      plain.parameters.emplace("stretch_per_load", at_zero);
      const double stiffening = plant_value(e, "stiffening_to_" + load);
      if (stiffening != 0.0) plain.parameters.emplace("stiffening_per_load2", stiffening);
      improved.effects.push_back(std::move(plain));
    }
  }
};

}  // namespace

const EffectKind& compliance_kind() {
  static const ComplianceKind kind;
  return kind;
}

}  // namespace ravencal::diagnose
