// SPDX-License-Identifier: Apache-2.0
#include "model/loop_text.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "core/catalogue.hpp"
#include "core/constants.hpp"

namespace ravencal::model {
namespace {

using Eigen::Index;

constexpr double kMillimetresPerMetre = 1e3;

/// Column of the channel with the largest gain times its scale in the training.
Index steepest(const CalibrationModel& model, Index output) {
  Index best = 0;
  double largest = -1.0;
  for (std::size_t c = 0; c < model.loop_gains->channels.size(); ++c) {
    for (std::size_t i = 0; i < model.features.size(); ++i) {
      if (model.features[i].channel != model.loop_gains->channels[c]) continue;
      const auto column = static_cast<Index>(c);
      const double effect =
          model.loop_gains->largest(output, column) * model.input.scale[static_cast<Index>(i)];
      if (effect > largest) {
        largest = effect;
        best = column;
      }
    }
  }
  return best;
}

std::string steepest_text(const CalibrationModel& model, Index output) {
  const LoopGains& gains = *model.loop_gains;
  if (gains.channels.empty()) return "";
  const Index column = steepest(model, output);
  const std::string& channel = gains.channels[static_cast<std::size_t>(column)];
  const auto index = core::catalogue_index_of(channel);
  return fmt::format("; steepest: {}, {:.3g} {} per {}", channel, gains.largest(output, column),
                     model.outputs[static_cast<std::size_t>(output)].unit,
                     index ? core::catalogue()[*index].si_unit : "unit");
}

}  // namespace

std::string loop_text(const CalibrationModel& model) {
  if (!model.loop_gains) return "loop gains: unknown; `convert --calibrate` computes them\n";
  const LoopGains& gains = *model.loop_gains;
  if (gains.rows == 0) return "loop gains: no input answers to the motor command\n";
  std::string text = fmt::format(
      "loop gains: largest change of the correction, over {} rows, per spread of an "
      "input that answers to the motor command\n",
      gains.rows);
  for (std::size_t j = 0; j < model.outputs.size(); ++j) {
    const auto row = static_cast<Index>(j);
    const bool is_angle = model.outputs[j].unit == "rad";
    const double shown = is_angle ? core::kDegPerRad : kMillimetresPerMetre;
    text += fmt::format("  {:<10}", model.outputs[j].joint);
    for (std::size_t group = 0; group < kLoopGroupCount; ++group) {
      text += fmt::format("{} {} {:.3g} {}", group == 0 ? "" : ",", kLoopGroupNames[group],
                          shown * gains.by_group(row, static_cast<Index>(group)),
                          is_angle ? "deg" : "mm");
    }
    text += steepest_text(model, row) + "\n";
  }
  return text;
}

std::string margins_text(const CalibrationModel& model) {
  if (!model.loop_gains || !model.loop_gains->margins) return "";
  const LoopMargins& margins = *model.loop_gains->margins;
  return fmt::format("loop with the servo: gain margin {:.3g}, phase margin {:.3g} deg\n",
                     margins.gain, margins.phase_rad * core::kDegPerRad);
}

nlohmann::ordered_json loop_json(const CalibrationModel& model) {
  if (!model.loop_gains) return nullptr;
  const LoopGains& gains = *model.loop_gains;
  nlohmann::ordered_json json = {{"rows", gains.rows}};
  for (std::size_t j = 0; j < model.outputs.size(); ++j) {
    auto& output = json["gains"][model.outputs[j].joint];
    const auto row = static_cast<Index>(j);
    for (std::size_t group = 0; group < kLoopGroupCount; ++group) {
      output["by_group"][kLoopGroupNames[group]] = gains.by_group(row, static_cast<Index>(group));
    }
    for (std::size_t c = 0; c < gains.channels.size(); ++c) {
      output["by_channel"][gains.channels[c]] = gains.largest(row, static_cast<Index>(c));
    }
  }
  json["gain_margin"] = nullptr;
  json["phase_margin_rad"] = nullptr;
  if (gains.margins) {
    if (std::isfinite(gains.margins->gain)) json["gain_margin"] = gains.margins->gain;
    json["phase_margin_rad"] = gains.margins->phase_rad;
  }
  return json;
}

}  // namespace ravencal::model
