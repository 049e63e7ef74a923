// SPDX-License-Identifier: Apache-2.0
//
// The tables of arXiv 2302.04999 (Peng, Lewis, Hannaford): the authors' robot and network, means of
// five trainings.
#pragma once

#include <string_view>

namespace ravencal::study {

enum class PaperTable { kRemoval, kInaccurate, kTorque, kHoming };

/// Titles of the conditions that the paper has.
inline constexpr std::string_view kUnloaded = "unloaded";
inline constexpr std::string_view kLoaded = "500 g";
inline constexpr std::string_view kHomedOnce = "trained without re-homing";
inline constexpr std::string_view kRehomed = "trained with re-homing";

/// Rows of kHoming beside kAllFeatures, kNoEncoder and kOnlyEncoder.
inline constexpr std::string_view kInaccurateEncoder = "inaccurate_encoder";
inline constexpr std::string_view kOnlyInaccurateEncoder = "only_inaccurate_encoder";

/// RMSE or peak of "shoulder" [deg], "elbow" [deg] or "insertion" [mm]; NaN where the paper has
/// none. `row`: kRaw, kBias, kNoAblation or the id of a feature set; of kTorque kNoAblation or the
/// name of a Noise.
double paper_figure(PaperTable table, std::string_view condition, std::string_view row,
                    std::string_view joint, bool peak);

}  // namespace ravencal::study
