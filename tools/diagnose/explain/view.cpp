// SPDX-License-Identifier: Apache-2.0
#include "diagnose/explain/view.hpp"

#include <cmath>
#include <utility>

namespace ravencal::diagnose {

using Eigen::Index;
using Eigen::VectorXd;

Left left_by(const State& state, const Likelihood& rows) {
  Left left{rows.residuals(state, rows.outcome(state)), {}};
  left.drawn_constant = take_drawn_constants(rows, left.residuals);
  return left;
}

void take_laws(const State& recorder, State& state) {
  state.laws = recorder.laws;
  for (LawCircumstances& law : state.laws) law.saturated = 1.0;
}

View view_of(const physics::Plant& given, const physics::Plant& improved, const Likelihood& rows,
             bool held_out, const State* recorder) {
  State state = rows.base();
  if (recorder != nullptr) take_laws(*recorder, state);
  Left before = left_by(state, rows);
  state.plant = improved;
  Left after = left_by(state, rows);
  View view{given,
            improved,
            rows,
            held_out,
            std::move(before.residuals),
            std::move(after.residuals),
            std::move(before.drawn_constant),
            {}};
  if (recorder != nullptr) {
    state.circumstances = recorder->circumstances;
    view.beside_recorder = left_by(state, rows).residuals;
  } else {
    view.beside_recorder = view.after;
  }
  return view;
}

std::size_t used_row_count(const Channel& channel) {
  std::size_t rows = 0;
  for (const auto& used : channel.used) rows += used.size();
  return rows;
}

VectorXd used_rows(const Channel& channel, const ByRecording& values) {
  VectorXd out(static_cast<Index>(used_row_count(channel)));
  Index at = 0;
  for (std::size_t r = 0; r < values.size(); ++r) {
    const auto size = static_cast<Index>(channel.used[r].size());
    out.segment(at, size) = values[r](channel.used[r]);
    at += size;
  }
  return out;
}

double rms(const Channel& channel, const ByRecording& values) {
  const VectorXd rows = used_rows(channel, values);
  return rows.size() > 0 ? std::sqrt(rows.squaredNorm() / static_cast<double>(rows.size())) : 0.0;
}

std::string stage_of(const Channel& channel) {
  switch (channel.kind) {
    case ChannelKind::kPosition:
      return channel.tracking ? "drive" : "transmission";  // it is the drive that lags
    case ChannelKind::kDrive:
      return "drive";
    case ChannelKind::kLaw:
      break;
  }
  return "command";
}

bool shown(const Likelihood& rows, std::size_t joint, std::string_view stage) {
  if (stage == "command") return rows.has(joint, ChannelKind::kLaw);
  const Channel* position = rows.find(joint, ChannelKind::kPosition);
  const bool followed = position != nullptr && position->followed;
  if (stage == "drive") return followed || rows.has(joint, ChannelKind::kDrive);
  return position != nullptr && !followed;
}

std::string position_unit_of(const physics::Joint& joint) {
  return joint.kind == physics::JointKind::kPrismatic ? "m" : "rad";
}

std::string effort_unit_of(const physics::Joint& joint) {
  return joint.kind == physics::JointKind::kPrismatic ? "N" : "N_m";
}

std::string unit_of(const Channel& channel, const physics::Plant& plant) {
  const physics::Joint& joint = plant.joints[channel.joint];
  return channel.kind == ChannelKind::kPosition ? position_unit_of(joint) : effort_unit_of(joint);
}

}  // namespace ravencal::diagnose
