// SPDX-License-Identifier: Apache-2.0
#include "study/compare.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "core/run_tasks.hpp"
#include "core/units.hpp"
#include "learn/evaluate.hpp"
#include "learn/onnx_file.hpp"
#include "model/blob_writer.hpp"
#include "study/compare_evaluate.hpp"
#include "study/compare_seeds.hpp"
#include "study/job_store.hpp"

namespace ravencal::study {
namespace {

using methods::Method;
using methods::Predictor;
using methods::Problem;
using methods::Series;

constexpr std::size_t kMapCells = 12;

/// Joints that are fitted together: same inputs, errors known in the same rows.
struct Group {
  Problem problem;
  std::vector<Series> train;
  std::map<std::string, std::vector<Series>> sets;
};

core::Result<Group> make_group(const CompareData& data, const CompareOptions& options,
                               const std::string& features,
                               const std::vector<std::string>& joints) {
  Group group;
  RAVENCAL_ASSIGN_OR_RETURN(
      group.problem, methods::make_problem(*data.train.front(), features, options.play, joints));
  if (options.poses) group.problem.order = methods::Order::kPoses;
  for (const record::Recording* recording : data.train) {
    RAVENCAL_ASSIGN_OR_RETURN(Series series, methods::make_series(group.problem, *recording));
    group.train.push_back(std::move(series));
  }
  for (const auto& [name, recordings] : data.sets) {
    for (const record::Recording* recording : recordings) {
      RAVENCAL_ASSIGN_OR_RETURN(Series series, methods::make_series(group.problem, *recording));
      group.sets[name].push_back(std::move(series));
    }
  }
  return group;
}

/// True if most rows that know one joint's error do not know all of them.
bool errors_lie_apart(const Group& group) {
  const Eigen::Index outputs = group.train.front().errors.cols();
  Eigen::ArrayXd each = Eigen::ArrayXd::Zero(outputs);
  double all = 0.0;
  for (const Series& series : group.train) {
    for (Eigen::Index row = 0; row < series.rows(); ++row) {
      all += series.errors.row(row).allFinite() ? 1.0 : 0.0;
      each += series.errors.row(row).transpose().array().isFinite().cast<double>();
    }
  }
  return all < 0.5 * each.maxCoeff();
}

struct Groups {
  std::vector<Group> all;
  double weight = 1.0;  ///< of a group's minutes: groups share their rows, or have their own
  std::optional<MapAxes> axes;            ///< of the test's error maps; none where joints are apart
  std::vector<model::RandomSeeds> seeds;  ///< of the training
};

core::Result<Groups> make_groups(const CompareData& data, const CompareOptions& options) {
  Groups groups;
  groups.seeds = learn::seeds_of(data.train);
  RAVENCAL_ASSIGN_OR_RETURN(Group whole,
                            make_group(data, options, options.features, options.joints));
  const bool apart = errors_lie_apart(whole);
  if (options.features_of.empty() && !apart) {
    if (whole.problem.outputs.size() > 1)
      groups.axes = map_axes_of(whole.sets.at("test"), kMapCells);
    groups.all.push_back(std::move(whole));
    return groups;
  }
  if (!apart) groups.weight = 1.0 / static_cast<double>(whole.problem.outputs.size());
  for (const model::OutputSpec& output : whole.problem.outputs) {
    const auto own = options.features_of.find(output.joint);
    RAVENCAL_ASSIGN_OR_RETURN(
        Group group,
        make_group(data, options, own == options.features_of.end() ? options.features : own->second,
                   {output.joint}));
    groups.all.push_back(std::move(group));
  }
  return groups;
}

/// Minutes of motion in the rows of these series that train.
double minutes_of(std::span<const Series> series, const Problem& problem) {
  return static_cast<double>(methods::count_training_rows(series)) * problem.row_period_s / 60.0;
}

/// Everything that a method's result depends on.
std::string description_of(const CompareOptions& options, std::string_view method) {
  const methods::Settings& s = options.settings;
  std::string key = fmt::format(
      "{}; features {}; play {}; joints {}; shares {}; poses {}; seed {}; hidden {} activation {}; "
      "epochs {} batch {} networks {} rate {} penalty {}; gru {} {} {} {}; lstm {} {}; inducing "
      "{}; "
      "trees {}; loop {}",
      method, options.features, fmt::join(options.play, ","), fmt::join(options.joints, ","),
      fmt::join(options.shares, ","), options.poses, s.seed, fmt::join(s.hidden, ","),
      static_cast<int>(s.activation), s.epochs, s.batch, s.networks, s.learning_rate,
      s.penalty_scale, s.gru_units, s.gru_dense, s.gru_epochs, s.gru_iterations, s.lstm_units,
      s.lstm_iterations, s.inducing, s.trees, static_cast<bool>(options.measure));
  for (const auto& [joint, features] : options.features_of)
    key += fmt::format("; {}={}", joint, features);
  for (const auto& [name, value] : options.facts) {
    if (name.starts_with("physics") && !method.starts_with("physics")) continue;
    key += "; " + name + " " + value;
  }
  return key;
}

class MethodRun {
 public:
  MethodRun(const Method& method, Groups& groups, const CompareOptions& options,
            std::function<bool(double)> keep_going)
      : method_(method), groups_(groups), options_(options), keep_going_(std::move(keep_going)) {
    result_.id = method.id();
    result_.title = method.title();
    result_.source = method.source();
    result_.ours = method.ours();
  }

  /// Nothing if stopped.
  std::optional<MethodResult> run() {
    for (const Group& group : groups_.all) {
      const std::string why = method_.unsuited(group.problem, group.train, options_.settings);
      if (!why.empty()) return without_figures(CompareStatus::kUnsuited, why);
    }
    double all = 1.0;
    for (const double share : options_.shares) all += share;
    double done = 0.0;
    for (const double share : options_.shares) {
      const auto point = fit_share(share, done / all, (done + share) / all);
      if (!point.ok()) return failed(point.error());
      result_.curve.push_back(*point);
      done += share;
    }
    const core::Status whole = fit_whole(done / all);
    if (!whole.ok()) return failed(whole.error());
    return result_;
  }

 private:
  std::optional<MethodResult> without_figures(CompareStatus status, std::string why) {
    result_.status = status;
    result_.reason = std::move(why);
    result_.curve.clear();
    result_.joints.clear();
    return result_;
  }
  std::optional<MethodResult> failed(const core::Error& error) {
    if (stopped_) return std::nullopt;
    return without_figures(CompareStatus::kFailed, error.message);
  }

  methods::Settings settings(double from, double to) {
    methods::Settings s = options_.settings;
    s.keep_going = [this, from, to](double share) {
      if (!keep_going_(from + (to - from) * share)) stopped_ = true;
      return !stopped_;
    };
    return s;
  }

  core::Result<CurvePoint> fit_share(double share, double from, double to) {
    CurvePoint point;
    point.share = share;
    for (Group& group : groups_.all) {
      const auto rows = static_cast<Eigen::Index>(
          share * static_cast<double>(methods::count_training_rows(group.train)));
      const std::vector<Series> part = methods::first_rows(group.train, rows);
      RAVENCAL_ASSIGN_OR_RETURN(const std::unique_ptr<Predictor> predictor,
                                method_.fit(group.problem, part, settings(from, to)));
      point.minutes += minutes_of(part, group.problem) * groups_.weight;
      const auto left = errors_left(*predictor, group.sets.at("test"));
      for (std::size_t k = 0; k < group.problem.outputs.size(); ++k) {
        point.rmse.push_back(figure_of(group.sets.at("test"), left, static_cast<Eigen::Index>(k),
                                       per_si(group, k), options_.settings.seed)
                                 .figure.rmse);
      }
    }
    return point;
  }

  core::Status fit_whole(double from) {
    CurvePoint last;
    double p50 = 0.0, p99 = 0.0, p999 = 0.0;
    std::vector<std::string> remarks;
    for (Group& group : groups_.all) {
      const auto before = std::chrono::steady_clock::now();
      RAVENCAL_ASSIGN_OR_RETURN(const std::unique_ptr<Predictor> predictor,
                                method_.fit(group.problem, group.train, settings(from, 1.0)));
      result_.training_s +=
          std::chrono::duration<double>(std::chrono::steady_clock::now() - before).count();
      result_.parameters += predictor->parameters();
      if (!predictor->remark().empty()) remarks.push_back(predictor->remark());
      judge(group, *predictor);
      last.minutes += minutes_of(group.train, group.problem) * groups_.weight;
      const StepTime step = time_steps(*predictor, group.sets.at("test").front());
      p50 += step.p50_us;
      p99 += step.p99_us;
      p999 += step.p999_us;
      RAVENCAL_RETURN_IF_ERROR(keep_model(group, *predictor));
    }
    result_.remark = fmt::format("{}", fmt::join(remarks, "; "));
    result_.own_step = {p50, p99, p999};
    for (const CompareJoint& joint : result_.joints)
      last.rmse.push_back(joint.sets.at("test").rmse);
    result_.curve.push_back(last);
    if (!result_.loop.measured) result_.loop.step = result_.own_step;
    return {};
  }

  static double per_si(const Group& group, std::size_t k) {
    return core::display_unit(group.problem.outputs[k].unit).per_si;
  }

  void judge(const Group& group, Predictor& predictor) {
    for (std::size_t k = 0; k < group.problem.outputs.size(); ++k) {
      const model::OutputSpec& output = group.problem.outputs[k];
      CompareJoint joint{output.joint, core::display_unit(output.unit).name, {}, {}};
      result_.joints.push_back(std::move(joint));
    }
    const std::size_t first = result_.joints.size() - group.problem.outputs.size();
    for (const auto& [name, series] : group.sets) {
      const auto left = errors_left(predictor, series);
      for (std::size_t k = 0; k < group.problem.outputs.size(); ++k) {
        const auto output = static_cast<Eigen::Index>(k);
        FigureAndBlocks figure =
            figure_of(series, left, output, per_si(group, k), options_.settings.seed);
        CompareJoint& joint = result_.joints[first + k];
        joint.sets[name] = figure.figure;
        if (name != "test") continue;
        joint.blocks = std::move(figure.blocks);
        if (!groups_.axes) continue;
        result_.maps.push_back(
            {joint.joint, joint.unit, error_map_of(*groups_.axes, left, output, per_si(group, k))});
      }
    }
  }

  /// Keeps what convert and the plugin take, and asks the loop for its time.
  core::Status keep_model(const Group& group, const Predictor& predictor) {
    LoopFitness& loop = result_.loop;
    const model::CalibrationModel* model = predictor.model();
    if (model == nullptr) {
      loop.why_not = method_.why_not_loadable();
      return {};
    }
    loop.loadable = true;
    const std::filesystem::path folder = options_.out / "models";
    std::error_code ignored;
    std::filesystem::create_directories(folder, ignored);
    const bool recurrent =
        model->layers.size() > 1 && model->layers[0].kind == model::packed::LayerKind::kGruInput;
    const std::string name =
        fmt::format("{}{}-{}.{}", result_.id,
                    groups_.all.size() > 1 ? "_" + group.problem.outputs.front().joint : "",
                    key_of(description_of(options_, result_.id)), recurrent ? "blob" : "onnx");
    model::CalibrationModel kept = *model;
    kept.seeds = groups_.seeds;
    RAVENCAL_RETURN_IF_ERROR(recurrent ? model::write_blob(kept, folder / name)
                                       : learn::write_onnx(kept, folder / name));
    result_.model_file += (result_.model_file.empty() ? "models/" : ", models/") + name;
    if (!options_.measure || groups_.all.size() > 1) {
      loop.why_not_measured =
          groups_.all.size() > 1 ? "one model per joint" : options_.why_not_measured;
      return {};
    }
    auto measured = options_.measure(*model);
    if (measured.ok()) {
      loop = std::move(*measured);
      loop.loadable = true;
    } else {
      loop.why_not_measured = measured.error().message;
    }
    return {};
  }

  const Method& method_;
  Groups& groups_;
  const CompareOptions& options_;
  std::function<bool(double)> keep_going_;
  MethodResult result_;
  bool stopped_ = false;
};

core::Result<std::vector<const Method*>> wanted_methods(const CompareOptions& options) {
  std::vector<const Method*> wanted;
  std::vector<std::string> known;
  for (const auto& method : methods::all_methods()) {
    known.emplace_back(method->id());
    const auto& ids = options.methods;
    if (ids.empty() || std::find(ids.begin(), ids.end(), known.back()) != ids.end())
      wanted.push_back(method.get());
  }
  for (const std::string& id : options.methods) {
    if (std::find(known.begin(), known.end(), id) == known.end()) {
      return core::usage_error(fmt::format("--methods: there is no method '{}'; there are {}", id,
                                           fmt::join(known, ", ")));
    }
  }
  return wanted;
}

/// Best of ours against the best of the others, joint by joint.
std::vector<RivalVerdict> verdicts_of(const std::vector<MethodResult>& results,
                                      std::uint64_t seed) {
  std::vector<RivalVerdict> verdicts;
  const auto joints = [&]() -> std::size_t {
    for (const MethodResult& m : results) {
      if (!m.joints.empty()) return m.joints.size();
    }
    return 0;
  }();
  for (std::size_t k = 0; k < joints; ++k) {
    const MethodResult* best[2] = {nullptr, nullptr};
    const auto rmse = [&](const MethodResult& m) { return m.joints[k].sets.at("test").rmse; };
    for (const MethodResult& m : results) {
      if (m.status != CompareStatus::kDone || !std::isfinite(rmse(m))) continue;
      const MethodResult*& leader = best[m.ours ? 0 : 1];
      if (leader == nullptr || rmse(m) < rmse(*leader)) leader = &m;
    }
    if (best[0] == nullptr || best[1] == nullptr) continue;
    const CompareJoint& ours = best[0]->joints[k];
    const CompareJoint& rival = best[1]->joints[k];
    const Ratio ratio = paired_ratio(ours.blocks, rival.blocks, seed);
    verdicts.push_back({ours.joint, ours.unit, best[0]->id, best[1]->id, rmse(*best[0]),
                        rmse(*best[1]), ratio.value, ratio.low, ratio.high});
  }
  return verdicts;
}

}  // namespace

core::Result<CompareOutcome> compare(const CompareData& data, const CompareOptions& options) {
  if (data.train.empty() || !data.sets.contains("test") || data.sets.at("test").empty())
    return core::Error{core::ErrorCode::kUsage, "needs recordings to train on and to test on"};
  RAVENCAL_ASSIGN_OR_RETURN(const auto wanted, wanted_methods(options));
  CompareOutcome outcome;
  Comparison& comparison = outcome.comparison;
  comparison.shared = shared_with_tests(data);
  if (!options.same_seed) RAVENCAL_RETURN_IF_ERROR(learn::check_run_seeds(comparison.shared));
  RAVENCAL_ASSIGN_OR_RETURN(Groups groups, make_groups(data, options));
  comparison.title = options.title;
  comparison.facts = options.facts;
  comparison.order = name_of(groups.all.front().problem.order);
  for (const Group& group : groups.all)
    comparison.training_minutes += minutes_of(group.train, group.problem) * groups.weight;
  comparison.loop_budget_us = options.loop_budget_us;
  if (groups.axes) comparison.map = grid_of(*groups.axes, groups.all.front().problem.outputs);
  // One after the other: their times are compared.
  const auto run = [&](std::size_t i,
                       const std::function<bool(double)>& report) -> core::Result<bool> {
    const std::string job = description_of(options, wanted[i]->id());
    RAVENCAL_ASSIGN_OR_RETURN(std::optional<MethodResult> result, read_method(job, options.out));
    if (!result) {
      result = MethodRun(*wanted[i], groups, options, report).run();
      if (!result) return false;
      RAVENCAL_RETURN_IF_ERROR(write_method(*result, job, options.out));
    }
    comparison.methods.push_back(std::move(*result));
    return true;
  };
  RAVENCAL_ASSIGN_OR_RETURN(
      const core::TasksDone done,
      core::run_tasks(wanted.size(), 1, run, [&](double share, std::size_t, std::size_t i) {
        return options.look(share, wanted[i]->id());
      }));
  outcome.interrupted = done.interrupted;
  comparison.verdicts = verdicts_of(comparison.methods, options.settings.seed);
  return outcome;
}

}  // namespace ravencal::study
