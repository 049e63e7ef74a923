// SPDX-License-Identifier: Apache-2.0
#include "diagnose/diagnose.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>
#include <optional>
#include <random>
#include <thread>

#include "diagnose/channel/across_channels.hpp"
#include "diagnose/channel/arm_payload.hpp"
#include "diagnose/channel/channel.hpp"
#include "diagnose/effects/effects.hpp"
#include "diagnose/findings/verdict.hpp"
#include "diagnose/free_run/judge.hpp"
#include "diagnose/report/write_report.hpp"
#include "diagnose/simulated.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;

/// Runs `work(i)` for i in [0, count) on several threads; each i writes only its own result.
template <typename Work>
void in_parallel(std::size_t count, unsigned threads, Work&& work) {
  const unsigned cores = std::max(1U, std::thread::hardware_concurrency());
  const std::size_t used = std::min<std::size_t>(count, threads == 0 ? cores : threads);
  std::atomic<std::size_t> next{0};
  const auto loop = [&] {
    for (std::size_t i = next++; i < count; i = next++) work(i);
  };
  std::vector<std::thread> helpers;
  for (std::size_t t = 1; t < used; ++t) helpers.emplace_back(loop);
  loop();
  for (std::thread& helper : helpers) helper.join();
}

ChannelFindings analyse(const Series& series, const physics::Plant& plant,
                        const ChannelOptions& options) {
  return series.stage == Stage::kCommand ? analyse_command(series, plant, options)
                                         : analyse_channel(series, plant, options);
}

/// What twins of a channel are made of.
struct PlaceboParts {
  Eigen::VectorXd prediction;  ///< of the plant as refitted, all rows
  Eigen::VectorXd noise;       ///< held-out residual with everything found, at the training rows
  Blocks blocks;
};

PlaceboParts placebo_parts(const Series& series, const physics::Plant& plant,
                           const ChannelOptions& options) {
  ChannelFindings unused;
  ChannelFit fit = fit_channel(series, plant, options, unused);
  PlaceboParts parts{fit.nominal.prediction, std::move(fit.held_out_residual),
                     std::move(fit.model.blocks)};
  if (series.payload_effort.size() > 0) parts.prediction += series.as_seen(series.payload_effort);
  for (std::size_t t = 0; t < fit.nominal.terms.size(); ++t) {
    parts.prediction += fit.coefficients[static_cast<Index>(t) + 1] * fit.nominal.terms[t].column;
  }
  return parts;
}

/// The channel's own motion and noise with nothing left out: plant as refitted, floor with the
/// signs of whole blocks drawn anew.
Series placebo_twin(const Series& series, const PlaceboParts& parts, std::uint64_t seed) {
  Series twin = series;
  std::mt19937_64 engine(seed);
  const Blocks& blocks = parts.blocks;
  twin.y = parts.prediction;
  for (std::size_t b = 0; b < blocks.count(); ++b) {
    const double sign = (engine() & 1U) != 0 ? 1.0 : -1.0;
    for (Index i = blocks.first(b); i < blocks.first(b) + blocks.size(b); ++i) {
      twin.y[blocks.rows[static_cast<std::size_t>(i)]] += sign * parts.noise[i];
    }
  }
  return twin;
}

/// Share of twins in which anything is named, over all channels of the report.
double false_alarm_rate(const std::vector<const Series*>& channels, const physics::Plant& plant,
                        const ChannelOptions& base, const Options& options) {
  const auto twins = static_cast<std::size_t>(options.placebo_twins);
  std::vector<PlaceboParts> parts(channels.size());
  in_parallel(parts.size(), options.threads,
              [&](std::size_t c) { parts[c] = placebo_parts(*channels[c], plant, base); });
  std::vector<char> alarm(channels.size() * twins, 0);
  in_parallel(alarm.size(), options.threads, [&](std::size_t i) {
    ChannelOptions twin_options = base;
    twin_options.details = false;
    twin_options.seed = base.seed + 7919 * (i + 1);
    const std::size_t c = i / twins;
    const Series twin = placebo_twin(*channels[c], parts[c], twin_options.seed);
    alarm[i] = analyse_channel(twin, plant, twin_options).effects.empty() ? 0 : 1;
  });
  std::size_t alarms = 0;
  for (std::size_t t = 0; t < twins; ++t) {
    bool any = false;
    for (std::size_t c = 0; c < channels.size(); ++c) any = any || alarm[c * twins + t] != 0;
    alarms += any ? 1U : 0U;
  }
  return static_cast<double>(alarms) / static_cast<double>(twins);
}

template <typename T>
void append(std::vector<T>& to, std::vector<T>& from) {
  to.insert(to.end(), std::make_move_iterator(from.begin()), std::make_move_iterator(from.end()));
}

/// What the free runs of that drive say of these findings.
FreeRunVerdict free_run_of(const SeriesSet& set, const std::vector<ChannelFindings>& findings,
                           std::size_t drive, const physics::Plant& plant, const Options& options) {
  Report report;
  for (const ChannelFindings& f : findings) {
    report.effects.insert(report.effects.end(), f.effects.begin(), f.effects.end());
    report.kept.insert(report.kept.end(), f.kept.begin(), f.kept.end());
    report.refitted.insert(report.refitted.end(), f.refitted.begin(), f.refitted.end());
  }
  merge_joint_friction(plant, report);
  const auto text = improved_plant(plant, report);
  if (!text) return {};
  const auto improved = physics::parse_plant(*text, plant.source);
  if (!improved) return {};
  return judge_drive(set, findings, drive, plant, *improved, report, options.seed + 900 + drive);
}

/// Equation error screens, free run judges: a drive that runs better without what has no name does
/// without it.
void keep_what_runs(const SeriesSet& set, const physics::Plant& plant, const Options& options,
                    std::vector<ChannelFindings>& findings) {
  std::vector<char> worse(findings.size(), 0);
  in_parallel(findings.size(), options.threads, [&](std::size_t i) {
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
  const auto text = improved_plant(plant, report);
  if (!text) return;
  const auto improved = physics::parse_plant(*text, plant.source);
  if (!improved) return;
  std::vector<FreeRunVerdict> verdicts(set.series.size());
  in_parallel(set.series.size(), options.threads, [&](std::size_t i) {
    if (set.series[i].stage != Stage::kDrive) return;
    verdicts[i] = judge_drive(set, findings, i, plant, *improved, report, options.seed + 900 + i);
  });
  for (std::size_t i = 0; i < verdicts.size(); ++i) apply(verdicts[i], set.series[i], report);
}

/// Vocabulary entries that no channel of this joint spoke about; what the plant has is not left
/// out.
void add_silent(const SeriesSet& set, const physics::Plant& plant, Report& report) {
  for (const physics::Joint& joint : plant.joints) {
    for (const VocabularyEntry& entry : vocabulary()) {
      if (entry.id == "unknown" || plant_has(plant, joint.name, std::string(entry.id), ""))
        continue;
      const auto same = [&](const auto& item) {
        return item.id == entry.id && item.joint == joint.name;
      };
      if (std::any_of(report.effects.begin(), report.effects.end(), same) ||
          std::any_of(report.not_found.begin(), report.not_found.end(), same)) {
        continue;
      }
      const auto reason = set.not_possible.find(joint.name);
      const std::string why = entry.stage == Stage::kCommand
                                  ? "the recording or the plant lacks the command's inputs, its "
                                    "output or its control law"
                              : reason != set.not_possible.end()
                                  ? reason->second
                                  : "no channel of this joint shows it";
      report.not_found.push_back({std::string(entry.id), joint.name, std::nullopt, "", why});
    }
  }
}

/// Residuals against the plant's prediction or, where there is one, another simulation's. Takes the
/// recordings and lets them go: of a long one they are most of the memory.
core::Result<SeriesSet> series_of(std::vector<record::Recording> training,
                                  std::vector<record::Recording> held_out,
                                  std::vector<record::Recording> simulated,
                                  const physics::Plant& plant, const SeriesOptions& options) {
  RAVENCAL_ASSIGN_OR_RETURN(SeriesSet set, build_series(training, held_out, plant, options));
  if (!simulated.empty()) {
    RAVENCAL_RETURN_IF_ERROR(
        take_simulation_as_baseline(set, training, held_out, simulated, plant, options));
  }
  return set;
}

}  // namespace

core::Result<Report> diagnose(std::vector<record::Recording> training,
                              std::vector<record::Recording> held_out, const physics::Plant& plant,
                              Options options) {
  const bool against_plant = options.simulated.empty();
  RAVENCAL_ASSIGN_OR_RETURN(SeriesSet set,
                            series_of(std::move(training), std::move(held_out),
                                      std::move(options.simulated), plant, options.series));
  ChannelOptions channel_options;
  // Bonferroni over the channels; within a channel max-T covers all candidates.
  channel_options.gates.alpha = options.alpha / static_cast<double>(set.series.size());
  channel_options.seed = options.seed;
  std::vector<ChannelFindings> findings(set.series.size());
  std::atomic<std::size_t> done{0};
  std::atomic<bool> stop{false};
  std::mutex look_mutex;
  const auto analyse_those = [&](const auto& wanted) {
    in_parallel(set.series.size(), options.threads, [&](std::size_t i) {
      if (stop || !wanted(set.series[i])) return;
      findings[i] = analyse(set.series[i], plant, channel_options);
      const auto share =
          std::min(1.0, static_cast<double>(++done) / static_cast<double>(set.series.size()));
      const std::lock_guard<std::mutex> lock(look_mutex);
      if (options.look && !options.look(0.9 * share, set.series[i].joint)) stop = true;
    });
  };
  analyse_those([](const Series& series) { return series.stage != Stage::kTransmission; });
  const std::optional<NamedEffect> payload = payload_of_arm(set, plant, channel_options, findings);
  if (payload) {
    hang(*payload, set);
    analyse_those([](const Series& series) { return series.stage == Stage::kDrive; });
  }
  load_transmissions(set, findings);
  analyse_those([](const Series& series) { return series.stage == Stage::kTransmission; });
  if (stop)
    return core::Error{core::ErrorCode::kUsage,
                       "stopped before the diagnosis was complete; nothing was written"};

  if (against_plant) keep_what_runs(set, plant, options, findings);
  Report report;
  std::vector<std::string> notes;
  if (payload) report.effects.push_back(*payload);
  for (ChannelFindings& f : findings) {
    append(report.mismatch, f.mismatch);
    append(report.effects, f.effects);
    append(report.kept, f.kept);
    append(report.held_out, f.held_out);
    append(report.unexplained, f.unexplained);
    append(report.not_found, f.not_found);
    append(report.candidates, f.candidates);
    append(notes, f.notes);
    append(report.refitted, f.refitted);
    if (!f.plot.t_s.empty()) report.plots.push_back(std::move(f.plot));
  }
  merge_joint_friction(plant, report);
  move_friction_to_motor(plant, report);
  // Another simulator's drive cannot be run here.
  if (against_plant) judge_in_free_run(set, findings, plant, options, report);
  add_silent(set, plant, report);
  if (options.placebo_twins > 0) {
    std::vector<const Series*> channels;
    for (const Series& series : set.series) {
      if (series.stage != Stage::kCommand) channels.push_back(&series);
    }
    if (!channels.empty()) {
      report.verdict.false_alarm_rate = false_alarm_rate(channels, plant, channel_options, options);
      report.verdict.placebo_twins = options.placebo_twins;
    }
  }
  decide(report, notes);
  return report;
}

}  // namespace ravencal::diagnose
