// SPDX-License-Identifier: Apache-2.0
//
// What an effect looks like in a residual: its columns as functions of exogenous signals (never of
// recorded effort, never of recorded velocity), its parameters in physical units and the bounds
// outside which the numbers cannot be that effect. One file per effect in effects/.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "diagnose/effects/effect_kind.hpp"
#include "diagnose/series/series.hpp"

namespace ravencal::diagnose {

/// Nonlinear parameters of a form: widths, time constants, orders, or the number of a variant.
using Shape = std::vector<double>;

struct FormParameter {
  std::string name;
  double value = 0.0;
  std::string unit;
};

class EffectForm {
 public:
  explicit EffectForm(const EffectKind& kind, std::string from = {})
      : kind_(kind), from_(std::move(from)) {}
  virtual ~EffectForm() = default;
  EffectForm(const EffectForm&) = delete;
  EffectForm& operator=(const EffectForm&) = delete;

  [[nodiscard]] const EffectKind& kind() const { return kind_; }
  [[nodiscard]] const Traits& traits() const { return kind_.traits(); }
  /// Id of the vocabulary; `from` names the other joint, if one takes part.
  [[nodiscard]] const std::string& id() const { return kind_.id(); }
  [[nodiscard]] const std::string& from() const { return from_; }
  [[nodiscard]] std::string key() const {
    const std::string name = from_.empty() ? id() : id() + "<" + from_;
    return nominal_term() ? name + " (out of tolerance)" : name;
  }

  /// Why this recording cannot show the effect; empty if it can.
  [[nodiscard]] virtual std::string untestable(const Series&) const { return {}; }
  /// Shapes to begin with.
  [[nodiscard]] virtual std::vector<Shape> grid(const Series&) const { return {{}}; }
  /// True if shapes are positive numbers that may be refined between grid points.
  [[nodiscard]] virtual bool continuous() const { return false; }
  /// [rows x m], all rows of the series.
  [[nodiscard]] virtual Eigen::MatrixXd columns(const Series& series, const Shape& shape) const = 0;
  [[nodiscard]] virtual std::vector<FormParameter> parameters(
      const Series& series, const Shape& shape, const Eigen::VectorXd& coefficients) const = 0;
  /// How many of the parameters, from the first, are sizes of the effect: no single one of several
  /// need be certain.
  [[nodiscard]] virtual std::size_t sizes(const Series&) const { return 1; }
  /// Why these numbers cannot be this effect; empty if they can.
  [[nodiscard]] virtual std::string inconsistency(const Series&, const Shape&,
                                                  const Eigen::VectorXd&) const {
    return {};
  }
  /// Ids that make the same columns in this recording, so that no statistic can part them.
  [[nodiscard]] virtual std::vector<std::string> look_alikes(const Series&) const { return {}; }
  /// Index of the nominal term that the form sets free beyond its tolerance; none for physics.
  [[nodiscard]] virtual std::optional<std::size_t> nominal_term() const { return std::nullopt; }
  /// True for what is as ordinary as a wrong number of the plant: what the set-up brings from one
  /// recording to the next, a motor that is not what its data sheet says, a cable that the plant
  /// takes for stiff and is not.
  [[nodiscard]] virtual bool ordinary(const Series&) const { return nominal_term().has_value(); }
  /// How far off it is, in tolerances, where the form is a number that every drive has though no
  /// plant states it; none for the plant's own and for physics.
  [[nodiscard]] virtual std::optional<double> off_by(const Eigen::VectorXd&) const {
    return std::nullopt;
  }
  /// True if columns() are already as the residual shows them.
  [[nodiscard]] virtual bool as_seen_already() const { return false; }
  /// True if the shape is the effect's size in a replay that knows its physics: at the right shape
  /// the coefficient is one.
  [[nodiscard]] virtual bool unit_coefficient(const Series&) const { return false; }
  /// True if its columns bend to any dependence on position there is: that of the motion that they
  /// were fitted to as well as the arm's.
  [[nodiscard]] virtual bool takes_any_shape(const Series&) const { return false; }
  /// True if the column depends on time alone: slow noise looks like it.
  [[nodiscard]] virtual bool time_only() const { return false; }
  /// True if the effect acts only while something happens, and that may happen once.
  [[nodiscard]] virtual bool occasional() const { return false; }
  /// RegimeOf whose halves the effect is a difference between: neither half shows it alone.
  /// `uneven`: the model's constant is one of friction that differs between the directions.
  [[nodiscard]] virtual std::string compares(bool /*uneven*/) const { return {}; }
  /// Effect that must be in the model or in the plant before this one makes sense; empty if none.
  [[nodiscard]] virtual std::string prerequisite() const { return {}; }
  /// Recording that would part the effect from those that look like it.
  [[nodiscard]] virtual std::string separate_by() const = 0;

 private:
  const EffectKind& kind_;
  std::string from_;
};

/// The form's columns as the residual shows them: in the drive stage through the filter that the
/// recorded effort has been through, so that friction's edges are as blunt on both sides.
Eigen::MatrixXd seen_columns(const EffectForm& form, const Series& series, const Shape& shape);

}  // namespace ravencal::diagnose
