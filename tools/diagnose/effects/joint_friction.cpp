// SPDX-License-Identifier: Apache-2.0
//
// Friction behind the cable holds part of the cable's stretch: after a reversal the joint waits
// until the cable has been wound from one side to the other. The loop is at least as wide as it is
// high.
#include "diagnose/effects/effects.hpp"
#include "diagnose/effects/nominal_builder.hpp"
#include "diagnose/effects/shapes.hpp"

namespace ravencal::diagnose {
namespace {

class JointFriction final : public EffectForm {
 public:
  explicit JointFriction(const EffectKind& kind) : EffectForm(kind) {}
  std::string untestable(const Series& s) const override {
    return reversals(s) >= 6 ? "" : "the motion reverses fewer than six times";
  }
  std::vector<Shape> grid(const Series& s) const override {
    if (by_cable(s)) {
      const double whole = range_of(s, s.motion.q) / s.cable.compliance;
      const double least = 0.3 * s.rest_width() / s.cable.compliance;
      return log_grid(least, std::max(2.0 * least, 0.1 * whole), 7);
    }
    return log_grid(2.0 * s.rest_width(),
                    std::max(4.0 * s.rest_width(), 0.4 * range_of(s, s.motion.q)), 8);
  }
  bool continuous() const override { return true; }
  Eigen::MatrixXd columns(const Series& s, const Shape& shape) const override {
    if (by_cable(s)) {
      CableNumbers changed = s.cable;
      changed.friction_level += shape[0];
      if (s.stage == Stage::kDrive) return tension_change(s, changed);
      return cable_change(s, changed);
    }
    return -direction_memory(s.loop_motion(), shape[0], s.fresh);
  }
  bool unit_coefficient(const Series& s) const override { return by_cable(s); }
  std::vector<FormParameter> parameters(const Series& s, const Shape& shape,
                                        const Eigen::VectorXd& b) const override {
    if (by_cable(s)) return {{"level", shape[0] * b[0], effort_unit(s)}};
    return {{"stretch", b[0], position_unit(s)}, {"width", shape[0], position_unit(s)}};
  }
  std::string inconsistency(const Series& s, const Shape& shape,
                            const Eigen::VectorXd& b) const override {
    if (by_cable(s))
      return b[0] > 0.67 && b[0] < 1.5 ? ""
                                       : "the loop's height does not fit the cable's stiffness";
    if (b[0] <= 0.0) return "friction would push the joint ahead of its motor";
    return 2.0 * b[0] < 1.5 * shape[0] ? "" : "the loop is higher than it is wide";
  }
  std::vector<std::string> look_alikes(const Series& s) const override {
    if (s.weight.size() > 0) return {};
    return {"backlash"};
  }
  std::string separate_by() const override {
    return "press the joint to and fro by hand or with torque pulses below breakaway: a gap moves "
           "without effort, friction behind a cable does not";
  }

 private:
  /// The cable's stiffness is known, so that height and width of the loop follow from one level.
  static bool by_cable(const Series& s) {
    return s.cable.compliance > 0.0 && (replayed(s) || s.stage == Stage::kDrive);
  }
};

class JointFrictionKind final : public EffectKind {
 public:
  JointFrictionKind()
      : EffectKind("joint_friction", Stage::kTransmission,
                   {.abscissa = Abscissa::kLoad,
                    .probes = Probe::kReversals | Probe::kPressed,
                    .friction = Friction::kBehindCable,
                    .cable = CablePart::kFriction,
                    .follows_joint = true}) {}
  void add_forms(const FormContext& context, Forms& forms) const override {
    const Series& s = context.series;
    const bool winds = s.stage == Stage::kDrive && s.cable.compliance > 0.0;
    if (winds || s.stage == Stage::kTransmission)
      forms.push_back(std::make_unique<JointFriction>(*this));
  }
  void predict(NominalBuilder& builder) const override {
    const Series& s = builder.series();
    const bool drive = builder.in(Stage::kDrive);
    NominalTerm* level =
        builder.of_cable(*this, "level", drive ? s.unit : effort_unit(s), s.cable.friction_level,
                         [](CableNumbers& n, double f) { n.friction_level *= f; });
    if (level == nullptr) return;
    level->variation = builder.parameter(*this, "variation");
    const Eigen::VectorXd column = level->column;
    if (drive) builder.slow_changes(*this, "variation", "1", column);
    // How far friction behind the cable yields before it slips is microphysics, which no
    // simulation has exactly.
    NominalTerm* presliding =
        builder.of_cable(*this, "presliding", position_unit(s), s.cable.friction_presliding,
                         [](CableNumbers& n, double f) { n.friction_presliding *= f * f * f; });
    if (presliding != nullptr) presliding->be_form(1.0);
    if (!drive) starts(builder);
  }

  [[nodiscard]] PlantValues plant_values(const NamedEffect& e,
                                         const physics::Joint& joint) const override {
    const double stiffness = joint.parameter("compliance", "stiffness");
    const double level = plant_value(e, "level");
    const bool stretches = find_parameter(e, "stretch") != nullptr;
    if (stretches && joint.find_effect("compliance") == nullptr) return loop_values(e);
    // How friction yields before it slips was not asked: a tenth of the cable's wind-up.
    if (level > 0.0)
      return {{"level", level + joint.parameter(id(), "level")},
              {"presliding", std::max(joint.parameter(id(), "presliding"),
                                      stiffness > 0.0 ? 0.1 * level / stiffness : 1e-4)}};
    if (stiffness <= 0.0) return {};
    const double stretch = plant_value(e, "stretch");
    return {{"level", stretch * stiffness},
            {"presliding", std::max(1e-6, 0.5 * plant_value(e, "width") - stretch)}};
  }

 private:
  /// Of a side in [-1, 1] from another one, so that the greatest difference is at its limit.
  static constexpr double kSideDeviation = 1.6;
  /// Starts that are more frequent are poses of a static set.
  static constexpr Eigen::Index kMostStarts = 40;

  /// Which side friction behind the cable was left on before a start is a state, not physics: it
  /// lasts until the joint has moved, and no side is likelier.
  void starts(NominalBuilder& builder) const {
    const Series& s = builder.series();
    CableNumbers left = s.cable;
    left.friction_start = 1.0;
    CableNumbers right = s.cable;
    right.friction_start = -1.0;
    const Eigen::VectorXd half = 0.5 * (cable_stretch(s, right) - cable_stretch(s, left));
    for (Eigen::Index first = 0, last = 0; first < s.rows(); first = last) {
      last = first + 1;
      while (last < s.rows() && s.fresh[static_cast<std::size_t>(last)] == 0) ++last;
      const auto part = half.segment(first, last - first);
      const bool seen = part.cwiseAbs().maxCoeff() > s.rest_width();
      if (!seen || kMostStarts * (last - first) < s.rows() ||
          s.held_out[static_cast<std::size_t>(first)] != 0)
        continue;
      Eigen::VectorXd column = Eigen::VectorXd::Zero(s.rows());
      column.segment(first, last - first) = part;
      builder.form(*this, "start_side", "1", 0.0, kSideDeviation, std::move(column));
    }
  }
};

}  // namespace

const EffectKind& joint_friction_kind() {
  static const JointFrictionKind kind;
  return kind;
}

}  // namespace ravencal::diagnose
