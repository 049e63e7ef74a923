// SPDX-License-Identifier: Apache-2.0
//
// An effort (or, where only positions are compared, its lag) that depends on posture alone. Where
// the plant has no links the shape is not known; variants offer more and more general ones, and
// cross-validation takes the one that predicts best. Where no drive was recorded, the effort is
// seen by what it stretches: of that only a weight's own shape is none of the transmission's.
#include <algorithm>
#include <array>

#include "diagnose/effects/effects.hpp"
#include "diagnose/effects/nominal_builder.hpp"
#include "diagnose/effects/shapes.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;

class Gravity final : public EffectForm {
 public:
  explicit Gravity(const EffectKind& kind) : EffectForm(kind) {}
  std::string untestable(const Series& s) const override {
    if (range_of(s, s.motion.q) <= 20.0 * s.rest_width()) return "the joint hardly moves";
    return grid(s).empty() ? "its stretch is a ratio's, as far as the joint turns" : "";
  }
  std::vector<Shape> grid(const Series& s) const override {
    // Through a few degrees sine and cosine are a line and a parabola, which no weight bends so.
    constexpr double kLeastTurn_rad = 0.5;
    const bool turns = !s.prismatic && range_of(s, s.motion.q) > kLeastTurn_rad;
    if (weighs_by_stretch(s)) return turns ? std::vector<Shape>{{1.0}} : std::vector<Shape>{};
    std::vector<Shape> shapes = {{0.0}};
    if (turns) shapes.push_back({1.0});
    if (!s.others.empty()) shapes.insert(shapes.end(), {{2.0}, {3.0}});
    return shapes;
  }
  Eigen::MatrixXd columns(const Series& s, const Shape& shape) const override {
    const Eigen::MatrixXd effort = efforts(s, shape);
    return weighs_by_stretch(s) ? Eigen::MatrixXd(-s.cable.compliance * effort) : effort;
  }
  /// A plant without any weight on a cable that stretches is not finished.
  bool ordinary(const Series& s) const override { return weighs_by_stretch(s); }
  bool takes_any_shape(const Series& s) const override { return !weighs_by_stretch(s); }
  std::vector<FormParameter> parameters(const Series& s, const Shape& shape,
                                        const Eigen::VectorXd& b) const override {
    const std::string unit = weighs_by_stretch(s) ? effort_unit(s) : amplitude_unit(s);
    return {{"posture_effort_rms", s.training_rms(efforts(s, shape) * b), unit}};
  }
  std::vector<std::string> look_alikes(const Series& s) const override {
    if (s.stage == Stage::kTracking) return {"payload", "coupling"};
    return {"payload"};
  }
  std::string separate_by() const override {
    return "the same motion with 0 and 500 g on the tool: weight adds in proportion, cables that "
           "pull with posture do not";
  }

 private:
  /// 0: own position; 1: its sine and cosine; 2: with the first two others; 3: squares and
  /// products.
  static Eigen::MatrixXd efforts(const Series& s, const Shape& shape) {
    std::vector<Eigen::VectorXd> x = {scaled(s, s.motion.q)};
    if (shape[0] == 1.0) {
      x = {s.motion.q.array().sin().matrix(), s.motion.q.array().cos().matrix()};
      for (auto& column : x) column = centred(s, column);
    }
    if (shape[0] >= 2.0) {
      // Weight acts on the first joints of an arm; the wrist's say little about it.
      for (std::size_t k = 0; k < std::min<std::size_t>(s.others.size(), 2); ++k)
        x.push_back(scaled(s, s.others[k].value));
    }
    if (shape[0] == 3.0) {
      const std::size_t count = x.size();
      for (std::size_t i = 0; i < count; ++i) {
        for (std::size_t k = i; k < count; ++k) x.push_back(centred(s, x[i].cwiseProduct(x[k])));
      }
    }
    Eigen::MatrixXd out(s.rows(), static_cast<Index>(x.size()));
    for (std::size_t c = 0; c < x.size(); ++c) out.col(static_cast<Index>(c)) = x[c];
    return out;
  }
};

class GravityKind final : public EffectKind {
 public:
  GravityKind()
      : EffectKind("gravity", Stage::kDrive,
                   {.origin = Origin::kArmLoad,
                    .probes = Probe::kLoaded | Probe::kWeighed,
                    .sentence = "the links weigh more or less than the plant's",
                    .enters_at = "drive",
                    .weight = Weight::kOfLinks,
                    .cable = CablePart::kWeight}) {}
  void add_forms(const FormContext& context, Forms& forms) const override {
    const Series& s = context.series;
    // A plant with links knows the shape of their weight; the posture's shape is then no candidate.
    const bool unknown_weight =
        s.weight.size() == 0 && (s.stage == Stage::kDrive || weighs_by_stretch(s));
    if (unknown_weight || s.stage == Stage::kTracking)
      forms.push_back(std::make_unique<Gravity>(*this));
  }
  [[nodiscard]] std::span<const DriveParameter> drive_parameters() const override {
    return kNumbers;
  }
  void predict(NominalBuilder& builder) const override {
    const Series& s = builder.series();
    if (s.weight.size() > 0) {
      NominalTerm* scale = builder.of_cable(*this, "weight_scale", "1", 1.0,
                                            [](CableNumbers& n, double f) { n.weight_scale *= f; });
      if (scale != nullptr && builder.in(Stage::kTransmission) && s.weight_deviation)
        scale->be_form(*s.weight_deviation);
    }
    if (!builder.in(Stage::kTransmission) || !builder.has_cable()) return;
    found_load(builder);
    constant_load(builder);
  }

  bool improve(physics::Plant& improved, const PlantFinding& finding) const override {
    const NamedParameter& p = finding.effect.parameters.front();
    const double mass_kg = finding.plant.joints[finding.joint].link.mass_kg;
    if (p.name != "weight_scale" || mass_kg <= 0.0) return EffectKind::improve(improved, finding);
    if (p.in_plant() < 0.0) return false;
    improved.joints[finding.joint].link.mass_kg = mass_kg * p.in_plant();
    return true;
  }

 private:
  static constexpr std::array<DriveParameter, 1> kNumbers = {{
      {physics::DriveField::kWeight, "weight_scale", true, false},
  }};

  /// A load that the drive alone found is friction that looks like one, unless the cable feels it
  /// as well: none, all and twice of it are as likely here.
  void found_load(NominalBuilder& builder) const {
    const Series& s = builder.series();
    if (s.found_load.size() == 0) return;
    const Eigen::VectorXd known = s.weight - s.found_load;
    const double found = s.training_rms(s.found_load);
    if (found < 0.1 * s.training_rms(known) || s.training_rms(known) < 0.1 * found) return;
    builder.form(*this, "found_share", "1", 1.0, 0.8,
                 cable_stretch(s, known, s.cable) - cable_stretch(s, s.cable));
  }

  /// A constant effort of the drive is a weight that the cable carries or an error of the drive's
  /// own: none and all of it are as likely. It adds a constant and nothing else: beside a free one
  /// it gives a fit no freedom.
  void constant_load(NominalBuilder& builder) const {
    const Series& s = builder.series();
    const double stretch = s.constant_load * s.cable.compliance;
    if (stretch == 0.0) return;
    const Eigen::VectorXd half = Eigen::VectorXd::Constant(s.rows(), -0.5 * stretch);
    builder.add(half);
    builder.form(*this, "constant_load", "1", 0.5, 1.0, half);
  }
};

}  // namespace

const EffectKind& gravity_kind() {
  static const GravityKind kind;
  return kind;
}

}  // namespace ravencal::diagnose
