// SPDX-License-Identifier: Apache-2.0
#include "choice/choose.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "choice/assemble.hpp"
#include "choice/condense.hpp"
#include "choice/expected.hpp"
#include "choice/input_selection.hpp"
#include "choice/input_sets.hpp"
#include "choice/rows.hpp"
#include "choice/variety.hpp"
#include "core/version.hpp"
#include "learn/dataset.hpp"
#include "learn/motion_range.hpp"
#include "learn/recording_origin.hpp"
#include "learn/recordings_at_hook.hpp"
#include "learn/shared_seeds.hpp"
#include "model/homing_constants.hpp"
#include "model/hook_view.hpp"
#include "model/jacobian.hpp"

namespace ravencal::choice {
namespace {

using Eigen::Index;
using record::Recording;

/// Units of a nonlinear candidate, and at least so many rows for each.
constexpr Index kUnits = 300;
constexpr Index kRowsPerUnit = 4;
constexpr int kDraws = 4;
/// Gentle units make smooth functions of low order, steep ones bend within a standard deviation.
struct Kind {
  const char* name;
  double steepness;  ///< 0: no units
};
constexpr std::array<Kind, 3> kKinds = {
    {{"linear", 0.0}, {"gentle units", 0.3}, {"steep units", 1.0}}};

JointRows joint_rows(const Rows& all, const Eigen::MatrixXd& scaled, const InputSets& sets,
                     Index output, SessionRule sessions) {
  std::vector<Index> known;
  std::vector<int> recording;
  for (Index row = 0; row < all.errors.rows(); ++row) {
    if (!std::isfinite(all.errors(row, output))) continue;
    known.push_back(row);
    recording.push_back(all.recording[static_cast<std::size_t>(row)]);
  }
  JointRows rows;
  rows.scaled = scaled(known, Eigen::all);
  rows.errors = all.errors(known, output);
  rows.held_out =
      held_out_parts(recording, {rows.scaled(Eigen::all, sets.positions),
                                 all.speeds(known, Eigen::all), all.efforts(known, Eigen::all)});
  const std::vector<InputSet>& own = sets.of_output[static_cast<std::size_t>(output)].own;
  set_sessions(sessions, all, known, own.empty() ? std::vector<Index>{} : own.back().columns, rows);
  return rows;
}

bool is_tried(const Kind& kind, Kinds kinds) {
  if (kinds == Kinds::kAll) return true;
  return (kind.steepness > 0.0) == (kinds == Kinds::kUnits);
}

/// The sets of one joint, from few to many inputs, with those that are selected among them.
std::vector<InputSet> sets_of(const OutputInputs& inputs, const JointRows& rows) {
  std::vector<InputSet> sets = inputs.own;
  if (sets.empty() || inputs.others.empty()) return sets;
  for (InputSet& selected : selected_inputs(inputs, rows)) {
    const bool is_new = std::none_of(sets.begin(), sets.end(), [&](const InputSet& set) {
      return set.columns == selected.columns;
    });
    if (is_new) sets.push_back(std::move(selected));
  }
  return sets;
}

/// Trials of one joint, from the simplest on. `keep_going` gets the share done.
std::vector<Trial> try_all(const std::vector<InputSet>& sets, const JointRows& rows,
                           const ChoiceOptions& options,
                           const std::function<bool(double, const std::string&)>& keep_going) {
  std::vector<Trial> trials = {try_bias(rows)};
  const double all = static_cast<double>(kKinds.size() * sets.size());
  double done = 0.0;
  for (const Kind& kind : kKinds) {
    for (const InputSet& set : sets) {
      ++done;
      if (!is_tried(kind, options.kinds)) continue;
      std::string name = fmt::format("{}, {}", kind.name, set.name);
      if (!keep_going((done - 1.0) / all, name)) return trials;
      const Index units =
          kind.steepness > 0.0 ? std::min(kUnits, rows.errors.size() / kRowsPerUnit) : 0;
      const int draws = units > 0 ? kDraws : 1;
      trials.push_back(try_basis(std::move(name),
                                 {set.columns, units, kind.steepness, options.seed, draws}, rows));
    }
  }
  return trials;
}

JointChoice table_of(const model::OutputSpec& output, const std::vector<Trial>& trials,
                     const std::vector<Member>& members, const HeldOut& held_out) {
  JointChoice choice{output.joint, output.unit, {}, held_out.parts, held_out.by_recording, {}, {}};
  for (const Trial& trial : trials) {
    choice.tried.push_back(
        {trial.name, trial.ridge, trial.inside_rmse, trial.inside_error, trial.outside_rmse, 0.0});
  }
  for (const Member& member : members) choice.tried[member.trial].weight = member.weight;
  return choice;
}

/// The chosen trials, fitted to all rows. A trial without inputs is the mean. Returns the constants
/// of the sessions.
std::vector<double> add_parts(Index output, const std::vector<Trial>& trials,
                              const std::vector<Member>& members, const JointRows& rows,
                              std::vector<Part>& parts) {
  Eigen::VectorXd constants;
  for (const Member& member : members) {
    const Trial& trial = trials[member.trial];
    std::vector<Fit> fits;
    for (int k = 0; k < trial.basis.draws; ++k) {
      Basis basis = draw(trial.basis, k);
      const Readout readout = fit_readout(basis, trial.ridge, rows);
      const Eigen::Map<const Eigen::VectorXd> of_sessions(
          readout.of_sessions.data(), static_cast<Index>(readout.of_sessions.size()));
      if (constants.size() == 0) constants.setZero(of_sessions.size());
      constants += member.weight / trial.basis.draws * of_sessions;
      fits.push_back({std::move(basis), readout.weights});
    }
    Fit fit = condensed(fits, trial.basis.units, rows.scaled);
    parts.push_back({output, std::move(fit.basis), member.weight * fit.readout});
  }
  return {constants.begin(), constants.end()};
}

/// Offered inputs that some part uses, and the positions of means over travel among them, which the
/// plugin reads as inputs; the parts' columns become theirs. At least one input stays: a network
/// needs one.
std::vector<Index> used_columns(const std::vector<model::FeatureSpec>& features,
                                std::vector<Part>& parts) {
  std::map<Index, Index> used;
  for (const Part& part : parts) {
    for (const Index column : part.basis.columns) used.emplace(column, 0);
  }
  if (used.empty()) used.emplace(0, 0);
  for (std::size_t i = 0; i < features.size(); ++i) {
    if (features[i].transform != model::Transform::kValue) continue;
    const bool is_needed = std::any_of(used.begin(), used.end(), [&](const auto& column) {
      return features[static_cast<std::size_t>(column.first)].along == features[i].channel;
    });
    if (is_needed) used.emplace(static_cast<Index>(i), 0);
  }
  std::vector<Index> columns;
  for (auto& [column, position] : used) {
    position = static_cast<Index>(columns.size());
    columns.push_back(column);
  }
  for (Part& part : parts) {
    for (Index& column : part.basis.columns) column = used.at(column);
  }
  return columns;
}

/// Draws of different members are independent.
double left_to_chance(const std::vector<Trial>& trials, const std::vector<Member>& members) {
  double sum = 0.0;
  for (const Member& member : members)
    sum = std::hypot(sum, member.weight * trials[member.trial].left_to_chance);
  return sum;
}

/// What the held-out parts, which hold every row once, leave of each row.
Eigen::VectorXd left_of_parts(const Combination& chosen, const HeldOut& held_out) {
  Eigen::VectorXd left(0);
  for (std::size_t p = 0; p < held_out.parts; ++p)
    left.conservativeResize(left.size() + std::ssize(held_out.lists[p]));
  std::size_t judged = 0;
  for (std::size_t p = 0; p < held_out.parts; ++p) {
    if (!held_out.lists[p].empty()) left(held_out.lists[p]) = chosen.judged[judged++];
  }
  return left;
}

model::Standardiser output_scaling(const Eigen::MatrixXd& errors) {
  model::Standardiser scaling{Eigen::VectorXd(errors.cols()), Eigen::VectorXd(errors.cols())};
  for (Index k = 0; k < errors.cols(); ++k) {
    std::vector<Index> known;
    for (Index row = 0; row < errors.rows(); ++row) {
      if (std::isfinite(errors(row, k))) known.push_back(row);
    }
    const Eigen::MatrixXd values = errors(known, k);
    const auto of_joint = learn::fit_scaling(Eigen::Ref<const Eigen::MatrixXd>(values));
    scaling.mean[k] = of_joint.standardiser.mean[0];
    scaling.scale[k] = of_joint.standardiser.scale[0];
  }
  return scaling;
}

/// All of the model but its layers, over the inputs in `columns`.
void fit_frame(const Rows& rows, const std::vector<Index>& columns, const InputSets& sets,
               Choice& choice) {
  model::CalibrationModel& model = choice.model;
  choice.rows = rows.inputs(Eigen::all, columns);
  for (const Index column : columns)
    model.features.push_back(sets.features[static_cast<std::size_t>(column)]);
  learn::fit_inputs(choice.rows, model);
}

Eigen::MatrixXd scaled_by(const model::Standardiser& scaling, const model::FeatureMatrix& inputs) {
  return ((inputs.cast<double>().rowwise() - scaling.mean.transpose()).array().rowwise() /
          scaling.scale.transpose().array())
      .matrix();
}

core::Result<InputSets> input_sets(const ChoiceOptions& options,
                                   std::span<const Recording* const> training,
                                   std::span<const model::OutputSpec> outputs) {
  if (options.features.empty()) return offered_inputs(training, outputs);
  RAVENCAL_ASSIGN_OR_RETURN(std::vector<model::FeatureSpec> features,
                            model::select_features(options.features, training.front()->channels));
  return given_inputs(std::move(features), *training.front(), outputs.size());
}

void describe(const Rows& rows, const ChoiceOptions& options, const InputSets& sets,
              Choice& choice) {
  for (const model::OutputSpec& output : choice.model.outputs) {
    if (std::find(sets.held.begin(), sets.held.end(), output.joint) == sets.held.end()) continue;
    choice.warnings.push_back(
        fmt::format("joint {} hardly moves in the training: it is corrected by its mean error "
                    "alone; record a motion of it",
                    output.joint));
  }
  std::size_t homings = 0;
  for (const JointChoice& joint : choice.joints)
    homings = std::max(homings, joint.homing_constants.size());
  for (std::string& warning : variety_warnings(rows, homings))
    choice.warnings.push_back(std::move(warning));
  auto& provenance = choice.model.provenance;
  provenance["ravencal_version"] = core::kVersion;
  provenance["features"] = options.features.empty() ? "(offered)" : options.features;
  provenance["rows"] = fmt::format("{}", rows.inputs.rows());
  provenance["seed"] = fmt::format("{}", options.seed);
  std::vector<std::string> chosen;
  for (const JointChoice& joint : choice.joints) {
    for (const TriedModel& tried : joint.tried) {
      if (tried.weight > 0.0) {
        chosen.push_back(fmt::format("{}: {:.2f} x ({}; ridge {:g})", joint.joint, tried.weight,
                                     tried.name, tried.ridge));
      }
    }
  }
  provenance["settings"] = fmt::format("chosen: {}", fmt::join(chosen, "; "));
  const std::size_t dropped = rows.without_truth + rows.without_input;
  if (dropped > 0) {
    choice.warnings.push_back(fmt::format(
        "{} rows are left out: {} lack the truth or the estimate of every joint, {} lack an input",
        dropped, rows.without_truth, rows.without_input));
  }
}

void keep_constants_of_homings(Choice& choice) {
  std::vector<model::HomingConstants> constants;
  for (std::size_t k = 0; k < choice.joints.size(); ++k) {
    constants.push_back({choice.joints[k].joint, choice.joints[k].homing_constants,
                         choice.model.expected[k].about_mean});
  }
  model::keep_homing_constants(choice.model, constants);
}

}  // namespace

core::Result<Choice> choose_model(
    std::span<const Recording* const> recorded, const ChoiceOptions& options,
    const std::function<bool(double, const std::string&)>& keep_going) {
  if (recorded.empty()) return core::Error{core::ErrorCode::kUsage, "no recording to train on"};
  const learn::RecordingsAtHook at_hook(recorded, options.at_hook);
  const std::span<const Recording* const> training = at_hook.get();
  Choice choice;
  model::CalibrationModel& model = choice.model;
  RAVENCAL_ASSIGN_OR_RETURN(model.origin, learn::common_origin(options.origin, training));
  RAVENCAL_ASSIGN_OR_RETURN(model.outputs, learn::outputs_of(*training.front(), options.joints));
  RAVENCAL_ASSIGN_OR_RETURN(const InputSets sets, input_sets(options, training, model.outputs));
  model.row_period_s = model::row_period_s(*training.front());
  RAVENCAL_ASSIGN_OR_RETURN(const Rows rows,
                            make_rows(sets.features, model.outputs, training, model.row_period_s));
  const Eigen::MatrixXd scaled =
      scaled_by(learn::fit_scaling(rows.inputs).standardiser, rows.inputs);
  std::vector<Part> parts;
  const auto outputs = static_cast<double>(model.outputs.size());
  for (std::size_t k = 0; k < model.outputs.size(); ++k) {
    const auto output = static_cast<Index>(k);
    const JointRows of_joint = joint_rows(rows, scaled, sets, output, options.sessions);
    const auto trials =
        try_all(sets_of(sets.of_output[k], of_joint), of_joint, options,
                [&](double share, const std::string& name) {
                  choice.interrupted =
                      choice.interrupted || !keep_going((static_cast<double>(k) + share) / outputs,
                                                        model.outputs[k].joint + ": " + name);
                  return !choice.interrupted;
                });
    const Combination chosen = combine(trials);
    JointChoice& joint = choice.joints.emplace_back(
        table_of(model.outputs[k], trials, chosen.members, of_joint.held_out));
    joint.session_constants = add_parts(output, trials, chosen.members, of_joint, parts);
    joint.homing_constants = homing_constants(joint.session_constants,
                                              left_of_parts(chosen, of_joint.held_out), of_joint);
    model.expected.push_back(expected_error(chosen.judged, joint.homing_constants,
                                            left_to_chance(trials, chosen.members)));
  }
  model.motion = learn::motion_range(model.outputs, training);
  model.output = output_scaling(rows.errors);
  const std::vector<Index> columns = used_columns(sets.features, parts);
  fit_frame(rows, columns, sets, choice);
  model.layers = layers_of(parts, scaled(Eigen::all, columns), model.output);
  model.loop_gains = model::loop_gains(model, choice.rows);
  describe(rows, options, sets, choice);
  if (options.at_hook) model::set_trained_at_hook(model);
  model.seeds = learn::seeds_of(training);
  model.provenance["recordings"] = learn::files_text(training);
  keep_constants_of_homings(choice);
  return choice;
}

}  // namespace ravencal::choice
