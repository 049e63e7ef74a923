// SPDX-License-Identifier: Apache-2.0
#include "diagnose/diagnose.hpp"

#include <utility>

#include "diagnose/findings/verdict.hpp"
#include "diagnose/track/input.hpp"

namespace ravencal::diagnose {
namespace {

/// File names only: the same recordings give the same report wherever they lie.
std::vector<SeenRecording> seen(const std::vector<record::Recording>& training,
                                const std::vector<record::Recording>& held_out) {
  std::vector<SeenRecording> out;
  for (const auto* list : {&training, &held_out}) {
    for (const record::Recording& r : *list)
      out.push_back({file_name(r), list == &held_out, recorded_s(r)});
  }
  return out;
}

}  // namespace

core::Result<Report> diagnose(const std::vector<record::Recording>& training,
                              const std::vector<record::Recording>& held_out,
                              const physics::Plant& plant, const Options& options) {
  RAVENCAL_ASSIGN_OR_RETURN(Explained explained, explain(training, held_out, plant, options));
  explained.report.recordings = seen(training, held_out);
  decide(explained.report, explained.notes);
  return std::move(explained.report);
}

}  // namespace ravencal::diagnose
