// SPDX-License-Identifier: Apache-2.0
//
// The figures of a report by joint, metric and stage, and what they are called.
#pragma once

#include <string>
#include <string_view>

#include "diagnose/findings/findings.hpp"

namespace ravencal::diagnose {

/// Null where the report has none.
const HeldOut* figure_of(const Report& report, const std::string& joint, std::string_view metric);

/// The one that stands for a stage of a joint; null where none does.
const HeldOut* figure_of_stage(const Report& report, const std::string& joint,
                               std::string_view stage);

/// The first of the position's, the tracking's and the effort's, which stands for the joint; null
/// where it has none of them.
const HeldOut* figure_of_joint(const Report& report, const std::string& joint);

/// "position error" for position_rmse, and so on.
std::string metric_words(std::string_view metric);

/// Of which rows the figures are: "on motion that no fit saw", or of those that were fitted, where
/// none were held out.
std::string_view rows_words(bool fitted);
bool are_of_fitted_rows(const Report& report);

}  // namespace ravencal::diagnose
