// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/units.hpp"
#include "guess/columns.hpp"
#include "guess/wrap_width.hpp"
#include "record/relation.hpp"

namespace ravencal::guess {
namespace {

/// Two turns: joints that turn further are rare, and 12 degrees are hardly a recording's whole
/// motion.
constexpr double kLargestRad = 4.0 * std::numbers::pi;
/// A slope counts as that of a known pair of units within a fifth.
constexpr double kSlopeTolerance = 0.2;

constexpr double kDegPerSPerRpm = 6.0;

/// A turn in radians or degrees is exact to rounding.
constexpr double kRoundingRad = 1e-6;

struct RateUnit {
  std::string_view unit;
  double scale;
};

bool is_near(double value, double wanted) {
  return std::abs(value / wanted - 1.0) < kSlopeTolerance;
}

/// A position of the velocity's joint, and the SI velocity that it says one unit of the column is.
struct Derivative {
  const Column* position = nullptr;
  double factor = 0.0;
  double correlation = 0.0;
  std::string si_name;  ///< "rad_per_s" or "m_per_s"
};

std::vector<Derivative> derivatives_of(const Columns& columns, const Column& velocity) {
  std::vector<Derivative> found;
  for (const Column& position : columns.all) {
    if (!position.is_usable_position() || position.said.joint != velocity.said.joint) continue;
    const auto line = record::derivative_line(columns.t_s, position.si(), velocity.values);
    if (!line || std::abs(line->correlation) < record::kDerivativeCorrelation) continue;
    found.push_back({&position, line->slope, std::abs(line->correlation),
                     std::string(core::find_unit(position.said.unit)->si_name) + "_per_s"});
  }
  std::sort(found.begin(), found.end(),
            [](const auto& a, const auto& b) { return a.correlation > b.correlation; });
  return found;
}

/// What velocities of a stated unit say that one of a position is, in SI.
std::vector<Derivative> values_by_velocity(const Columns& columns, const Column& position) {
  std::vector<Derivative> found;
  for (const Column& velocity : columns.all) {
    const auto unit = core::find_unit(velocity.said.unit);
    if (!velocity.is(Quantity::kVelocity) || !unit || velocity.said.joint != position.said.joint)
      continue;
    const auto line = record::derivative_line(columns.t_s, position.values, velocity.values);
    if (!line || std::abs(line->correlation) < record::kDerivativeCorrelation) continue;
    found.push_back({&position, unit->to_si * velocity.said.scale / std::abs(line->slope),
                     std::abs(line->correlation), std::string(unit->si_name)});
  }
  return found;
}

/// A position's unit by the stated unit of its velocity: travel = slope * integral.
std::string_view unit_by_velocity(const Columns& columns, const Column& position) {
  for (const Derivative& value : values_by_velocity(columns, position)) {
    for (const char* name : {"rad", "deg", "m", "mm", "cm"}) {
      const auto candidate = core::find_unit(name);
      if (value.si_name == std::string(candidate->si_name) + "_per_s" &&
          is_near(value.factor, candidate->to_si))
        return candidate->name;
    }
  }
  return {};
}

/// The width of a counter is a turn where no velocity says otherwise.
bool take_unit_of_turn(Columns& columns, Column& position) {
  const std::string& unit = position.said.unit;
  if (position.wraps_at == 0.0 || (!unit.empty() && unit != "counts")) return false;
  for (const char* name : {"rad", "deg"}) {
    if (std::abs(position.wraps_at * core::find_unit(name)->to_si - kTurnRad) >= kRoundingRad)
      continue;
    position.said.unit = name;
    return true;
  }
  position.said.unit = "rad";
  position.said.scale = kTurnRad / position.wraps_at;
  for (const Derivative& value : values_by_velocity(columns, position)) {
    if (value.si_name != "rad_per_s") continue;
    if (is_near(value.factor, position.said.scale)) return true;
    position.said.scale = value.factor;
    columns.ask(
        fmt::format("{}: one is {:.6g} rad by its velocity, so that its {:.10g} are no turn",
                    position.name, value.factor, position.wraps_at));
    position.assumed = true;
    return true;
  }
  position.assumed = true;
  columns.ask(fmt::format("positions that wrap at {:.10g}: taken as one turn of the joint",
                          position.wraps_at));
  return true;
}

void find_position_unit(Columns& columns, Column& position) {
  if (take_unit_of_turn(columns, position)) return;
  if (!position.said.unit.empty() || position.constant()) return;
  if (const std::string_view unit = unit_by_velocity(columns, position); !unit.empty()) {
    position.said.unit = unit;
    position.because +=
        fmt::format("{}{} by its velocity", position.because.empty() ? "" : ", ", unit);
    return;
  }
  const double size = std::max(std::abs(position.lowest), std::abs(position.highest));
  position.said.unit = size > kLargestRad ? "deg" : "rad";
  position.assumed = true;
  columns.ask(
      fmt::format("positions without a unit: radians where no value is beyond {:.1f}, else degrees "
                  "(or lengths?)",
                  kLargestRad));
}

/// The unit of which one is so many SI units.
const RateUnit* rate_of(const std::string& si_name, double factor) {
  static constexpr std::array<RateUnit, 5> kRates = {{{"rad_per_s", 1.0},
                                                      {"deg_per_s", 1.0},
                                                      {"deg_per_s", kDegPerSPerRpm},
                                                      {"m_per_s", 1.0},
                                                      {"mm_per_s", 1.0}}};
  const auto* const it = std::find_if(kRates.begin(), kRates.end(), [&](const RateUnit& rate) {
    const auto unit = core::find_unit(rate.unit);
    return unit->si_name == si_name && is_near(std::abs(factor), unit->to_si * rate.scale);
  });
  return it == kRates.end() ? nullptr : it;
}

void reverse_if(bool reversed, Column& velocity, const Column& position, Columns& columns) {
  if (!reversed) return;
  velocity.said.scale *= -1.0;
  columns.ask(
      fmt::format("{} runs against {}: its sign is reversed", velocity.name, position.name));
}

void find_velocity_unit(Columns& columns, Column& velocity) {
  const std::vector<Derivative> found = derivatives_of(columns, velocity);
  const auto said = core::find_unit(velocity.said.unit);
  const double stated = said ? said->to_si * velocity.said.scale : 0.0;
  const auto agrees = std::find_if(found.begin(), found.end(), [&](const Derivative& d) {
    return said && said->si_name == d.si_name && is_near(std::abs(d.factor), stated);
  });
  if (agrees != found.end()) {
    velocity.because = fmt::format("derivative of {}", agrees->position->name);
    reverse_if(agrees->factor < 0.0, velocity, *agrees->position, columns);
    return;
  }
  if (found.empty()) {
    if (said) return;
    velocity.said.unit = "rad_per_s";
    velocity.assumed = true;
    columns.ask("velocities that are the derivative of no position: taken as rad/s");
    return;
  }
  const Derivative& best = found.front();
  const RateUnit* rate = rate_of(best.si_name, best.factor);
  if (rate == nullptr && said) {
    columns.ask(
        fmt::format("{} names {}, but is {:.4g} times the derivative of {}: of another shaft?",
                    velocity.name, velocity.said.unit, stated / best.factor, best.position->name));
    return;
  }
  if (said) {
    columns.ask(fmt::format("{} names {}, but {} says {}{}", velocity.name, velocity.said.unit,
                            best.position->name, rate->scale == 1.0 ? "" : "rpm, in ", rate->unit));
  }
  velocity.because = fmt::format("derivative of {}", best.position->name);
  velocity.said.unit = rate != nullptr ? std::string(rate->unit) : best.si_name;
  velocity.said.scale = rate != nullptr ? rate->scale : std::abs(best.factor);
  if (rate == nullptr) {
    columns.ask(fmt::format("{}: which unit? One is {:.6g} {} by {}", velocity.name,
                            velocity.said.scale, best.si_name, best.position->name));
  }
  reverse_if(best.factor < 0.0, velocity, *best.position, columns);
}

void find_effort_unit(Columns& columns, Column& column) {
  if (!column.said.unit.empty()) return;
  if (column.is(Quantity::kEffort) && !column.constant()) {
    column.said.unit = "N_m";
    column.assumed = true;
    columns.ask("efforts without a unit: taken as N m");
  } else {
    column.said.unit = column.whole_numbers ? "counts" : "1";
  }
}

}  // namespace

void find_position_units(Columns& columns) {
  for (Column& column : columns.all)
    if (column.is(Quantity::kPosition)) find_position_unit(columns, column);
}

void find_other_units(Columns& columns) {
  for (Column& column : columns.all) {
    if (column.is(Quantity::kVelocity)) find_velocity_unit(columns, column);
    if (column.drives()) find_effort_unit(columns, column);
    if (column.said.unit.empty()) column.said.unit = "1";
  }
}

}  // namespace ravencal::guess
