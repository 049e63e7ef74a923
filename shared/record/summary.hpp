// SPDX-License-Identifier: Apache-2.0
//
// What a recording holds, in numbers and in words.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "record/plausibility.hpp"
#include "record/recording.hpp"

namespace ravencal::record {

struct ChannelSummary {
  Channel channel;
  double min = 0.0;  ///< of the values that are not lost; NaN if all are
  double max = 0.0;
  std::size_t lost = 0;
};

/// Truth minus estimate of one joint, over the samples that have both.
struct JointErrorSummary {
  std::string joint;
  std::string unit;
  std::size_t samples = 0;
  double rmse = 0.0;
  double bias = 0.0;  ///< mean
  double peak = 0.0;  ///< largest magnitude
};

struct Summary {
  std::size_t rows = 0;
  double duration_s = 0.0;
  double rate_hz = 0.0;  ///< 1 / median time between rows; 0 if unknown
  std::size_t gaps = 0;  ///< steps longer than three times the median
  double longest_gap_s = 0.0;
  std::vector<ChannelSummary> channels;
  std::vector<JointErrorSummary> joints;
  std::vector<Implausibility> implausible;
};

Summary summarise(const Recording& recording);

/// A sentence on each thing that was assumed where it was imported, because no word of its source
/// says it and nobody has confirmed it since: how far its rows are apart, the unit of its time, and
/// the unit, joint or sign of channels. `name` is what the sentences call the recording.
std::vector<std::string> assumptions_of(const Recording& recording, std::string_view name);

/// In words for a person, several lines.
std::string describe_in_words(const Recording& recording, const Summary& summary);

/// The same as JSON; keys are in FORMATS.md.
std::string describe_in_json(const Recording& recording, const Summary& summary);

}  // namespace ravencal::record
