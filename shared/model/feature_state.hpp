// SPDX-License-Identifier: Apache-2.0
//
// Turns the channels of one tick into network inputs, remembering what lags, play operators and
// means need. Training runs it over recordings (one tick per row), the plugin in the robot's loop
// (one tick per control cycle; there a lag of k rows is k * row_period / tick ticks). Real-time
// safe: all memory comes from the caller, the time of a tick does not depend on the values. One
// thread.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#include "model/kinds.hpp"

namespace ravencal::model {

/// One network input, made from one element of the sources.
struct FeatureOp {
  std::uint32_t source = 0;  ///< index into the sources of a tick
  Transform transform = Transform::kValue;
  std::uint32_t lag_ticks = 0;  ///< kLag only
  float half_width = 0.0F;      ///< kPlay only, in the source's unit, >= 0
  float gain = 1.0F;            ///< means over time only, of one tick, in (0, 1] (mean_gain.hpp)
  float travel = 1.0F;      ///< means over travel only, their length in the position's unit, > 0
  std::uint32_t along = 0;  ///< means over travel only: index of the position in the sources
};

class FeatureState {
 public:
  /// Floats of memory that `ops` over `source_count` sources need.
  static constexpr std::size_t memory_floats(std::span<const FeatureOp> ops,
                                             std::size_t source_count) noexcept {
    return memory_floats(ops.size(), states_per_op(ops), history_rows(ops), source_count);
  }

  /// The same from counts; `states_per_op`: the largest states_of the ops' transforms;
  /// `history_rows`: one more than the longest lag in ticks, 0 without lags.
  static constexpr std::size_t memory_floats(std::size_t ops, std::size_t states_per_op,
                                             std::size_t history_rows,
                                             std::size_t source_count) noexcept {
    return states_per_op * ops + history_rows * source_count;
  }

  /// Floats that an op of this transform makes every op need.
  static constexpr std::size_t states_of(Transform transform) noexcept {
    return is_travel_mean(transform) ? 3 : is_mean(transform) ? 2 : 1;
  }

  FeatureState() = default;

  /// `ops` and `memory` (at least memory_floats) are borrowed and must outlive this object. Every
  /// op's source and position must be below `source_count`.
  FeatureState(std::span<const FeatureOp> ops, std::size_t source_count,
               std::span<float> memory) noexcept
      : ops_(ops),
        source_count_(source_count),
        history_rows_(history_rows(ops)),
        passed_on_(passed_on(ops)),
        states_(memory.first(ops.size())),
        rests_(memory.subspan(ops.size(), states_per_op(ops) > 1 ? ops.size() : 0)),
        followers_(memory.subspan(2 * rests_.size(), states_per_op(ops) > 2 ? ops.size() : 0)),
        history_(memory.subspan(states_per_op(ops) * ops.size(), history_rows_ * source_count)) {
    reset();
  }

  /// Forgets the past: the next tick is the first.
  void reset() noexcept {
    known_rows_ = 0;
    head_ = 0;
    for (float& state : states_) state = kUnset;
    for (float& follower : followers_) follower = kUnset;
  }

  /// Takes the channels of one tick, shape [source_count], and writes the inputs, shape [ops].
  /// A lag that reaches further back than the first tick gives the oldest value known; a play
  /// operator or mean starts at its first value. A NaN passes through and does not disturb them.
  void advance(std::span<const float> sources, std::span<float> features) noexcept {
    remember(sources);
    for (std::size_t i = 0; i < passed_on_; ++i) features[i] = sources[i];
    for (std::size_t i = passed_on_; i < ops_.size(); ++i) {
      const FeatureOp& op = ops_[i];
      const float now = sources[op.source];
      switch (op.transform) {
        case Transform::kValue:
          features[i] = now;
          break;
        case Transform::kLag:
          features[i] = history_[row_before(op.lag_ticks) * source_count_ + op.source];
          break;
        case Transform::kPlay:
          features[i] = play(states_[i], now, op.half_width);
          break;
        case Transform::kMean:
          features[i] = mean(states_[i], rests_[i], now, op.gain);
          break;
        case Transform::kMeanOfAbs:
          features[i] = mean(states_[i], rests_[i], std::fabs(now), op.gain);
          break;
        case Transform::kTravelMean:
          features[i] = mean(states_[i], rests_[i], now,
                             travel_gain(followers_[i], sources[op.along], op.travel));
          break;
        case Transform::kTravelMeanOfAbs:
          features[i] = mean(states_[i], rests_[i], std::fabs(now),
                             travel_gain(followers_[i], sources[op.along], op.travel));
          break;
      }
    }
  }

 private:
  static constexpr float kUnset = std::numeric_limits<float>::quiet_NaN();

  /// Rows of the ring: the longest lag and the present; none without lags.
  static constexpr std::size_t history_rows(std::span<const FeatureOp> ops) noexcept {
    std::size_t rows = 0;
    for (const FeatureOp& op : ops) {
      if (op.transform == Transform::kLag && op.lag_ticks + std::size_t{1} > rows) {
        rows = op.lag_ticks + std::size_t{1};
      }
    }
    return rows;
  }

  /// Leading ops that pass on the source of their own index, as those of plain channels do.
  static constexpr std::size_t passed_on(std::span<const FeatureOp> ops) noexcept {
    std::size_t i = 0;
    while (i < ops.size() && ops[i].transform == Transform::kValue && ops[i].source == i) ++i;
    return i;
  }

  static constexpr std::size_t states_per_op(std::span<const FeatureOp> ops) noexcept {
    std::size_t states = 1;
    for (const FeatureOp& op : ops) states = std::max(states, states_of(op.transform));
    return states;
  }

  void remember(std::span<const float> sources) noexcept {
    if (history_rows_ == 0) return;
    if (known_rows_ > 0) head_ = head_ + 1 == history_rows_ ? 0 : head_ + 1;
    if (known_rows_ < history_rows_) ++known_rows_;
    float* const row = history_.data() + head_ * source_count_;
    for (std::size_t i = 0; i < source_count_; ++i) row[i] = sources[i];
  }

  /// Ring row of `lag` ticks ago, or of the first tick if that is nearer.
  [[nodiscard]] std::size_t row_before(std::size_t lag) const noexcept {
    const std::size_t age = lag < known_rows_ ? lag : known_rows_ - 1;
    return head_ >= age ? head_ - age : head_ + history_rows_ - age;
  }

  static float play(float& state, float now, float half_width) noexcept {
    if (state != state) state = now;  // the first value
    if (state < now - half_width) state = now - half_width;
    if (state > now + half_width) state = now + half_width;
    return now == now ? state : now;
  }

  /// The mean is state + rest: a step far below the state's last digit is not lost but added up in
  /// the rest (Knuth's exact sum of two numbers), so that slow means do not stall. An infinity
  /// passes through like a NaN.
  static float mean(float& state, float& rest, float now, float gain) noexcept {
    const bool is_number = now - now == 0.0F;
    const bool is_first = state != state;
    const float from = is_first ? now : state;
    const float left = is_first ? 0.0F : rest;
    const float step = gain * ((now - from) - left) + left;
    const float sum = from + step;
    const float taken = sum - from;
    const float lost = (from - (sum - taken)) + (step - taken);
    state = is_number ? sum : state;
    rest = is_number ? lost : rest;
    return is_number ? sum : now;
  }

  /// Share of the way from the mean to the value that the travel of this tick goes: the implicit
  /// Euler step d / (d + travel) of an exponential mean over travel. It needs no exp, never
  /// overshoots, and to first order in d / travel is the same in one tick as in ten of a tenth of
  /// d. d is what the tick moves a play of the position, 0 at its first value and at one that is no
  /// number; a jump beyond the range of a float is a full step.
  static float travel_gain(float& follower, float position, float travel) noexcept {
    const float half_width = kTravelDeadband * travel;
    const bool is_number = position - position == 0.0F;
    const float before = follower != follower ? position : follower;
    const float low = position - half_width;
    const float high = position + half_width;
    const float raised = before < low ? low : before;
    const float after = raised > high ? high : raised;
    const float jump = std::min(std::fabs(after - before), std::numeric_limits<float>::max());
    const float moved = is_number ? jump : 0.0F;
    follower = is_number ? after : follower;
    return moved / (moved + travel);
  }

  std::span<const FeatureOp> ops_;
  std::size_t source_count_ = 0;
  std::size_t history_rows_ = 0;
  std::size_t passed_on_ = 0;
  std::span<float> states_;     ///< of plays and means; one per op; kUnset before its first value
  std::span<float> rests_;      ///< what the states of means lack; one per op if any is a mean
  std::span<float> followers_;  ///< plays of positions; one per op if any is a mean over travel
  std::span<float> history_;  ///< ring of whole source rows: the lags of one tick share cache lines
  std::size_t known_rows_ = 0;
  std::size_t head_ = 0;
};

}  // namespace ravencal::model
