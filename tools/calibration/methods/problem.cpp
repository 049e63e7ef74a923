// SPDX-License-Identifier: Apache-2.0
#include "methods/problem.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "learn/dataset.hpp"
#include "learn/motion_range.hpp"
#include "model/feature_matrix.hpp"
#include "record/homing.hpp"

namespace ravencal::methods {
namespace {

using record::Recording;
using record::Role;

constexpr double kLost = std::numeric_limits<double>::quiet_NaN();

Eigen::VectorXd effort_of(const Recording& recording, const std::string& joint) {
  const auto column = learn::effort_column(recording, joint);
  if (column) return recording.samples.col(*column);
  return Eigen::VectorXd::Constant(recording.rows(), kLost);
}

std::vector<char> episode_starts(const Recording& recording) {
  std::vector<char> fresh(static_cast<std::size_t>(recording.rows()), 0);
  if (!fresh.empty()) fresh.front() = 1;
  for (const record::Event& event : recording.events) {
    if (event.kind != "episode") continue;
    const auto at = std::lower_bound(recording.t_ns.begin(), recording.t_ns.end(), event.t_ns);
    if (at != recording.t_ns.end())
      fresh[static_cast<std::size_t>(at - recording.t_ns.begin())] = 1;
  }
  return fresh;
}

}  // namespace

std::string_view name_of(Order order) {
  switch (order) {
    case Order::kTime:
      return "time";
    case Order::kSequence:
      return "sequence";
    case Order::kPoses:
      return "poses";
  }
  return "";
}

core::Result<Problem> make_problem(const Recording& recording, std::string_view features,
                                   std::span<const float> play,
                                   std::span<const std::string> joints) {
  Problem problem;
  RAVENCAL_ASSIGN_OR_RETURN(problem.features, model::select_features(features, recording.channels));
  std::stable_partition(problem.features.begin(), problem.features.end(),
                        [](const auto& f) { return f.transform == model::Transform::kValue; });
  problem.plain =
      std::count_if(problem.features.begin(), problem.features.end(),
                    [](const auto& f) { return f.transform == model::Transform::kValue; });
  model::add_play(problem.features, play, recording.channels);
  RAVENCAL_ASSIGN_OR_RETURN(problem.outputs, learn::outputs_of(recording, joints));
  problem.channels = recording.channels;
  problem.row_period_s = model::row_period_s(recording);
  const bool dynamic = problem.row_period_s > 0.0 && problem.row_period_s <= kDynamicsPeriodS;
  problem.order = dynamic ? Order::kTime : Order::kSequence;
  return problem;
}

core::Result<Series> make_series(const Problem& problem, const Recording& recording) {
  Series series;
  series.source = recording.source;
  RAVENCAL_ASSIGN_OR_RETURN(
      const model::FeatureMatrix inputs,
      model::feature_matrix(problem.features, recording, problem.row_period_s));
  series.inputs = inputs.cast<double>();
  RAVENCAL_ASSIGN_OR_RETURN(series.errors, learn::joint_errors(problem.outputs, recording));
  series.estimate.resizeLike(series.errors);
  series.effort.resizeLike(series.errors);
  for (Eigen::Index k = 0; k < series.errors.cols(); ++k) {
    const model::OutputSpec& output = problem.outputs[static_cast<std::size_t>(k)];
    series.estimate.col(k) = recording.samples.col(*recording.column(output.estimate_channel));
    series.effort.col(k) = effort_of(recording, output.joint);
  }
  series.t_s.resize(recording.rows());
  for (Eigen::Index row = 0; row < recording.rows(); ++row) {
    const auto t_ns = recording.t_ns[static_cast<std::size_t>(row)] - recording.t_ns.front();
    series.t_s[row] = static_cast<double>(t_ns) * 1e-9;
  }
  series.fresh = episode_starts(recording);
  for (const record::Event& event : recording.events) {
    if (record::is_homing(event))
      series.homings_s.push_back(static_cast<double>(event.t_ns - recording.t_ns.front()) * 1e-9);
  }
  for (std::size_t c = 0; c < recording.channels.size(); ++c) {
    const record::Channel& channel = recording.channels[c];
    if (record::tells_truth(channel.role)) continue;
    // Whole robot messages have hundreds of channels; methods ask for positions, efforts and loads.
    if (channel.role == Role::kFeature && recording.channels.size() > 60) continue;
    series.channels[channel.name] = recording.samples.col(static_cast<Eigen::Index>(c));
    if (channel.role == Role::kJointEstimate)
      series.channels["position of " + channel.joint] =
          recording.samples.col(static_cast<Eigen::Index>(c));
  }
  return series;
}

Series slice(const Series& series, Eigen::Index from, Eigen::Index count) {
  Series part;
  part.source = series.source;
  part.inputs = series.inputs.middleRows(from, count);
  part.errors = series.errors.middleRows(from, count);
  part.estimate = series.estimate.middleRows(from, count);
  part.effort = series.effort.middleRows(from, count);
  part.t_s = series.t_s.segment(from, count);
  part.homings_s = series.homings_s;
  part.fresh.assign(series.fresh.begin() + from, series.fresh.begin() + from + count);
  if (!part.fresh.empty()) part.fresh.front() = 1;
  for (const auto& [name, values] : series.channels)
    part.channels[name] = values.segment(from, count);
  return part;
}

std::vector<Series> first_rows(std::span<const Series> all, Eigen::Index count) {
  std::vector<Series> result;
  for (const Series& series : all) {
    if (count <= 0) break;
    result.push_back(slice(series, 0, row_after(series, count)));
    count -= count_training_rows(std::span(&series, 1));
  }
  return result;
}

Eigen::Index row_after(const Series& series, Eigen::Index count) {
  if (count <= 0) return 0;
  for (Eigen::Index row = 0; row < series.rows(); ++row) {
    if (series.trains(row) && --count == 0) return row + 1;
  }
  return series.rows();
}

Eigen::Index count_training_rows(std::span<const Series> all) {
  Eigen::Index rows = 0;
  for (const Series& series : all) {
    for (Eigen::Index row = 0; row < series.rows(); ++row) rows += series.trains(row) ? 1 : 0;
  }
  return rows;
}

Eigen::Index count_rows(std::span<const Series> all) {
  Eigen::Index rows = 0;
  for (const Series& series : all) rows += series.rows();
  return rows;
}

Stack stack(std::span<const Series> all, Eigen::Index columns) {
  const Eigen::Index outputs = all.empty() ? 0 : all.front().errors.cols();
  Stack result{Eigen::MatrixXd(count_rows(all), columns),
               Eigen::MatrixXd(count_rows(all), outputs)};
  Eigen::Index kept = 0;
  for (const Series& series : all) {
    for (Eigen::Index row = 0; row < series.rows(); ++row) {
      if (!series.trains(row)) continue;
      result.inputs.row(kept) = series.inputs.row(row).head(columns);
      result.errors.row(kept++) = series.errors.row(row);
    }
  }
  result.inputs.conservativeResize(kept, Eigen::NoChange);
  result.errors.conservativeResize(kept, Eigen::NoChange);
  return result;
}

}  // namespace ravencal::methods
