// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>

#include "core/catalogue.hpp"
#include "core/json_text.hpp"
#include "core/whole_file.hpp"
#include "model/blob_view.hpp"
#include "model/blob_writer.hpp"
#include "model/loop_text.hpp"
#include "model/origin_json.hpp"

namespace ravencal::model {
namespace {

core::Result<std::vector<std::byte>> read_bytes(const std::filesystem::path& path) {
  RAVENCAL_ASSIGN_OR_RETURN(const std::string text, core::read_whole_file(path));
  const auto* const bytes = reinterpret_cast<const std::byte*>(text.data());
  return std::vector<std::byte>(bytes, bytes + text.size());
}

core::Result<BlobView> open_view(std::span<const std::byte> bytes, std::string_view source) {
  BlobView view;
  const BlobCheck check = BlobView::open(bytes, view);
  if (!check.ok()) {
    return core::data_error(
        fmt::format("{}: {} (byte {})", source, describe(check.status), check.offset));
  }
  return view;
}

core::Status read_features(const BlobView& view, std::string_view source, CalibrationModel& model) {
  for (std::size_t i = 0; i < view.feature_count(); ++i) {
    const BlobFeature feature = view.feature(i);
    const std::string_view along =
        is_travel_mean(feature.transform) ? view.feature(feature.along).channel : "";
    model.features.push_back({std::string(feature.channel), feature.transform, feature.lag_rows,
                              feature.play_half_width, feature.time_constant_s, feature.travel_si,
                              std::string(along)});
    // The plugin goes by the number, people by the name: they must agree.
    const auto index = core::catalogue_index_of(feature.channel);
    const std::size_t expected = index ? *index : blob::kNoCatalogueIndex;
    if (feature.catalogue_index != expected) {
      return core::data_error(
          fmt::format("{}: input {} is called '{}' but has catalogue index {}, not {}", source, i,
                      feature.channel, feature.catalogue_index, expected));
    }
  }
  return {};
}

std::optional<TrustRegion> read_trust(const BlobView& view) {
  if (view.trust_rank() == 0) return std::nullopt;
  const auto rank = static_cast<Eigen::Index>(view.trust_rank());
  const auto inputs = static_cast<Eigen::Index>(view.feature_count());
  TrustRegion trust;
  trust.inverse_variance = Eigen::VectorXf::NullaryExpr(rank, [&](Eigen::Index k) {
    return view.trust_inverse_variance(static_cast<std::size_t>(k));
  });
  trust.directions =
      Eigen::MatrixXf::NullaryExpr(rank, inputs, [&](Eigen::Index k, Eigen::Index i) {
        return view.trust_direction(static_cast<std::size_t>(k), static_cast<std::size_t>(i));
      });
  trust.inverse_residual_variance = view.trust_inverse_residual_variance();
  trust.full_distance = view.trust_full_distance();
  trust.none_distance = view.trust_none_distance();
  return trust;
}

std::optional<LoopGains> read_loop_gains(const BlobView& view) {
  const BlobLoop loop = view.loop();
  if (!loop.gains_known) return std::nullopt;
  LoopGains gains;
  gains.rows = loop.rows;
  gains.by_group.resize(static_cast<Eigen::Index>(view.output_count()), kLoopGroupCount);
  for (std::size_t j = 0; j < view.output_count(); ++j) {
    for (std::size_t group = 0; group < kLoopGroupCount; ++group) {
      gains.by_group(static_cast<Eigen::Index>(j), static_cast<Eigen::Index>(group)) =
          static_cast<double>(view.loop_gain(static_cast<LoopGroup>(group), j));
    }
  }
  if (loop.margins_known) {
    const bool endless = loop.gain_margin >= blob::kMaxGainMargin;
    gains.margins = {
        endless ? std::numeric_limits<double>::infinity() : static_cast<double>(loop.gain_margin),
        static_cast<double>(loop.phase_margin_rad)};
  }
  return gains;
}

template <typename Read>
Eigen::VectorXd read_vector(std::size_t count, Read read) {
  Eigen::VectorXd values(static_cast<Eigen::Index>(count));
  for (std::size_t i = 0; i < count; ++i) values[static_cast<Eigen::Index>(i)] = read(i);
  return values;
}

std::string_view name_of(Activation activation) {
  switch (activation) {
    case Activation::kLinear:
      return "linear";
    case Activation::kSigmoid:
      return "sigmoid";
    case Activation::kTanh:
      return "tanh";
    case Activation::kRelu:
      return "relu";
  }
  return "unknown";
}

nlohmann::ordered_json summary(const CalibrationModel& model, const BlobView& view) {
  nlohmann::ordered_json json;
  std::size_t parameters = 0;
  json["kind"] = "weights";
  json["bytes"] = view.file_bytes();
  json["precision"] = model::name_of(view.precision());
  json["bytes_per_step"] = view.bytes_per_step();
  json["row_period_s"] = model.row_period_s;
  json["signature"] = view.is_signed() ? "ed25519" : "none";
  json["origin"] = origin_json(model.origin);
  json["loop"] = loop_json(model);
  json["trust"] = nullptr;
  if (model.trust) {
    json["trust"] = {{"directions", model.trust->directions.rows()},
                     {"full_distance", model.trust->full_distance},
                     {"none_distance", model.trust->none_distance}};
  }
  for (std::size_t i = 0; i < model.features.size(); ++i) {
    const auto e = static_cast<Eigen::Index>(i);
    json["inputs"].push_back({{"feature", model.features[i].text()},
                              {"min", model.input_min[e]},
                              {"max", model.input_max[e]},
                              {"mean", model.input.mean[e]},
                              {"scale", model.input.scale[e]}});
  }
  for (const DenseLayer& layer : model.layers) {
    if (layer.kind == packed::LayerKind::kDense) {
      json["layers"].push_back({{"inputs", layer.weights.cols()},
                                {"outputs", layer.weights.rows()},
                                {"activation", name_of(layer.activation)}});
    } else if (layer.kind == packed::LayerKind::kGruRecurrent) {
      json["layers"].push_back({{"inputs", model.layers.front().weights.cols()},
                                {"outputs", layer.weights.cols()},
                                {"activation", "gru"},
                                {"window", layer.window},
                                {"stride_rows", layer.stride_rows}});
    }
    parameters += static_cast<std::size_t>(layer.weights.size() + layer.biases.size());
  }
  json["parameters"] = parameters;
  for (std::size_t j = 0; j < model.outputs.size(); ++j) {
    const auto e = static_cast<Eigen::Index>(j);
    json["outputs"].push_back({{"joint", model.outputs[j].joint},
                               {"added_to", model.outputs[j].estimate_channel},
                               {"unit", model.outputs[j].unit},
                               {"mean", model.output.mean[e]},
                               {"scale", model.output.scale[e]}});
  }
  json["provenance"] = model.provenance;
  return json;
}

core::Result<nlohmann::ordered_json> summary_of(const std::filesystem::path& path) {
  RAVENCAL_ASSIGN_OR_RETURN(const std::vector<std::byte> bytes, read_bytes(path));
  RAVENCAL_ASSIGN_OR_RETURN(const CalibrationModel model, decode_blob(bytes, path.string()));
  RAVENCAL_ASSIGN_OR_RETURN(const BlobView view, open_view(bytes, path.string()));
  return summary(model, view);
}

}  // namespace

core::Result<CalibrationModel> decode_blob(std::span<const std::byte> bytes,
                                           std::string_view source) {
  RAVENCAL_ASSIGN_OR_RETURN(const BlobView view, open_view(bytes, source));
  CalibrationModel model;
  model.row_period_s = view.row_period_s();
  model.origin = {view.arm(), view.coordinates(), std::string(view.robot()),
                  std::string(view.controller())};
  model.loop_gains = read_loop_gains(view);
  RAVENCAL_RETURN_IF_ERROR(read_features(view, source, model));
  const std::size_t n = view.feature_count();
  const std::size_t m = view.output_count();
  model.input.mean = read_vector(n, [&](std::size_t i) { return view.input_mean(i); });
  model.input.scale = read_vector(n, [&](std::size_t i) { return view.input_scale(i); });
  model.input_min = read_vector(n, [&](std::size_t i) { return view.input_min(i); });
  model.input_max = read_vector(n, [&](std::size_t i) { return view.input_max(i); });
  model.trust = read_trust(view);
  RAVENCAL_ASSIGN_OR_RETURN(model.layers, unpack_layers(view.network_bytes()));
  model.output.mean = read_vector(m, [&](std::size_t j) { return view.output_mean(j); });
  model.output.scale = read_vector(m, [&](std::size_t j) { return view.output_scale(j); });
  for (std::size_t j = 0; j < m; ++j) {
    const BlobOutput output = view.output(j);
    model.outputs.push_back({std::string(output.joint), std::string(output.estimate_channel),
                             std::string(output.unit)});
  }
  const auto json = core::parse_json(view.provenance());
  if (!json.ok() || !json->is_object())
    return core::data_error(fmt::format("{}: the provenance is not a JSON object", source));
  for (const auto& [key, value] : json->items()) {
    model.provenance[key] = value.is_string() ? value.get<std::string>() : value.dump();
  }
  return model;
}

core::Result<CalibrationModel> read_blob(const std::filesystem::path& path) {
  RAVENCAL_ASSIGN_OR_RETURN(const std::vector<std::byte> bytes, read_bytes(path));
  return decode_blob(bytes, path.string());
}

core::Result<std::string> describe_blob_json(const std::filesystem::path& path) {
  RAVENCAL_ASSIGN_OR_RETURN(const nlohmann::ordered_json json, summary_of(path));
  return json.dump(2) + "\n";
}

core::Result<std::string> describe_blob(const std::filesystem::path& path) {
  RAVENCAL_ASSIGN_OR_RETURN(const nlohmann::ordered_json json, summary_of(path));
  std::string text =
      fmt::format("{}: weights, {} bytes, {}, {} parameters, {} bytes per step\n", path.string(),
                  json["bytes"].get<std::size_t>(), json["precision"].get<std::string>(),
                  json["parameters"].get<std::size_t>(), json["bytes_per_step"].get<std::size_t>());
  text += fmt::format("network      {}", json["inputs"].size());
  for (const auto& layer : json["layers"]) {
    text += fmt::format(" -> {} {}", layer["outputs"].get<std::size_t>(),
                        layer["activation"].get<std::string>());
    if (layer.contains("window")) {
      text += fmt::format(" (over {} samples, {} rows apart)", layer["window"].get<int>(),
                          layer["stride_rows"].get<int>());
    }
  }
  text += fmt::format("\nrow period   {} s\n", json["row_period_s"].get<double>());
  text += fmt::format("signature    {}\n", json["signature"] == "none"
                                               ? "none"
                                               : "Ed25519 (`ravencal sign verify` checks it)");
  RAVENCAL_ASSIGN_OR_RETURN(const CalibrationModel model, read_blob(path));
  text += fmt::format("origin       {}\n", describe(model.origin));
  text += loop_text(model) + margins_text(model);
  const auto& trust = json["trust"];
  text += trust.is_null()
              ? std::string("trust        none: the confidence is always 1; train the model anew\n")
              : fmt::format(
                    "trust        {} directions; confidence 1 up to a distance of {:.4g}, 0 "
                    "from {:.4g}\n",
                    trust["directions"].get<std::size_t>(), trust["full_distance"].get<double>(),
                    trust["none_distance"].get<double>());
  for (const auto& output : json["outputs"]) {
    text += fmt::format("corrects     {} [{}], mean correction {:.6g}\n",
                        output["added_to"].get<std::string>(), output["unit"].get<std::string>(),
                        output["mean"].get<double>());
  }
  for (const auto& input : json["inputs"]) {
    text += fmt::format("input        {:<28} trained from {:.6g} to {:.6g}\n",
                        input["feature"].get<std::string>(), input["min"].get<double>(),
                        input["max"].get<double>());
  }
  for (const auto& [key, value] : json["provenance"].items()) {
    text += fmt::format("provenance   {}: {}\n", key, value.get<std::string>());
  }
  return text;
}

}  // namespace ravencal::model
