// SPDX-License-Identifier: Apache-2.0
#include "conversion/keras_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>

#include "exchange/hdf5_handle.hpp"

namespace ravencal::conversion {
namespace {

using exchange::Hdf5Handle;
using nlohmann::json;

constexpr hsize_t kLargestDimension = 1 << 20;  // far above any network for a 1 kHz loop
constexpr hsize_t kMostWeights = 1 << 26;
constexpr hsize_t kMostNames = 1024;

/// One text or a list of them; none if the attribute is absent or no text.
std::vector<std::string> texts_of(hid_t object, const std::string& name) {
  if (H5Aexists(object, name.c_str()) <= 0) return {};
  const Hdf5Handle attribute(H5Aopen(object, name.c_str(), H5P_DEFAULT), H5Aclose);
  const Hdf5Handle type(H5Aget_type(attribute.get()), H5Tclose);
  const Hdf5Handle space(H5Aget_space(attribute.get()), H5Sclose);
  const hssize_t count = H5Sget_simple_extent_npoints(space.get());
  if (!type.ok() || H5Tget_class(type.get()) != H5T_STRING || count < 1 ||
      static_cast<hsize_t>(count) > kMostNames) {
    return {};
  }
  std::vector<std::string> texts;
  if (H5Tis_variable_str(type.get()) > 0) {
    std::vector<char*> values(static_cast<std::size_t>(count), nullptr);
    if (H5Aread(attribute.get(), type.get(), values.data()) < 0) return {};
    for (const char* value : values) texts.emplace_back(value == nullptr ? "" : value);
    (void)H5Dvlen_reclaim(type.get(), space.get(), H5P_DEFAULT, values.data());
    return texts;
  }
  const std::size_t size = H5Tget_size(type.get());
  std::vector<char> bytes(size * static_cast<std::size_t>(count));
  if (H5Aread(attribute.get(), type.get(), bytes.data()) < 0) return {};
  for (std::size_t at = 0; at < bytes.size(); at += size) {
    const std::string_view text(bytes.data() + at, size);
    texts.emplace_back(text.substr(0, text.find('\0')));
  }
  return texts;
}

/// A list that Keras splits into NAME0, NAME1, ... where it is long.
std::vector<std::string> names_of(hid_t group, const std::string& name) {
  if (H5Aexists(group, name.c_str()) > 0) return texts_of(group, name);
  std::vector<std::string> all;
  for (std::size_t part = 0; all.size() < kMostNames; ++part) {
    const auto names = texts_of(group, fmt::format("{}{}", name, part));
    if (names.empty()) break;
    all.insert(all.end(), names.begin(), names.end());
  }
  return all;
}

core::Result<Eigen::MatrixXd> tensor_of(hid_t group, const std::string& path) {
  const Hdf5Handle set(H5Dopen2(group, path.c_str(), H5P_DEFAULT), H5Dclose);
  if (!set.ok()) return core::data_error(fmt::format("weights '{}' are not in the file", path));
  const Hdf5Handle space(H5Dget_space(set.get()), H5Sclose);
  const int rank = H5Sget_simple_extent_ndims(space.get());
  hsize_t dims[2] = {1, 1};
  if (rank != 1 && rank != 2) {
    return core::data_error(
        fmt::format("weights '{}' have {} dimensions; 1 or 2 are read", path, rank));
  }
  (void)H5Sget_simple_extent_dims(space.get(), rank == 2 ? dims : dims + 1, nullptr);
  if (dims[0] < 1 || dims[1] < 1 || dims[0] > kLargestDimension || dims[1] > kLargestDimension ||
      dims[0] * dims[1] > kMostWeights) {
    return core::data_error(
        fmt::format("weights '{}' have the shape {} x {}", path, dims[0], dims[1]));
  }
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  RowMajor values(static_cast<Eigen::Index>(dims[0]), static_cast<Eigen::Index>(dims[1]));
  if (H5Dread(set.get(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0) {
    return core::data_error(fmt::format("weights '{}' cannot be read as numbers", path));
  }
  if (!values.allFinite()) {
    return core::data_error(fmt::format("weights '{}' have a value that is not finite", path));
  }
  return Eigen::MatrixXd(values);
}

/// "sequential/gru/gru_cell/recurrent_kernel:0" is "recurrent_kernel".
std::string role_of(const std::string& weight_name) {
  const std::string last = weight_name.substr(weight_name.rfind('/') + 1);
  return last.substr(0, last.find(':'));
}

core::Status read_weights(hid_t weights, KerasLayer& layer) {
  if (H5Lexists(weights, layer.name.c_str(), H5P_DEFAULT) <= 0) return {};  // a layer without any
  const Hdf5Handle group(H5Gopen2(weights, layer.name.c_str(), H5P_DEFAULT), H5Gclose);
  for (const std::string& name : names_of(group.get(), "weight_names")) {
    RAVENCAL_ASSIGN_OR_RETURN(layer.weights[role_of(name)], tensor_of(group.get(), name));
  }
  return {};
}

std::string text_at(const json& config, const char* key, const std::string& otherwise) {
  if (!config.contains(key)) return otherwise;
  if (config[key].is_null()) return "linear";
  return config[key].is_string() ? config[key].get<std::string>() : config[key].dump();
}

bool flag_at(const json& config, const char* key, bool otherwise) {
  return config.contains(key) && config[key].is_boolean() ? config[key].get<bool>() : otherwise;
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
    layer.units =
        std::min(config["units"].get<Eigen::Index>(), static_cast<Eigen::Index>(kLargestDimension));
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
    const bool follows = k == 0 ? sources.empty() : sources == std::set{layers[k - 1].name};
    if (!follows) {
      return core::data_error(
          fmt::format("layer '{}' ({}) does not take the one before it alone; a calibration "
                      "model is one chain of layers",
                      layers[k].name, layers[k].class_name));
    }
  }
  return {};
}

core::Result<KerasFile> read_opened(hid_t file) {
  const auto config_text = texts_of(file, "model_config");
  const Hdf5Handle weights(H5Gopen2(file, "model_weights", H5P_DEFAULT), H5Gclose);
  if (config_text.size() != 1 || !weights.ok()) {
    return core::data_error(
        "holds no whole Keras model (weights only?); save it by model.save(\"model.h5\")");
  }
  const json model = json::parse(config_text.front(), nullptr, false);
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
    RAVENCAL_RETURN_IF_ERROR(read_weights(weights.get(), layer));
    result.layers.push_back(std::move(layer));
  }
  if (kind != "Sequential") RAVENCAL_RETURN_IF_ERROR(check_chain(items, result.layers));
  auto version = texts_of(file, "keras_version");
  if (version.empty()) version = texts_of(weights.get(), "keras_version");
  result.version = version.empty() ? "of unknown version" : version.front();
  return result;
}

}  // namespace

core::Result<KerasFile> KerasFile::read(const std::string& path) {
  exchange::hdf5_quiet();
  if (!std::filesystem::is_regular_file(path)) {
    return core::Error{core::ErrorCode::kIo, fmt::format("{}: no such file", path)};
  }
  const Hdf5Handle file(H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose);
  if (!file.ok()) {
    return core::data_error(
        fmt::format("{}: is not an HDF5 file; save the model by model.save(\"model.h5\")", path));
  }
  auto result = read_opened(file.get());
  if (!result.ok()) return core::data_error(fmt::format("{}: {}", path, result.error().message));
  return result;
}

}  // namespace ravencal::conversion
