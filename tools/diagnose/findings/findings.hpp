// SPDX-License-Identifier: Apache-2.0
//
// What diagnose found: the values of report.json (schema 1), plus what the page draws. SI units.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "physics/plant.hpp"

namespace ravencal::diagnose {

/// Id of what is real and has no name in the vocabulary.
inline constexpr std::string_view kUnknown = "unknown";

using Interval = std::pair<double, double>;

struct Verdict {
  std::string kind;  ///< nothing_left_out, named, ambiguous, parameter_out_of_tolerance,
                     ///< unexplained, not_testable
  std::string text;
  std::optional<double>
      false_alarm_rate;  ///< measured on placebo recordings; absent if none were run
  int placebos = 0;      ///< how many were run
};

struct Mismatch {
  std::string joint, stage;
  std::vector<std::string> regime;
  std::vector<Interval> interval_s;
  std::vector<Interval> position;
  double excess_rmse = 0.0, floor = 0.0;
  std::string unit;
  double p_value = 1.0;
};

struct NamedParameter {
  std::string name;
  double value = 0.0;
  std::string unit;
  Interval ci95{0.0, 0.0};
};

/// On which side of the motor's encoder and of the gearbox an effect sits: "motor", "joint" or
/// "undecided"; of a gearbox that the plant lacks "none".
struct Sides {
  std::string encoder, gearbox;
  std::string decided_by;  ///< the experiments that would decide what is undecided
};

struct NamedEffect {
  std::string id, joint, stage;
  std::vector<NamedParameter> parameters;
  double held_out_before = 0.0;  ///< what the improved plant leaves without it
  double held_out_after = 0.0;   ///< and with it
  bool of_fitted_rows = false;   ///< both: no row was held out, or one recording alone has it
  std::string unit;
  double p_value = 1.0, size = 0.0, invariance_spread = 0.0;
  std::vector<std::string> ambiguous_with;
  std::string separate_by;
  std::optional<Sides> sides{};   ///< of friction, play and elasticity
  bool out_of_tolerance = false;  ///< a parameter that the plant has, not physics that it lacks
  std::string from;               ///< the other joint, for couplings
  /// That the effect is there; none where nothing was compared with it.
  std::optional<double> probability{};
  bool beyond_plants = false;  ///< no plant can hold it: `improved` does without
};

/// Share of the held-out squared error that the effect takes off; 0 where there was none.
inline double held_out_share(const NamedEffect& effect) {
  const double before = effect.held_out_before;
  return before > 0.0 ? 1.0 - std::pow(effect.held_out_after / before, 2) : 0.0;
}

/// The same figure on one of the recordings.
struct RecordingFigure {
  std::size_t recording = 0;  ///< index into Report::recordings
  double before = 0.0, after = 0.0;
};

struct HeldOut {
  std::string joint, metric, unit;
  double before = 0.0, after = 0.0;
  std::optional<double> floor{};  ///< of the channel; none of a run, which no sensor bounds
  /// 95 % of after / before - 1, stretches of time as observations; none where they are too few.
  std::optional<Interval> change_ci95{};
  std::vector<RecordingFigure> by_recording{};  ///< of a figure that has an interval
  /// RMS of the constants that the plant draws at homing, which are part of neither error; none
  /// where it draws none.
  std::optional<double> drawn_constant{};

  [[nodiscard]] double change() const { return after / before - 1.0; }
};

/// What a channel's plant, as improved, leaves of its error on rows that no fit saw, against a
/// floor in which no effect of the vocabulary has a part. RMS in the channel's unit.
struct ErrorLeft {
  std::string joint, stage, unit;
  double before = 0.0;      ///< of the plant as it is, on the rows that are judged
  double left = 0.0;        ///< of the plant with its numbers as the rows have them, there too
  std::string measured_by;  ///< what the floor is: repetition, resolution, none
  double floor = 0.0;
  std::size_t compared_rows = 0;  ///< that met another pass; 0 without repetition
  double agreement = 0.0;  ///< share of the circumstances' variance that rows so compared share
  double allowed = 0.0;    ///< up to which the floor is reached: chance and the form of simulations
  bool reached = true;     ///< always without a floor
  double of_signal = 0.0;  ///< share of the squared signal that is left

  /// Of the squared error: what is left above the floor.
  [[nodiscard]] double share() const {
    return before > 0.0 ? std::max(0.0, left * left - floor * floor) / (before * before) : 0.0;
  }
};

struct Unexplained {
  std::string joint, stage;
  double share_of_excess = 0.0, size = 0.0;
  std::string unit;
  std::vector<std::string> depends_on;
};

struct NotFound {
  std::string id, joint;
  std::optional<double> detection_limit;
  std::string unit;
  std::string not_testable_because;
  std::string parameter = {};  ///< whose size the limit is; "rms": of all that the effect adds
  bool by_recording = false;   ///< another recording could test it with this plant
};

/// One of the parameters that are known only together.
struct CombinedParameter {
  std::string id, name;
  double power = 1.0;               ///< in the product that is known
  double relative_deviation = 0.0;  ///< of this parameter alone
};

/// The product of the parameters' powers, which the recording fixes although it does not fix them.
struct Combination {
  std::string joint, stage;
  std::vector<CombinedParameter> parameters;
  double value = 0.0;
  Interval ci95{0.0, 0.0};
};

/// One candidate at the last step, with its gates: the page's table.
struct CandidateRow {
  std::string joint, stage, id;
  double gain_share = 0.0, z = 0.0, p_value = 1.0, size = 0.0;
  std::string unit, outcome;
};

/// One stretch of a recording, of unseen rows if there are any: what was recorded, what the plant
/// says, what it says with the effects. NaN parts episodes.
struct Trace {
  std::vector<double> t_s, measured, nominal, refitted;  ///< residual of the channel
  std::vector<double> motion;    ///< position that the residual adds to; empty: it is an effort
  std::size_t recording = 0;     ///< index into Report::recordings
  bool cross_validated = false;  ///< no rows were held out: each is under a fit without its fold
  bool fitted = false;           ///< no rows were held out: these are the ones that were fitted
};

/// RMS of a channel over a grid of position (columns) and signed speed (rows); NaN: too few rows.
struct WhereMap {
  std::vector<double> position_edges, speed_edges;
  std::vector<double> before, after;  ///< [speed][position]
  std::vector<std::size_t> rows;      ///< in each cell
};

/// Held-out RMS after one more part of the model.
struct WaterfallStep {
  std::string step;
  double rmse = 0.0;
};

/// Factor of an effect's fitted size in one part of the data: one everywhere for a true effect.
struct RegimeScale {
  std::string effect, circumstance;
  double scale = 1.0, deviation = 0.0;
};

/// What the page draws of one channel.
struct ChannelPlot {
  std::string joint, stage, unit, position_unit;
  std::vector<double> t_s, position, before, after;
  std::vector<double> speed;
  std::vector<double> load;    ///< effort through the transmission; empty: the plant knows none
  std::vector<double> hold_s;  ///< time since the joint stopped; 0 in motion
  std::string load_unit;
  double floor = 0.0;
  WhereMap where;
  std::vector<WaterfallStep> waterfall;
  std::vector<RegimeScale> scales;
  std::vector<Trace> traces;  ///< of each recording that has unseen rows, the first few
};

/// How far a drive is off on its own, in windows of one length under the recorded effort: RMS.
struct Drift {
  std::string joint, unit;
  double horizon_s = 0.0;  ///< length of the windows
  double before = 0.0;     ///< of the plant as given
  double refitted = 0.0;   ///< of the given plant with its own numbers refitted
  double after = 0.0;      ///< of the improved plant
};

/// One number of a drive by two estimators: equation error, which compares efforts along the
/// recorded motion, and free run, which compares motions under the recorded effort.
struct TwoEstimates {
  std::string joint, id, parameter, unit;
  double equation_error = 0.0;
  Interval equation_error_ci95{0.0, 0.0};
  double free_run = 0.0;
  Interval free_run_ci95{0.0, 0.0};
  double allowed = 0.0;  ///< difference up to which they agree: what both are uncertain by, and
                         ///< the forms of laws, of which no model has the robot's own
  bool agree = true;
};

/// A recording that was diagnosed.
struct SeenRecording {
  std::string name;  ///< of its file
  bool held_out = false;
  double duration_s = 0.0;
};

/// What a channel saw of the recordings: the findings hold for no more than this.
struct LookedAt {
  std::string joint, stage;
  std::size_t rows = 0, held_out_rows = 0;
  Interval band_hz{0.0, 0.0};  ///< from the longest stretch to the filter or to half the row rate
  std::string position_unit, effort_unit;
  Interval position{0.0, 0.0};
  double fastest = 0.0;          ///< position_unit per s
  double rest_share = 0.0;       ///< share of the rows slower than a fiftieth of the usual speed
  std::optional<Interval> load;  ///< effort through the transmission, where it is known
  std::vector<std::string> circumstances;  ///< in whose parts every size was compared
  double above_band = 0.0;  ///< share of the effort's power above that band, noise apart
};

/// A stage of a joint that these recordings do not show.
struct NotLookedAt {
  std::string joint, stage, because;
};

/// What a joint's cable follows of the joints that move it, by all transmissions that show it.
struct Routing {
  std::string joint;
  std::string through;             ///< "link", "drive" or "unknown"
  bool by_plant = false;           ///< the plant says so
  double link = 0.0, drive = 0.0;  ///< probabilities; the rest: neither explains what was seen
};

struct Report {
  Verdict verdict;
  std::vector<std::string> notes;  ///< what was taken for granted or left out; no full stop
  std::vector<SeenRecording> recordings;
  std::vector<LookedAt> looked_at;
  std::vector<NotLookedAt> not_looked_at;
  std::vector<Mismatch> mismatch;
  std::vector<NamedEffect> effects;
  std::vector<HeldOut> held_out;
  std::vector<Drift> drift;
  std::vector<TwoEstimates> two_estimates;
  std::vector<ErrorLeft> left;  ///< of each channel that was looked at as a whole
  std::vector<Unexplained> unexplained;
  std::vector<NotFound> not_found;
  std::vector<NamedEffect> refitted;  ///< nominal parameters, moved within their tolerance
  std::vector<Combination> combinations;
  std::vector<Routing> routings;  ///< of cables that other joints move
  std::vector<CandidateRow> candidates;
  std::vector<ChannelPlot> plots;
  physics::Plant improved;  ///< the plant with what was found: every "after" is what it predicts
  std::vector<std::pair<std::string, std::string>> provenance;
};

/// The first of these findings that is of the same joint and stage; null without any.
template <typename Findings, typename Finding>
auto* at_place_of(const Finding& place, Findings& findings) {
  const auto it = std::find_if(findings.begin(), findings.end(), [&](const auto& finding) {
    return finding.joint == place.joint && finding.stage == place.stage;
  });
  return it == findings.end() ? nullptr : &*it;
}

}  // namespace ravencal::diagnose
