// SPDX-License-Identifier: Apache-2.0
//
// Where the numbers of a plant may lie. The bounds stand far beyond any arm that fits in a room, so
// that they refuse slips of the pen and of units, and keep every simulation finite in time and
// memory.
#pragma once

#include "core/toml_table.hpp"
#include "physics/effects/effect_spec.hpp"

namespace ravencal::physics {

inline constexpr core::NumberRange kPositionRange{-1e3, 1e3};  ///< rad or m
inline constexpr core::NumberRange kWidthRange{0.0, 1e3};      ///< rad or m
inline constexpr core::NumberRange kVelocityRange{-1e4, 1e4};  ///< rad/s or m/s
inline constexpr core::NumberRange kSpeedRange{1e-9, 1e4};     ///< rad/s or m/s; times divide by it
inline constexpr core::NumberRange kStiffnessRange{0.0, 1e12};  ///< N m/rad or N/m; servos, too
inline constexpr core::NumberRange kDampingRange{0.0, 1e9};     ///< N m s/rad or N s/m
inline constexpr core::NumberRange kCountsRange{0.0, 1e9};
inline constexpr core::NumberRange kMassRange{0.0, 1e4};     ///< kg
inline constexpr core::NumberRange kInertiaRange{0.0, 1e4};  ///< kg m^2
inline constexpr core::NumberRange kRotorRange{kNoInertia_kg_m2,
                                               1e4};  ///< kg m^2; forces are divided by it
inline constexpr core::NumberRange kLengthRange{-100.0, 100.0};   ///< m
inline constexpr core::NumberRange kGravityRange{-100.0, 100.0};  ///< m/s^2
inline constexpr core::NumberRange kTransmissionRange{1e-6, 1e9};
inline constexpr core::NumberRange kGainRange{-1e9, 1e9};
inline constexpr core::NumberRange kSignRange{-1.0, 1.0};
inline constexpr core::NumberRange kDirectionRange{-1e3, 1e3};    ///< before it is made a unit
inline constexpr core::NumberRange kResolutionRange{1e-12, 1.0};  ///< rad or m
inline constexpr core::NumberRange kCountsPerRevRange{1.0, 1e9};
inline constexpr core::NumberRange kControlRateRange{1.0, 1e5};  ///< Hz
inline constexpr core::NumberRange kInnerRateRange{1.0, 1e6};    ///< Hz
inline constexpr core::NumberRange kRowRateRange{1e-3, 1e6};     ///< Hz
inline constexpr core::NumberRange kPeriodRange{1e-4, 1e3};      ///< s
inline constexpr core::NumberRange kLatencyRange{0.0, 10.0};     ///< s
inline constexpr core::NumberRange kToleranceRange{0.0, 1e3};    ///< relative
inline constexpr core::NumberRange kCouplingRange{-1e3, 1e3};

/// Of a parameter of an effect, by its dimension and whether it may be negative.
core::NumberRange range_of(const ParameterSpec& parameter);

}  // namespace ravencal::physics
