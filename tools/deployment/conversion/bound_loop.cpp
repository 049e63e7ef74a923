// SPDX-License-Identifier: Apache-2.0
#include "conversion/bound_loop.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "exchange/load.hpp"
#include "loop/margins.hpp"
#include "model/hook_view.hpp"
#include "model/jacobian.hpp"

namespace ravencal::conversion {
namespace {

/// Up to six inputs that answer, for a message.
std::string names_of_answering(const model::CalibrationModel& model) {
  constexpr std::size_t kShown = 6;
  std::vector<std::string> names;
  for (const std::size_t i : model::answering_features(model)) {
    names.push_back(model.features[i].text());
  }
  const std::size_t shown = std::min(names.size(), kShown);
  std::string text = fmt::format(
      "{}", fmt::join(names.begin(), names.begin() + static_cast<std::ptrdiff_t>(shown), ", "));
  if (names.size() > shown) text += fmt::format(" and {} more", names.size() - shown);
  return text;
}

/// At the rows of these recordings.
core::Result<model::LoopGains> gains_at(const std::vector<record::Recording>& recordings,
                                        const model::CalibrationModel& model) {
  model::FeatureMatrix rows(0, static_cast<Eigen::Index>(model.features.size()));
  for (const record::Recording& recording : recordings) {
    RAVENCAL_ASSIGN_OR_RETURN(const model::FeatureMatrix more, model::inputs_of(model, recording));
    append_whole_rows(more, rows);
  }
  return model::loop_gains(model, rows);
}

core::Status set_gains(const Request& request, const Outcome& outcome,
                       model::CalibrationModel& model) {
  if (!outcome.calibrate.empty()) {
    RAVENCAL_ASSIGN_OR_RETURN(model.loop_gains, gains_at(outcome.calibrate, model));
    return {};
  }
  if (model.loop_gains) return {};
  if (model::answering_features(model).empty()) {
    model.loop_gains = model::loop_gains(model, {});
    return {};
  }
  if (request.unbounded_loop) return {};
  return core::usage_error(fmt::format(
      "{}: the inputs {} depend on the motor command and close a loop through the correction. Its "
      "gains are unknown: give recordings of the training with --calibrate, train "
      "anew, or write the weights all the same with --unbounded-loop",
      request.model, names_of_answering(model)));
}

}  // namespace

void append_whole_rows(const model::FeatureMatrix& more, model::FeatureMatrix& rows) {
  Eigen::Index kept = rows.rows();
  rows.conservativeResize(kept + more.rows(), Eigen::NoChange);
  for (Eigen::Index row = 0; row < more.rows(); ++row) {
    if (more.row(row).allFinite()) rows.row(kept++) = more.row(row);
  }
  rows.conservativeResize(kept, Eigen::NoChange);
}

core::Status bound_loop(const Request& request, Outcome& outcome) {
  model::CalibrationModel& model = outcome.compacted.model;
  RAVENCAL_RETURN_IF_ERROR(set_gains(request, outcome, model));
  if (request.unbounded_loop) {
    model.provenance["loop"] = "accepted without a bound (convert --unbounded-loop)";
  }
  if (request.plant.empty()) return {};
  std::vector<record::Recording> shown;
  if (outcome.calibrate.empty()) {
    if (request.check.empty()) {
      return core::usage_error(
          "--plant: margins are computed at rows of recordings; give some with "
          "--calibrate or --check");
    }
    RAVENCAL_ASSIGN_OR_RETURN(shown, exchange::load_recordings({request.check}, request.load));
  }
  const auto& recordings = outcome.calibrate.empty() ? shown : outcome.calibrate;
  RAVENCAL_ASSIGN_OR_RETURN(const physics::Plant plant, physics::load_plant(request.plant));
  RAVENCAL_ASSIGN_OR_RETURN(outcome.margins,
                            loop::margins_with(plant, model, pointers_to(recordings)));
  if (!model.loop_gains) {
    RAVENCAL_ASSIGN_OR_RETURN(model.loop_gains, gains_at(recordings, model));
  }
  model.loop_gains->margins = {outcome.margins->gain.value, outcome.margins->phase_rad.value};
  outcome.is_unstable = !outcome.margins->enough() && !request.unbounded_loop;
  outcome.accepted = outcome.accepted && !outcome.is_unstable;
  return {};
}

}  // namespace ravencal::conversion
