// SPDX-License-Identifier: Apache-2.0
//
// Which inputs a network sees. An input is a channel, or a channel as it was some rows ago, or a
// play operator of a channel (the memory of a cable with slack): x -> clamp(state, x - r, x + r),
// or an exponential mean of a channel or of its size over time (load, temperature, wear of the last
// seconds) or over the travel of a position (load and friction alike at every speed).
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"
#include "model/kinds.hpp"
#include "record/channel.hpp"

namespace ravencal::model {

/// One network input. Text form: "jpos.elbow", "jpos.elbow@3" (3 rows ago), "jpos.elbow~0.01"
/// (play of half-width 0.01, in the channel's SI unit), "tau.elbow%0.5" (exponential mean with a
/// time constant of 0.5 s), "tau.elbow%abs0.5" (the same of the absolute value),
/// "tau.elbow%0.1:jpos.elbow" (exponential mean over the travel of jpos.elbow, of length 0.1 in its
/// SI unit), "tau.elbow%abs0.1:jpos.elbow".
struct FeatureSpec {
  std::string channel;
  Transform transform = Transform::kValue;
  std::uint32_t lag_rows = 0;
  float play_half_width = 0.0F;
  float time_constant_s = 0.0F;  ///< of a mean over time
  float travel_si = 0.0F;        ///< length of a mean over travel, SI unit of the position
  std::string along = {};        ///< position of a mean over travel

  [[nodiscard]] std::string text() const;
  static core::Result<FeatureSpec> parse(std::string_view text);
  friend bool operator==(const FeatureSpec&, const FeatureSpec&) = default;
};

/// Turns a --features text into inputs. Terms are separated by commas and applied left to right:
///   paper112 | notebook208 | light      built-in sets for RAVEN-II
///   light-open                          measured joints and plays of them: closes no loop through
///                                       torque, velocity or desired positions
///   group:joint_pose | joint:elbow      a feature group, or everything of a joint
///   jpos.* | tau.elbow                  channel names, * as wildcard
///   jpos.*@3 | jpos.elbow~0.01          their lags and play operators
///   jpos.*%0.5 | tau.elbow%abs0.5       their means, and means of their absolute values
///   tau.*%0.1:jpos.elbow                their means over the travel of one position
///   -TERM                               removes what TERM selects; without @, ~ or % with all its
///                                       lags, play operators and means
/// A list that begins with a removal removes from what the empty text gives: paper112 where its
/// channels exist, else every channel that is not truth. `available` are the recording's channels;
/// truth channels are never features. Errors (kUsage) name the term and what there is instead.
core::Result<std::vector<FeatureSpec>> select_features(std::string_view text,
                                                       std::span<const record::Channel> available);

/// The input that is the plain value of the position of `feature`, a mean over travel: the first of
/// `features`, or none.
std::optional<std::size_t> position_of(std::span<const FeatureSpec> features,
                                       const FeatureSpec& feature);

/// Whether input i is the position of one of the means over travel, which cannot do without it.
bool is_needed_position(std::span<const FeatureSpec> features, std::size_t i);

/// Adds lagged copies (rows step, 2*step, ... history*step) of every plain feature.
void add_history(std::vector<FeatureSpec>& features, std::uint32_t history,
                 std::uint32_t step_rows);

/// Adds play operators with these half-widths (SI units) of every plain feature that is a position
/// (roles joint_estimate, motor_position, desired_position; pose groups of the catalogue).
void add_play(std::vector<FeatureSpec>& features, std::span<const float> half_widths,
              std::span<const record::Channel> available);

}  // namespace ravencal::model
