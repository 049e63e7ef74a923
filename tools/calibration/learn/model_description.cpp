// SPDX-License-Identifier: Apache-2.0
#include "learn/model_description.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <nlohmann/json.hpp>
#include <vector>

#include "learn/training_json.hpp"
#include "model/loop_text.hpp"
#include "model/origin_json.hpp"

namespace ravencal::learn {
namespace {

/// Inputs, then the outputs of each layer.
std::vector<Eigen::Index> widths_of(const model::CalibrationModel& model) {
  std::vector<Eigen::Index> widths = {static_cast<Eigen::Index>(model.features.size())};
  for (const model::DenseLayer& layer : model.layers) widths.push_back(layer.weights.rows());
  return widths;
}

}  // namespace

std::string describe_in_words(const model::CalibrationModel& model) {
  std::string text =
      fmt::format("Calibration model, network {}\n", fmt::join(widths_of(model), "-"));
  text += fmt::format("rows every {:g} s\n", model.row_period_s);
  for (std::size_t k = 0; k < model.outputs.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    const model::OutputSpec& output = model.outputs[k];
    text += fmt::format("corrects {} (added to {}): mean error {:.6g} {}, spread {:.6g} {}\n",
                        output.joint, output.estimate_channel, model.output.mean(i), output.unit,
                        model.output.scale(i), output.unit);
  }
  text += model.trust ? fmt::format(
                            "trust: {} directions; confidence 1 up to a distance of {:.4g}, 0 "
                            "from {:.4g}\n",
                            model.trust->directions.rows(), model.trust->full_distance,
                            model.trust->none_distance)
                      : "trust: none, the confidence is always 1; train the model anew\n";
  text += fmt::format("origin: {}\n", describe(model.origin));
  text += loop_text(model);
  for (const model::RandomSeeds& seeds : model.seeds) {
    text += fmt::format("simulated: {}, run seed {}, homing seed {}\n", seeds.recording, seeds.run,
                        seeds.homing);
  }
  for (const auto& [key, value] : model.provenance) text += fmt::format("{}: {}\n", key, value);
  text += "features (trained range, SI units):\n";
  for (std::size_t k = 0; k < model.features.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    text += fmt::format("  {}  {:.6g} ... {:.6g}\n", model.features[k].text(), model.input_min(i),
                        model.input_max(i));
  }
  return text;
}

std::string describe_in_json(const model::CalibrationModel& model) {
  nlohmann::ordered_json json;
  json["layers"] = widths_of(model);
  json["row_period_s"] = model.row_period_s;
  for (std::size_t k = 0; k < model.outputs.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    const model::OutputSpec& output = model.outputs[k];
    json["outputs"].push_back({{"joint", output.joint},
                               {"estimate_channel", output.estimate_channel},
                               {"unit", output.unit},
                               {"mean_error", model.output.mean(i)},
                               {"spread", model.output.scale(i)}});
  }
  for (std::size_t k = 0; k < model.features.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    json["features"].push_back({{"feature", model.features[k].text()},
                                {"trained_min", model.input_min(i)},
                                {"trained_max", model.input_max(i)}});
  }
  json["trust"] = nullptr;
  if (model.trust) {
    json["trust"] = {{"directions", model.trust->directions.rows()},
                     {"full_distance", model.trust->full_distance},
                     {"none_distance", model.trust->none_distance}};
  }
  json["origin"] = model::origin_json(model.origin);
  json["loop"] = loop_json(model);
  json["seeds"] = seeds_json(model.seeds);
  json["provenance"] = model.provenance;
  return json.dump(2);
}

}  // namespace ravencal::learn
