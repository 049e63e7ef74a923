// SPDX-License-Identifier: Apache-2.0
//
// From recordings and a plant to a report, by one model of everything that was recorded.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string_view>
#include <vector>

#include "core/result.hpp"
#include "diagnose/findings/findings.hpp"
#include "physics/plant.hpp"
#include "record/recording.hpp"

namespace ravencal::diagnose {

struct ExplainOptions {
  std::optional<double> held_out_from_s{};  ///< rows from here on (of each recording) are held out
  std::uint64_t seed = 1;
  std::function<bool(double done, std::string_view what)> look{};  ///< false stops early
};

/// Figures are on `held_out` recordings, else on held-out rows, else on the rows that were fitted.
/// Errors: too few rows, a signal that an effect of the plant follows is missing (kData); stopped
/// (kUsage).
core::Result<Report> explain(const std::vector<record::Recording>& training,
                             const std::vector<record::Recording>& held_out,
                             const physics::Plant& plant, const ExplainOptions& options);

}  // namespace ravencal::diagnose
