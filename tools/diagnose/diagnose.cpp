// SPDX-License-Identifier: Apache-2.0
#include "diagnose/diagnose.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <functional>
#include <mutex>
#include <optional>

#include "core/side_by_side.hpp"
#include "diagnose/channel/across_channels.hpp"
#include "diagnose/channel/arm_payload.hpp"
#include "diagnose/channel/channel.hpp"
#include "diagnose/channel/improved_plant.hpp"
#include "diagnose/channel/looked.hpp"
#include "diagnose/channel/placebo.hpp"
#include "diagnose/channel/routing.hpp"
#include "diagnose/effects/effects.hpp"
#include "diagnose/explain/explain.hpp"
#include "diagnose/findings/verdict.hpp"
#include "diagnose/fit/derived_seed.hpp"
#include "diagnose/free_run/judge.hpp"
#include "diagnose/series/input.hpp"
#include "diagnose/simulated.hpp"

namespace ravencal::diagnose {
namespace {

/// What a placebo of a channel costs of the channel's own analysis.
constexpr double kPlaceboCost = 0.2;

/// Tells whoever looks how much is done, from any thread, and whether to go on.
class Watch {
 public:
  Watch(const Options& options, std::size_t channels)
      : look_(options.look),
        whole_(static_cast<double>(channels) * (1.0 + kPlaceboCost * options.placebos)) {}

  [[nodiscard]] bool stopped() const { return stopped_; }

  /// That much more is done, in analyses of one channel. The rest is judged and written after.
  void done(double analyses, std::string_view what) {
    const std::lock_guard<std::mutex> lock(mutex_);
    done_ += analyses;
    if (look_ && !look_(0.9 * std::min(1.0, done_ / whole_), what)) stopped_ = true;
  }

 private:
  const std::function<bool(double done, std::string_view what)>& look_;
  const double whole_;
  double done_ = 0.0;
  std::atomic<bool> stopped_{false};
  std::mutex mutex_;
};

/// Share of placebos in which anything is named, over all channels of the report that have any.
std::optional<double> false_alarm_rate(const SeriesSet& set,
                                       const std::vector<ChannelFindings>& findings,
                                       const physics::Plant& plant, const ChannelOptions& base,
                                       const Options& options, Watch& watch) {
  const auto placebos = static_cast<std::size_t>(options.placebos);
  std::vector<std::size_t> channels;
  for (std::size_t i = 0; i < findings.size(); ++i) {
    if (findings[i].placebo) channels.push_back(i);
  }
  if (channels.empty() || placebos == 0) return std::nullopt;
  std::vector<char> alarm(channels.size() * placebos, 0);
  core::for_each_index(alarm.size(), options.threads, [&](std::size_t i) {
    if (watch.stopped()) return;
    ChannelOptions placebo_options = base;
    placebo_options.details = false;
    placebo_options.seed = derived_seed(base.seed, "placebo", i);
    const std::size_t c = channels[i / placebos];
    const Series placebo =
        placebo_series(set.series[c], *findings[c].placebo, placebo_options.seed);
    alarm[i] = analyse_channel(placebo, plant, placebo_options).effects.empty() ? 0 : 1;
    watch.done(kPlaceboCost, "placebo recordings");
  });
  std::size_t alarms = 0;
  for (std::size_t t = 0; t < placebos; ++t) {
    bool any = false;
    for (std::size_t c = 0; c < channels.size(); ++c) any = any || alarm[c * placebos + t] != 0;
    alarms += any ? 1U : 0U;
  }
  return static_cast<double>(alarms) / static_cast<double>(placebos);
}

/// The channels' way from series to findings, in an order in which each knows what it needs.
class Analysis {
 public:
  Analysis(SeriesSet& set, const physics::Plant& plant, const ChannelOptions& channel_options,
           const Options& options, Watch& watch)
      : findings(set.series.size()),
        set_(set),
        plant_(plant),
        channel_options_(channel_options),
        options_(options),
        watch_(watch),
        drives_(set.series.size()) {}

  /// False: stopped early.
  bool run() {
    if (!analyse([](Stage stage) { return stage != Stage::kTransmission; })) return false;
    payload = payload_of_arm(drives_, findings, channel_options_);
    if (payload) {
      hang(*payload, set_);
      if (!analyse([](Stage stage) { return stage == Stage::kDrive; })) return false;
    }
    drives_.clear();
    load_transmissions(set_, findings);
    if (!find_ways()) return false;
    if (!analyse([](Stage stage) { return stage == Stage::kTransmission; })) return false;
    agree_on_friction();
    return !watch_.stopped();
  }

  std::vector<ChannelFindings> findings;  ///< of each channel of the set
  std::optional<NamedEffect> payload;     ///< that all drives weigh together
  std::vector<Routing> routings;          ///< ways of the cables that other joints move

 private:
  /// Transmissions that hold both ways of a cable are fitted, and anew once a way is decided.
  bool find_ways() {
    named_.resize(set_.series.size());
    core::for_each_index(set_.series.size(), options_.threads, [&](std::size_t i) {
      const Series& series = set_.series[i];
      const bool against_plant = series.measured_y.size() == 0;
      if (!watch_.stopped() && against_plant && admits_both(series))
        named_[i] = name_channel(series, plant_, channel_options_);
    });
    if (watch_.stopped()) return false;
    routings = routings_of(set_, named_, plant_);
    const std::vector<char> changed = route(routings, set_);
    for (std::size_t i = 0; i < named_.size(); ++i)
      if (changed[i] != 0) named_[i] = {};
    return true;
  }

  template <typename Wanted>
  bool analyse(Wanted&& wanted) {
    core::for_each_index(set_.series.size(), options_.threads, [&](std::size_t i) {
      if (watch_.stopped() || !wanted(set_.series[i].stage)) return;
      findings[i] = findings_of(i);
      watch_.done(1.0, set_.series[i].joint);
    });
    return !watch_.stopped();
  }

  /// Drives that found something are looked at anew beside the friction that their joint's loop
  /// names.
  void agree_on_friction() {
    std::vector<std::optional<physics::Plant>> agreed(findings.size());
    for (std::size_t i = 0; i < findings.size(); ++i) {
      const bool silent = findings[i].effects.empty() && findings[i].unexplained.empty();
      if (set_.series[i].stage == Stage::kDrive && !silent)
        agreed[i] = with_friction_of_loop(plant_, findings, set_.series[i].joint);
    }
    core::for_each_index(findings.size(), options_.threads, [&](std::size_t i) {
      if (agreed[i])
        findings[i] = fewer_beside_friction(set_.series[i], *agreed[i], std::move(findings[i]),
                                            channel_options_);
    });
  }

  ChannelFindings findings_of(std::size_t i) {
    const Series& series = set_.series[i];
    if (series.stage == Stage::kCommand) return analyse_command(series, plant_, channel_options_);
    NamedChannel named;
    if (i < named_.size()) named = std::move(named_[i]);
    if (!named.fit) named = name_channel(series, plant_, channel_options_);
    ChannelFindings described = describe(named, plant_, channel_options_);
    if (series.stage == Stage::kDrive) drives_[i] = std::move(named.fit);
    return described;
  }

  SeriesSet& set_;
  const physics::Plant& plant_;
  const ChannelOptions& channel_options_;
  const Options& options_;
  Watch& watch_;
  std::vector<std::unique_ptr<ChannelFit>> drives_;  ///< until the arm is weighed
  std::vector<NamedChannel> named_;                  ///< transmissions, until they are described
};

template <typename T>
void append(std::vector<T>& to, std::vector<T>& from) {
  to.insert(to.end(), std::make_move_iterator(from.begin()), std::make_move_iterator(from.end()));
}

/// How that drive runs free by these findings, over windows that no fit saw.
Eigen::VectorXd free_run_of(const SeriesSet& set, const std::vector<ChannelFindings>& findings,
                            std::size_t drive, const physics::Plant& plant,
                            const Options& options) {
  Report report;
  for (const ChannelFindings& f : findings) {
    report.effects.insert(report.effects.end(), f.effects.begin(), f.effects.end());
    report.kept.insert(report.kept.end(), f.kept.begin(), f.kept.end());
    report.refitted.insert(report.refitted.end(), f.refitted.begin(), f.refitted.end());
  }
  merge_joint_friction(plant, report);
  return unseen_windows(set, findings, drive, plant, improved_plant(plant, report), report,
                        derived_seed(options.seed, "free run", drive));
}

/// Equation error screens, free run judges: a drive that runs better without what has no name does
/// without it.
void keep_what_runs(const SeriesSet& set, const physics::Plant& plant, const Options& options,
                    std::vector<ChannelFindings>& findings) {
  std::vector<char> worse(findings.size(), 0);
  core::for_each_index(findings.size(), options.threads, [&](std::size_t i) {
    if (!findings[i].bare) return;
    std::vector<ChannelFindings> without = findings;
    without[i] = *findings[i].bare;
    worse[i] = runs_better(free_run_of(set, without, i, plant, options),
                           free_run_of(set, findings, i, plant, options))
                   ? 1
                   : 0;
  });
  for (std::size_t i = 0; i < findings.size(); ++i) {
    if (worse[i] != 0) findings[i] = ChannelFindings(*findings[i].bare);
  }
}

/// Lets the drives run free and applies what they say.
void judge_in_free_run(const SeriesSet& set, const std::vector<ChannelFindings>& findings,
                       const physics::Plant& plant, const Options& options, Report& report) {
  const physics::Plant improved = improved_plant(plant, report);
  std::vector<FreeRunVerdict> verdicts(set.series.size());
  core::for_each_index(set.series.size(), options.threads, [&](std::size_t i) {
    if (set.series[i].stage != Stage::kDrive) return;
    verdicts[i] = judge_drive(set, findings, i, plant, improved, report,
                              derived_seed(options.seed, "free run", i));
  });
  for (std::size_t i = 0; i < verdicts.size(); ++i) apply(verdicts[i], set.series[i], report);
}

/// Why no channel of this joint spoke about that entry of the vocabulary.
NotFound silent_entry(const SeriesSet& set, const physics::Plant& plant, const std::string& joint,
                      const EffectKind& kind) {
  NotFound silent{kind.id(), joint, std::nullopt, "", ""};
  const auto reason = set.not_possible.find(joint);
  const bool looked = std::any_of(set.series.begin(), set.series.end(), [&](const Series& series) {
    return series.joint == joint && series.stage == kind.stage();
  });
  silent.expected = looked && plant_has(plant, joint, silent.id, "");
  silent.not_testable_because =
      silent.expected                    ? "the plant has it: any size of it is expected"
      : kind.stage() == Stage::kCommand  ? "the recording or the plant lacks the command's inputs, "
                                           "its output or its control law"
      : reason != set.not_possible.end() ? reason->second
                                         : "no channel of this joint shows it";
  return silent;
}

void add_silent(const SeriesSet& set, const physics::Plant& plant, Report& report) {
  for (const physics::Joint& joint : plant.joints) {
    for (const EffectKind* kind : effect_kinds()) {
      const auto same = [&](const auto& item) {
        return item.id == kind->id() && item.joint == joint.name;
      };
      if (kind->traits().origin == Origin::kUnnamed ||
          std::any_of(report.effects.begin(), report.effects.end(), same) ||
          std::any_of(report.not_found.begin(), report.not_found.end(), same)) {
        continue;
      }
      report.not_found.push_back(silent_entry(set, plant, joint.name, *kind));
    }
  }
}

/// Residuals against the plant's prediction or, where there is one, another simulation's.
core::Result<SeriesSet> series_of(const std::vector<record::Recording>& training,
                                  const std::vector<record::Recording>& held_out,
                                  const std::vector<record::Recording>& simulated,
                                  const physics::Plant& plant, const SeriesOptions& options) {
  RAVENCAL_ASSIGN_OR_RETURN(SeriesSet set, build_series(training, held_out, plant, options));
  if (!simulated.empty()) {
    RAVENCAL_RETURN_IF_ERROR(
        take_simulation_as_baseline(set, training, held_out, simulated, plant, options));
  }
  return set;
}

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

core::Result<Report> diagnose(std::vector<record::Recording> training,
                              std::vector<record::Recording> held_out, const physics::Plant& plant,
                              Options options) {
  if (options.by_model) {
    RAVENCAL_ASSIGN_OR_RETURN(
        Explained explained,
        explain(training, held_out, plant,
                {options.series.held_out_from_s, options.alpha, options.seed,
                 std::move(options.simulated), options.placebos, options.threads, options.look}));
    explained.report.recordings = seen(training, held_out);
    decide(explained.report, explained.notes);
    return std::move(explained.report);
  }
  const bool against_plant = options.simulated.empty();
  RAVENCAL_ASSIGN_OR_RETURN(
      SeriesSet set, series_of(training, held_out, options.simulated, plant, options.series));
  Report report;
  report.recordings = seen(training, held_out);
  add_looked_at(set, plant, report);
  // Of a long recording the samples are most of the memory.
  training.clear();
  held_out.clear();
  options.simulated.clear();
  ChannelOptions channel_options;
  // Bonferroni over the channels; within a channel max-T covers all candidates.
  channel_options.gates.alpha = options.alpha / static_cast<double>(set.series.size());
  channel_options.seed = options.seed;
  const core::Error stopped{core::ErrorCode::kUsage,
                            "stopped before the diagnosis was complete; nothing was written"};
  Watch watch(options, set.series.size());
  Analysis analysis(set, plant, channel_options, options, watch);
  if (!analysis.run()) return stopped;

  std::vector<ChannelFindings>& findings = analysis.findings;
  if (against_plant) keep_what_runs(set, plant, options, findings);
  std::vector<std::string> notes = set.notes;
  report.routings = std::move(analysis.routings);
  for (const Routing& routing : report.routings) {
    if (std::string sentence = sentence_for(routing); !sentence.empty())
      notes.push_back(std::move(sentence));
  }
  if (analysis.payload) report.effects.push_back(*analysis.payload);
  for (ChannelFindings& f : findings) {
    append(report.mismatch, f.mismatch);
    append(report.effects, f.effects);
    append(report.kept, f.kept);
    append(report.held_out, f.held_out);
    if (f.left) report.left.push_back(*f.left);
    append(report.unexplained, f.unexplained);
    append(report.not_found, f.not_found);
    append(report.candidates, f.candidates);
    append(notes, f.notes);
    append(report.refitted, f.refitted);
    if (!f.plot.t_s.empty()) report.plots.push_back(std::move(f.plot));
  }
  if (!against_plant) refer_to_measured(set, report);
  merge_joint_friction(plant, report);
  move_friction_to_motor(plant, findings, report);
  // Another simulator's drive cannot be run here.
  if (against_plant) judge_in_free_run(set, findings, plant, options, report);
  add_silent(set, plant, report);
  report.verdict.false_alarm_rate =
      false_alarm_rate(set, findings, plant, channel_options, options, watch);
  if (watch.stopped()) return stopped;
  if (report.verdict.false_alarm_rate) report.verdict.placebos = options.placebos;
  decide(report, notes);
  improve(plant, report);
  return report;
}

}  // namespace ravencal::diagnose
