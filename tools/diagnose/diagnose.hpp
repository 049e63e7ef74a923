// SPDX-License-Identifier: Apache-2.0
//
// Where simulation and recording part, what physics the simulation lacks, and how certain that is.
// Same recordings, plant, options and seed: same report to the last bit, on any number of threads.
#pragma once

#include <cstdint>
#include <functional>
#include <string_view>
#include <vector>

#include "core/result.hpp"
#include "diagnose/findings/findings.hpp"
#include "diagnose/series/series.hpp"
#include "diagnose/track/input.hpp"
#include "physics/plant.hpp"
#include "record/recording.hpp"

namespace ravencal::diagnose {

struct Options {
  SeriesOptions series;
  double alpha = 0.02;  ///< chance of any false name in the whole report
  std::uint64_t seed = 1;
  /// Another simulator's recordings of the same motion, one per recording, held-out ones last; the
  /// baseline instead of the plant's own prediction. Empty: the plant is simulated.
  std::vector<record::Recording> simulated;
  int placebos = 0;      ///< made of this recording with nothing left out, per channel
  unsigned threads = 0;  ///< 0: all cores
  bool by_model =
      false;  ///< one model of all channels (model/, search/) instead of channel by channel
  std::function<bool(double done, std::string_view what)> look;  ///< false stops early
};

/// Diagnoses `training`; figures are on `held_out` recordings, on held-out rows, or
/// cross-validated. Recordings are let go as soon as their series are built: move what is not
/// needed afterwards. Errors: too few samples, or no joint with two signals to compare (kData);
/// stopped (kUsage).
core::Result<Report> diagnose(std::vector<record::Recording> training,
                              std::vector<record::Recording> held_out, const physics::Plant& plant,
                              Options options);

}  // namespace ravencal::diagnose
