// SPDX-License-Identifier: Apache-2.0
//
// What a user gives to a diagnosis: whether it can be taken, and what the report says of it.
#pragma once

#include <string>
#include <vector>

#include "core/result.hpp"
#include "diagnose/diagnose.hpp"
#include "record/time_range.hpp"

namespace ravencal::diagnose {

/// Chance of any false name that may be asked for, and how many placebos.
inline constexpr double kLeastAlpha = 1e-4, kMostAlpha = 0.5;
inline constexpr int kMostPlacebos = 10000;
/// Placebos of a diagnosis that nobody sets otherwise: none named in 20 says less than 14 %.
inline constexpr int kUsualPlacebos = 20;

/// A recording as it was asked for.
struct GivenRecording {
  std::string path;
  std::string profile;
  record::TimeRange range{};
};

struct Given {
  std::vector<GivenRecording> training, held_out, simulated;
};

/// kUsage where rows count twice, or are held out and fitted. Another profile may take other rows
/// of the same file.
core::Status check_given(const Given& given);

/// Writes into the report what it was made from, files by name only: the same recordings give the
/// same report wherever they lie.
void add_provenance(const Given& given, const physics::Plant& plant, const Options& options,
                    Report& report);

}  // namespace ravencal::diagnose
