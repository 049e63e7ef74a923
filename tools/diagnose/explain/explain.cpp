// SPDX-License-Identifier: Apache-2.0
#include "diagnose/explain/explain.hpp"

#include <fmt/format.h>

#include <optional>
#include <utility>

#include "diagnose/explain/error_left.hpp"
#include "diagnose/explain/free_run.hpp"
#include "diagnose/explain/held_out.hpp"
#include "diagnose/explain/location.hpp"
#include "diagnose/explain/looked_at.hpp"
#include "diagnose/explain/models.hpp"
#include "diagnose/explain/notes.hpp"
#include "diagnose/explain/placebo.hpp"
#include "diagnose/explain/plots.hpp"
#include "diagnose/explain/view.hpp"
#include "diagnose/search/search.hpp"
#include "diagnose/track/simulated.hpp"

namespace ravencal::diagnose {
namespace {

using record::Recording;

/// Shares of the work: the search, and the placebos after it.
constexpr double kSearched = 0.4;
constexpr double kAllPlacebos = 0.55;

/// Tells whoever looks how much is done, and whether to go on.
class Progress {
 public:
  explicit Progress(const ExplainOptions& options) : look_(options.look) {}

  bool go_on(double done, std::string_view what) {
    if (look_ && !look_(done, what)) stopped_ = true;
    return !stopped_;
  }
  [[nodiscard]] core::Status status() const {
    if (!stopped_) return {};
    return core::Error{core::ErrorCode::kUsage,
                       "stopped before the diagnosis was complete; nothing was written"};
  }

 private:
  const std::function<bool(double done, std::string_view what)>& look_;
  bool stopped_ = false;
};

/// Sizes by circumstance and the page's charts need the plant with one effect less, and with one
/// more at a time. What no plant can hold is there from the start: it must not bend the numbers.
void draw(const Models& models, const View& view, std::size_t first_recording, Report& report) {
  const auto in_plants = [&](std::size_t c) {
    return !models.vocabulary.candidates[c].beyond_plants();
  };
  Model growing = models.written;
  for (const std::size_t c : models.written.chosen)
    if (in_plants(c)) growing = without(growing, models.vocabulary, c);
  fit(models.training, growing);
  judge(models.training, 0.0, growing);
  std::vector<Growth> growth = {{"its numbers refitted", plant_of(growing, models.training)}};
  std::vector<Without> without_each;
  for (const std::size_t c : models.written.chosen) {
    if (!in_plants(c)) continue;
    const Candidate& candidate = models.vocabulary.candidates[c];
    Model less = without(models.written, models.vocabulary, c);
    if (candidate.opens)
      less.numbers[*candidate.opens] = models.vocabulary.numbers[*candidate.opens];
    less.judgement = models.written.judgement;
    without_each.push_back({candidate.id, models.given.joints[candidate.joint].name, candidate.from,
                            plant_of(less, models.training)});
    growing.chosen.insert(c);
    if (candidate.opens)
      growing.numbers[*candidate.opens] = models.written.numbers[*candidate.opens];
    else
      growing.effects[c] = models.written.effects.at(c);
    growth.push_back({candidate.id, plant_of(growing, models.training)});
  }
  growth.back().plant = models.improved;
  add_plots(view, growth, without_each, first_recording, report);
}

}  // namespace

core::Result<Explained> explain(const std::vector<Recording>& training,
                                const std::vector<Recording>& held_out, const physics::Plant& plant,
                                const ExplainOptions& options) {
  RAVENCAL_ASSIGN_OR_RETURN(Tracks tracks,
                            make_tracks(training, held_out, plant, options.held_out_from_s));
  if (!options.simulated.empty()) {
    RAVENCAL_RETURN_IF_ERROR(compare_with_simulation(options.simulated, training, held_out, plant,
                                                     options.held_out_from_s, tracks));
  }
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
  for (std::string& note : channel_notes(fitted, elsewhere, training, held_out, plant))
    tracks.notes.push_back(std::move(note));
  Vocabulary vocabulary = vocabulary_of(plant, fitted, elsewhere);
  Progress progress(options);
  Search search(fitted, elsewhere, vocabulary, options.alpha, options.seed);
  search.run([&] { return progress.go_on(0.5 * kSearched, "models"); });
  RAVENCAL_RETURN_IF_ERROR(progress.status());
  if (elsewhere != nullptr) elsewhere->take_noise(fitted);

  Report report;
  const Models models = models_of(plant, fitted, vocabulary, search);
  report.improved = models.improved;
  const Likelihood& rows = shown ? *shown : fitted;
  const State recorder = models.best.state_elsewhere(rows);
  const View view = view_of(plant, report.improved, rows, elsewhere != nullptr, &recorder);
  const std::size_t first_recording = held_out.empty() ? 0 : training.size();
  add_looked_at(fitted, elsewhere, plant, report);
  add_effects(models, view, report);
  report.routings = routings_of(models.best, fitted);
  for (std::string& note : routing_notes(report.routings)) tracks.notes.push_back(std::move(note));
  add_held_out(view, first_recording, report);
  add_free_run(view, report);
  add_error_left(view, report);
  add_not_found(models, report);
  add_candidates(models, options.seed, report);
  add_mismatch(view_of(plant, report.improved, fitted, false), report);
  draw(models, view, first_recording, report);
  if (options.placebos > 0) {
    report.verdict.placebos = options.placebos;
    report.verdict.false_alarm_rate =
        false_alarm_rate(models, options.placebos, options.seed, [&](double share) {
          return progress.go_on(kSearched + kAllPlacebos * share, "placebo recordings");
        });
    RAVENCAL_RETURN_IF_ERROR(progress.status());
  }
  return Explained{std::move(report), std::move(tracks.notes)};
}

}  // namespace ravencal::diagnose
