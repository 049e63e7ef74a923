// SPDX-License-Identifier: Apache-2.0
//
// One entry of the parameter vector: a number of the plant, a part of an effect that may be absent,
// or what one recording has. All are fitted alike; what they are worth is in their priors.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <limits>
#include <optional>
#include <string>

#include "diagnose/model/state.hpp"

namespace ravencal::diagnose {

/// What a parameter changes in the channels.
enum class Reaches {
  kLaw,    ///< the command of the joint's law
  kLimit,  ///< what the drive delivers of it
  kShape,  ///< one channel, by a shape without a name
  kPosition,
  kDrive,
  kCable,
  kLinkLoad,
  kRouting,  ///< everything, by the way that a cable runs
  kEverything,
};

/// The same of a parameter that a prediction shows.
inline physics::Reach reach_of(Reaches reaches) {
  switch (reaches) {
    case Reaches::kPosition:
      return physics::Reach::kPosition;
    case Reaches::kDrive:
      return physics::Reach::kDrive;
    case Reaches::kCable:
      return physics::Reach::kCable;
    case Reaches::kLinkLoad:
      return physics::Reach::kLinkLoad;
    default:
      return physics::Reach::kEverything;
  }
}

/// Deviation of the size of an effect that may be missing, in the sizes at which it is tried:
/// nothing is known of it beforehand.
inline constexpr double kUnknownSize = 1e4;

struct Parameter {
  std::string effect;  ///< id of the vocabulary
  std::string name;    ///< as a plant or report has it, without unit
  std::string unit;
  std::size_t joint = 0;
  Reaches reaches = Reaches::kDrive;
  std::optional<std::size_t> recording{};  ///< of what one recording has
  std::optional<std::size_t> shape{};      ///< of a shape without a name
  /// Value = nominal exp(x), or nominal + scale x.
  bool logarithmic = false;
  double nominal = 0.0;
  double scale = 1.0;

  double x = 0.0;          ///< where the model has it
  double mean = 0.0;       ///< of the prior, a normal distribution of x
  double deviation = 1.0;  ///< of it
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  double step = 0.02;  ///< of the finite difference
  /// Not fitted: a moment or an order that was searched for, a number that stays where it is.
  bool held = false;
  bool in_plant = true;  ///< else the recordings have it, and no plant
  /// Else it is a form or a switch, of which no report gives the value.
  bool said = true;

  std::function<void(State&, double value)> set;

  [[nodiscard]] double value() const {
    return logarithmic ? nominal * std::exp(x) : nominal + scale * x;
  }
  /// Change of the value per change of x.
  [[nodiscard]] double slope() const { return logarithmic ? value() : scale; }
  /// A change of a number relative to it, as every parameter of that name is; else the size itself.
  [[nodiscard]] bool is_relative_change() const { return name.ends_with("ratio"); }
  void apply(State& state) const { set(state, value()); }
  [[nodiscard]] bool at_bound() const { return x <= low + 1e-9 || x >= high - 1e-9; }
  /// A number that stays as the plant states it, or absent where the plant states none.
  void hold_at_plant() {
    x = mean;
    held = true;
  }
  [[nodiscard]] bool is_plants() const { return in_plant && held && x == mean; }
  [[nodiscard]] double bounded(double wanted) const { return std::clamp(wanted, low, high); }
  /// Twice the negative logarithm of the prior, constants apart.
  [[nodiscard]] double penalty() const {
    const double off = (x - mean) / deviation;
    return off * off;
  }
};

}  // namespace ravencal::diagnose
