// SPDX-License-Identifier: Apache-2.0
//
// What the plant predicts in one residual channel, gathered from its effects (EffectKind::predict).
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "diagnose/effects/effect_kind.hpp"
#include "diagnose/effects/nominal.hpp"
#include "diagnose/effects/shapes.hpp"

namespace ravencal::diagnose {

class NominalBuilder {
 public:
  /// Both must outlive the builder. Begins with what no single effect makes: the cable's replay
  /// and friction of other joints' cables.
  NominalBuilder(const Series& series, const physics::Plant& plant);

  [[nodiscard]] const Series& series() const { return s_; }
  [[nodiscard]] const physics::Plant& plant() const { return plant_; }
  [[nodiscard]] const physics::Joint& joint() const { return joint_; }
  [[nodiscard]] bool in(Stage stage) const { return s_.stage == stage; }
  /// True if the plant's cable acts in this channel: its replay is then in the prediction.
  [[nodiscard]] bool has_cable() const { return replay_.size() > 0; }
  [[nodiscard]] double parameter(const EffectKind& kind, std::string_view name) const {
    return joint_.parameter(kind.id(), name);
  }

  /// value * column, which may be off within the number's tolerance; nothing where it is zero.
  NominalTerm* linear(const EffectKind& kind, const std::string& parameter, const std::string& unit,
                      double value, const Eigen::VectorXd& column);
  /// A number of the cable: the column is what a small change of it does to the replay. `change`
  /// multiplies the number by a factor.
  using CableChange = std::function<void(CableNumbers&, double factor)>;
  NominalTerm* of_cable(const EffectKind& kind, const std::string& parameter,
                        const std::string& unit, double value, const CableChange& change);
  /// A form of the simulation rather than a number of the plant: never named.
  NominalTerm* form(const EffectKind& kind, const std::string& parameter, const std::string& unit,
                    double value, double deviation, Eigen::VectorXd column);
  /// What another load than the plant's does to the cable's replay.
  [[nodiscard]] Eigen::VectorXd under_load(const Eigen::VectorXd& weight,
                                           const Eigen::VectorXd& inertial) const {
    return -cable_stretch(s_, weight, inertial, s_.cable) - replay_;
  }
  void add(const Eigen::VectorXd& prediction) { nominal_.prediction += prediction; }
  /// A slow change that the plant admits is no finding: per recording its slow cosines, each with
  /// the deviation that an Ornstein-Uhlenbeck process has there, 2 S(w) / length with
  /// S(w) = 2 deviation^2 time / (1 + (w time)^2). Over a recording so long that most of the change
  /// is faster, it averages out. Held-out rows have their own, which nobody knows. `column`: change
  /// of the residual per unit of what changes.
  void slow_changes(const EffectKind& kind, const std::string& parameter, const std::string& unit,
                    const Eigen::VectorXd& column);
  /// The drive gives so many times the effort that is recorded.
  void scale_effort(double factor) { effort_scale_ = factor; }

  /// The plant's dry friction of the drive, which its effects make one after the other.
  struct PlantFriction {
    double level = 0.0;
    DryFriction law;         ///< per level
    Eigen::VectorXd dry;     ///< effort of the level alone, as the residual shows it
    Eigen::VectorXd effort;  ///< of the whole law
  };
  [[nodiscard]] std::optional<PlantFriction>& friction() { return friction_; }
  [[nodiscard]] Eigen::VectorXd effort_of(double level, const DryFriction& law) const;

  Nominal take();

 private:
  [[nodiscard]] Eigen::VectorXd replay_of(const CableNumbers& cable) const;

  const Series& s_;
  const physics::Plant& plant_;
  const physics::Joint& joint_;
  Nominal nominal_;
  Eigen::VectorXd replay_;  ///< of the plant's cable, as the residual shows it
  std::optional<PlantFriction> friction_;
  double effort_scale_ = 1.0;
};

}  // namespace ravencal::diagnose
