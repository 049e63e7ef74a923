// SPDX-License-Identifier: Apache-2.0
//
// Profiles that need no file. Private to record/.
#pragma once

#include <string>
#include <string_view>

#include "core/result.hpp"
#include "record/profile.hpp"

namespace ravencal::record {

/// The paper's 252-column CSV without header (RAVEN-II, two arms, external encoders on one).
/// `arm` says which half of each per-arm field is the calibrated arm: "gold" the first.
core::Result<Profile> raven2_profile(const std::string& arm);

/// Bags of raven_2/raven_state and ext_jpos: the same channels, the truths first.
core::Result<Profile> raven2_bag_profile(const std::string& arm);
/// The same bags, one row per message of the encoders.
inline constexpr std::string_view kBagTruthProfile = "raven2-bag-truth";
inline constexpr std::string_view kStateTopic = "ravenstate";
inline constexpr std::string_view kTruthTopic = "ext_jpos";

/// Columns of the 252 that repeat others for CRTK users: a stamp and measured_js. Import skips
/// them, export fills them.
inline constexpr std::size_t kRaven2StampColumn = 4;
inline constexpr std::size_t kRaven2MeasuredJsColumn = 5;
inline constexpr std::size_t kRaven2CatalogueColumn = 12;
inline constexpr std::size_t kRaven2ColumnCount = 252;

/// Column of a catalogue entry in the 252, given which arm is calibrated.
std::size_t raven2_column(std::size_t catalogue_index, bool gold);

/// A header of `name_unit` words: one channel per word, roles by prefix (FORMATS.md).
Profile generic_profile();

}  // namespace ravencal::record
