// SPDX-License-Identifier: Apache-2.0
//
// The vocabularies that training, files and the real-time plugin share. Their numbers are
// stored in blobs and never change. Free of the standard library's owning types, so that the
// plugin may include it.
#pragma once

#include <cstddef>
#include <cstdint>

namespace ravencal::model {

/// How an input is made from a channel.
enum class Transform : std::uint8_t {
  kValue = 0,            ///< the channel now
  kLag = 1,              ///< the channel some rows ago
  kPlay = 2,             ///< play operator of the channel: the memory of a cable with slack
  kMean = 3,             ///< exponential mean of the channel over time: a first-order low-pass
  kMeanOfAbs = 4,        ///< exponential mean of the channel's size over time
  kTravelMean = 5,       ///< exponential mean of the channel over the travel of a position
  kTravelMeanOfAbs = 6,  ///< exponential mean of the channel's size over the travel of a position
};

/// Over time.

constexpr bool is_mean(Transform transform) noexcept {
  return transform == Transform::kMean || transform == Transform::kMeanOfAbs;
}

/// Time constants of exponential means, s.
inline constexpr float kMinTimeConstantS = 1e-3F;
inline constexpr float kMaxTimeConstantS = 1000.0F;

/// False for NaN.
constexpr bool is_time_constant(float time_constant_s) noexcept {
  return time_constant_s >= kMinTimeConstantS && time_constant_s <= kMaxTimeConstantS;
}

constexpr bool is_travel_mean(Transform transform) noexcept {
  return transform == Transform::kTravelMean || transform == Transform::kTravelMeanOfAbs;
}

/// Lengths of means over travel, SI unit of the position.
inline constexpr float kMinTravelSi = 1e-6F;
inline constexpr float kMaxTravelSi = 1000.0F;

/// False for NaN.
constexpr bool is_travel(float travel_si) noexcept {
  return travel_si >= kMinTravelSi && travel_si <= kMaxTravelSi;
}

/// Half-width of the play that a position must leave before it counts as travel, in lengths of the
/// mean: the noise of an encoder at standstill is no travel.
inline constexpr float kTravelDeadband = 1.0F / 64.0F;

/// What a layer applies to each of its sums.
enum class Activation : std::uint8_t { kLinear = 0, kSigmoid = 1, kTanh = 2, kRelu = 3 };

/// The arm of a RAVEN-II from which a model was trained.
enum class Arm : std::uint8_t { kUnknown = 0, kGold = 1, kGreen = 2 };

/// Coordinates of a model's inputs.
enum class Coordinates : std::uint8_t {
  kUnknown = 0,
  kMotor = 1,      ///< as the controller has them without the plugin: no correction in any of them
  kCorrected = 2,  ///< recorded while the plugin corrected: measured and desired joints and poses
                   ///< contain the correction
};

/// Inputs that answer to the motor command within a cycle or two close a loop through the
/// correction (model/loop_group.hpp says which raven_state fields do). In this order in a blob.
enum class LoopGroup : std::uint8_t {
  kTorque = 0,    ///< torques, DAC values, forces
  kVelocity = 1,  ///< velocities of motors, joints and tool
  kDesired = 2,   ///< desired positions of motors, joints and tool
};
inline constexpr std::size_t kLoopGroupCount = 3;

}  // namespace ravencal::model
