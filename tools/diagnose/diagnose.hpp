// SPDX-License-Identifier: Apache-2.0
//
// Where simulation and recording part, what physics the simulation lacks, and how certain that is.
// Same recordings, plant, options and seed: same report to the last bit, on any number of threads.
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

struct Options {
  std::optional<double> held_out_from_s{};  ///< rows from here on (of each recording) are held out
  bool all_rows = false;                    ///< of long recordings as well
  double alpha = 0.02;                      ///< chance of any false name in the whole report
  std::uint64_t seed = 1;
  /// Another simulator's recordings, one per recording, held-out ones last: the baseline instead of
  /// what the plant predicts. Empty: the plant is.
  std::vector<record::Recording> simulated{};
  int placebos = 0;      ///< made of these recordings with nothing left out
  unsigned threads = 0;  ///< 0: one per core; the report is the same on any number
  std::function<bool(double done, std::string_view what)> look{};  ///< false stops early
};

/// Diagnoses `training`; figures are on `held_out` recordings and held-out rows, else on the rows
/// that were fitted. Errors: what make_tracks and compare_with_simulation refuse, no row to compare
/// (kData); stopped (kUsage).
core::Result<Report> diagnose(const std::vector<record::Recording>& training,
                              const std::vector<record::Recording>& held_out,
                              const physics::Plant& plant, const Options& options);

}  // namespace ravencal::diagnose
