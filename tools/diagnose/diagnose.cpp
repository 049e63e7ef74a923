// SPDX-License-Identifier: Apache-2.0
#include "diagnose/diagnose.hpp"

#include <fmt/format.h>

#include <optional>
#include <utility>

#include "diagnose/explain/models.hpp"
#include "diagnose/explain/parts.hpp"
#include "diagnose/explain/view.hpp"
#include "diagnose/findings/verdict.hpp"
#include "diagnose/search/search.hpp"
#include "diagnose/track/stretches.hpp"
#include "diagnose/track/tracks.hpp"

namespace ravencal::diagnose {
namespace {

using record::Recording;

/// Shares of the work: the search, and the placebos after it.
constexpr double kSearched = 0.4;
constexpr double kAllPlacebos = 0.55;
/// A search tries about so many models; how many, nobody knows beforehand.
constexpr double kUsualModels = 30.0;

/// Tells whoever looks how much is done, and whether to go on.
class Progress {
 public:
  explicit Progress(const Options& options) : look_(options.look) {}

  bool go_on(double done, std::string_view what) {
    if (look_ && !look_(done, what)) stopped_ = true;
    return !stopped_;
  }
  [[nodiscard]] core::Status status() const {
    if (!stopped_) return {};
    return core::usage_error("stopped before the diagnosis was complete; nothing was written");
  }

 private:
  const std::function<bool(double done, std::string_view what)>& look_;
  bool stopped_ = false;
};

/// File names only: the same recordings give the same report wherever they lie.
std::vector<SeenRecording> seen(const std::vector<Recording>& training,
                                const std::vector<Recording>& held_out) {
  std::vector<SeenRecording> out;
  for (const Recording* r : in_order(training, held_out))
    out.push_back({file_name(*r), out.size() >= training.size(), recorded_s(*r)});
  return out;
}

/// What recordings have beside the plant that is written of a model: found anew beside that plant,
/// with a cable's way that no plant says as the recordings have it.
State recorder_of(Model model, const Models& models, const Likelihood& rows) {
  for (std::size_t n = 0; n < model.numbers.size(); ++n) {
    Parameter& p = model.numbers[n];
    if (p.in_plant) p.held = true;
    if (p.reaches != Reaches::kRouting) continue;
    p.x = models.best.numbers[n].x;
    p.held = models.best.numbers[n].held;
  }
  for (auto& [candidate, parameters] : model.effects)
    for (Parameter& p : parameters) p.held = p.held || p.in_plant;
  fit(models.training, model);
  return model.state_elsewhere(rows);
}

}  // namespace

core::Result<Report> diagnose(const std::vector<Recording>& training,
                              const std::vector<Recording>& held_out, const physics::Plant& plant,
                              const Options& options) {
  RAVENCAL_ASSIGN_OR_RETURN(Tracks tracks,
                            make_tracks(training, held_out, plant, options.held_out_from_s));
  if (!options.simulated.empty()) {
    RAVENCAL_RETURN_IF_ERROR(compare_with_simulation(options.simulated, training, held_out, plant,
                                                     options.held_out_from_s, tracks));
  }
  if (!options.all_rows) keep_moving_stretches(tracks.training, tracks.notes);
  Likelihood fitted(plant, std::move(tracks.training));
  if (fitted.rows() == 0) {
    return core::data_error(fmt::format(
        "{}: no row to compare: values are lost, drives were off or at rest, or episodes too brief",
        training.front().source));
  }
  fitted.use_threads(options.threads);
  std::optional<Likelihood> shown;
  if (!tracks.held_out.empty()) shown.emplace(plant, std::move(tracks.held_out), &fitted);
  Likelihood* elsewhere = shown ? &*shown : nullptr;
  Report report;
  report.recordings = seen(training, held_out);
  report.notes = std::move(tracks.notes);
  add_channel_notes(fitted, elsewhere, in_order(training, held_out), plant, report.notes);
  Vocabulary vocabulary = vocabulary_of(plant, fitted, elsewhere);
  Progress progress(options);
  Search search(fitted, elsewhere, vocabulary, options.alpha, options.seed);
  double tried = 0.0;
  search.run([&] {
    tried += 1.0;
    return progress.go_on(kSearched * tried / (tried + kUsualModels), "models");
  });
  RAVENCAL_RETURN_IF_ERROR(progress.status());
  if (elsewhere != nullptr) elsewhere->take_noise(fitted);

  const Models models = models_of(plant, fitted, vocabulary, search);
  report.improved = models.improved;
  const Likelihood& rows = shown ? *shown : fitted;
  const State recorder = recorder_of(models.written, models, rows);
  const View view = view_of(plant, report.improved, rows, elsewhere != nullptr, &recorder);
  const std::size_t first_recording = held_out.empty() ? 0 : training.size();
  add_looked_at(fitted, elsewhere, plant, report);
  add_effects(models, view, report);
  add_routings(models, report);
  add_held_out(view, first_recording, report);
  const Growth growth = growth_of(models);
  add_free_run(view, growth.refitted, report);
  add_two_estimates(models, report);
  const physics::Plant moved = plant_of(models.moved, fitted);
  const State of_moved = recorder_of(models.moved, models, rows);
  add_error_left(view_of(plant, moved, rows, elsewhere != nullptr, &of_moved), report);
  add_not_found(models, report);
  add_candidates(models, options.seed, report);
  add_mismatch(view_of(plant, report.improved, fitted, false), report);
  add_plots(view, growth, first_recording, report);
  if (options.placebos > 0) {
    report.verdict.placebos = options.placebos;
    report.verdict.false_alarm_rate =
        false_alarm_rate(models, options.placebos, options.seed, [&](double share) {
          return progress.go_on(kSearched + kAllPlacebos * share, "placebo recordings");
        });
    RAVENCAL_RETURN_IF_ERROR(progress.status());
  }
  decide(report);
  return report;
}

}  // namespace ravencal::diagnose
