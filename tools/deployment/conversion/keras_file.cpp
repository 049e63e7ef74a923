// SPDX-License-Identifier: Apache-2.0
#include "conversion/keras_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>

#include "conversion/keras_content.hpp"
#include "core/json_text.hpp"

namespace ravencal::conversion {
namespace {

using nlohmann::json;

constexpr Eigen::Index kMostUnits = 1 << 20;  // far above any network for a 1 kHz loop

/// "sequential/gru/gru_cell/recurrent_kernel:0" is "recurrent_kernel".
std::string role_of(const std::string& weight_name) {
  const std::string last = weight_name.substr(weight_name.rfind('/') + 1);
  return last.substr(0, last.find(':'));
}

std::string text_at(const json& config, const char* key, const std::string& otherwise) {
  if (!config.contains(key)) return otherwise;
  if (config[key].is_null()) return "linear";
  return config[key].is_string() ? config[key].get<std::string>() : config[key].dump();
}

bool flag_at(const json& config, const char* key, bool otherwise) {
  return config.contains(key) && config[key].is_boolean() ? config[key].get<bool>() : otherwise;
}

/// A number, a truth value or a list of them; nothing otherwise.
std::vector<double> numbers_of(const json& value) {
  if (value.is_boolean()) return {value.get<bool>() ? 1.0 : 0.0};
  if (value.is_number()) return {value.get<double>()};
  std::vector<double> all;
  if (!value.is_array()) return all;
  for (const json& item : value) {
    const std::vector<double> inner = numbers_of(item);
    all.insert(all.end(), inner.begin(), inner.end());
  }
  return all;
}

core::Result<KerasLayer> layer_of(const json& item) {
  if (!item.is_object() || !item.value("class_name", json()).is_string() ||
      !item.value("config", json()).is_object()) {
    return core::data_error("its model_config has a layer without class_name or config");
  }
  const json& config = item["config"];
  KerasLayer layer;
  layer.class_name = item["class_name"].get<std::string>();
  layer.name = text_at(config, "name", text_at(item, "name", ""));
  layer.activation = text_at(config, "activation", "linear");
  layer.recurrent_activation = text_at(config, "recurrent_activation", "");
  layer.use_bias = flag_at(config, "use_bias", true);
  layer.reset_after = flag_at(config, "reset_after", false);
  layer.return_sequences = flag_at(config, "return_sequences", false);
  layer.go_backwards = flag_at(config, "go_backwards", false);
  layer.stateful = flag_at(config, "stateful", false);
  if (config.contains("units") && config["units"].is_number_unsigned()) {
    layer.units = std::min(config["units"].get<Eigen::Index>(), kMostUnits);
  }
  for (const auto& [key, value] : config.items()) {
    std::vector<double> numbers = numbers_of(value);
    if (!numbers.empty()) layer.numbers[key] = std::move(numbers);
  }
  for (const char* key : {"batch_input_shape", "batch_shape"}) {  // Keras 2, Keras 3
    if (!config.contains(key) || !config[key].is_array() || config[key].empty()) continue;
    for (std::size_t i = 1; i < config[key].size(); ++i) {
      const json& size = config[key][i];
      layer.input_shape.push_back(size.is_number_unsigned() ? size.get<Eigen::Index>() : 0);
    }
  }
  return layer;
}

/// Every text below `value` that is the name of a layer.
void find_names(const json& value, const std::set<std::string>& names,
                std::set<std::string>& found) {
  if (value.is_string() && names.contains(value.get<std::string>())) {
    found.insert(value.get<std::string>());
  }
  if (!value.is_structured()) return;
  for (const auto& item : value) find_names(item, names, found);
}

/// A functional model must be a chain, too: each layer takes the one before it.
core::Status check_chain(const json& items, const std::vector<KerasLayer>& layers) {
  std::set<std::string> names;
  for (const KerasLayer& layer : layers) names.insert(layer.name);
  for (std::size_t k = 0; k < layers.size(); ++k) {
    std::set<std::string> sources;
    find_names(items[k].value("inbound_nodes", json::array()), names, sources);
    const bool tracking = k == 0 ? sources.empty() : sources == std::set{layers[k - 1].name};
    if (!tracking) {
      return core::data_error(
          fmt::format("layer '{}' ({}) does not take the one before it alone; a calibration "
                      "model is one chain of layers",
                      layers[k].name, layers[k].class_name));
    }
  }
  return {};
}

core::Result<KerasFile> interpreted(KerasContent content) {
  RAVENCAL_ASSIGN_OR_RETURN(const json model, core::parse_json(content.model_config));
  const std::string kind = model.is_object() ? text_at(model, "class_name", "") : "";
  if (kind != "Sequential" && kind != "Functional" && kind != "Model") {
    return core::data_error(
        fmt::format("its model_config is of kind '{}'; Sequential and Functional are read", kind));
  }
  const json config = model.value("config", json());
  const json items = config.is_array()    ? config
                     : config.is_object() ? config.value("layers", json())
                                          : json();
  KerasFile result;
  for (const json& item : items) {
    RAVENCAL_ASSIGN_OR_RETURN(KerasLayer layer, layer_of(item));
    for (auto& [name, values] : content.weights[layer.name]) {
      layer.weights[role_of(name)] = values;
    }
    for (auto& [name, why] : content.unreadable[layer.name]) layer.unreadable[role_of(name)] = why;
    result.layers.push_back(std::move(layer));
  }
  if (kind != "Sequential") RAVENCAL_RETURN_IF_ERROR(check_chain(items, result.layers));
  result.version = content.version;
  return result;
}

}  // namespace

double KerasLayer::number_or(const std::string& key, double otherwise) const {
  const auto it = numbers.find(key);
  return it == numbers.end() || it->second.size() != 1 ? otherwise : it->second.front();
}

core::Result<KerasFile> KerasFile::read(const std::string& path) {
  RAVENCAL_ASSIGN_OR_RETURN(KerasContent content, KerasContent::read(path));
  auto result = interpreted(std::move(content));
  if (!result.ok()) return core::data_error(fmt::format("{}: {}", path, result.error().message));
  return result;
}

}  // namespace ravencal::conversion
