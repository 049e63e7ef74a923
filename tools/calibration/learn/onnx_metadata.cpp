// SPDX-License-Identifier: Apache-2.0
#include "learn/onnx_metadata.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "core/json_text.hpp"
#include "learn/training_json.hpp"
#include "model/blob_format.hpp"
#include "model/origin_json.hpp"

namespace ravencal::learn {
namespace {

using nlohmann::json;

constexpr int kFormatVersion = 1;

std::string numbers_text(const Eigen::VectorXd& values) {
  return json(std::vector<double>(values.data(), values.data() + values.size())).dump();
}

class Reader {
 public:
  explicit Reader(const Metadata& metadata) : metadata_(metadata) {}

  core::Result<json> value(const std::string& key) const {
    const auto it = metadata_.find(key);
    if (it == metadata_.end()) {
      return core::data_error(
          fmt::format("metadata lacks '{}': not a model of ravencal, or one that another "
                      "tool has rewritten",
                      key));
    }
    auto parsed = core::parse_json(it->second);
    if (!parsed.ok())
      return core::data_error(fmt::format("metadata '{}' {}", key, parsed.error().message));
    return parsed;
  }

  /// An array of `size` finite numbers.
  core::Result<Eigen::VectorXd> numbers(const std::string& key, std::size_t size) const {
    RAVENCAL_ASSIGN_OR_RETURN(const json array, value(key));
    if (!array.is_array() || array.size() != size) {
      return core::data_error(fmt::format("metadata '{}' is not a list of {} numbers", key, size));
    }
    Eigen::VectorXd values(static_cast<Eigen::Index>(size));
    for (std::size_t i = 0; i < size; ++i) {
      if (!array[i].is_number() || !std::isfinite(array[i].get<double>())) {
        return core::data_error(
            fmt::format("metadata '{}': element {} is not a finite number", key, i));
      }
      values(static_cast<Eigen::Index>(i)) = array[i].get<double>();
    }
    return values;
  }

  core::Result<model::Standardiser> standardiser(const std::string& prefix,
                                                 std::size_t size) const {
    model::Standardiser result;
    RAVENCAL_ASSIGN_OR_RETURN(result.mean, numbers(prefix + "_mean", size));
    RAVENCAL_ASSIGN_OR_RETURN(result.scale, numbers(prefix + "_scale", size));
    if (!(result.scale.minCoeff() > 0.0)) {
      return core::data_error(
          fmt::format("metadata '{}_scale' has a value that is not above 0", prefix));
    }
    return result;
  }

 private:
  const Metadata& metadata_;
};

core::Result<std::vector<model::FeatureSpec>> features_from(const json& array) {
  if (!array.is_array() || array.empty())
    return core::data_error("metadata 'ravencal.features' is no list");
  std::vector<model::FeatureSpec> features;
  for (const json& text : array) {
    if (!text.is_string())
      return core::data_error("metadata 'ravencal.features' has an element that is no text");
    auto feature = model::FeatureSpec::parse(text.get<std::string>());
    if (!feature.ok()) return core::data_error("metadata: " + feature.error().message);
    features.push_back(*feature);
  }
  return features;
}

core::Result<std::vector<model::OutputSpec>> outputs_from(const json& array) {
  if (!array.is_array() || array.empty())
    return core::data_error("metadata 'ravencal.outputs' is no list");
  std::vector<model::OutputSpec> outputs;
  for (const json& item : array) {
    model::OutputSpec output;
    const std::pair<const char*, std::string*> fields[] = {
        {"joint", &output.joint}, {"estimate", &output.estimate_channel}, {"unit", &output.unit}};
    for (const auto& [key, text] : fields) {
      if (!item.is_object() || !item.contains(key) || !item[key].is_string()) {
        return core::data_error(
            fmt::format("metadata 'ravencal.outputs': an output lacks '{}'", key));
      }
      *text = item[key].get<std::string>();
    }
    outputs.push_back(std::move(output));
  }
  return outputs;
}

json numbers_of(const Eigen::Ref<const Eigen::VectorXf>& values) {
  return std::vector<float>(values.begin(), values.end());
}

std::string trust_text(const model::TrustRegion& trust) {
  json directions = json::array();
  for (Eigen::Index k = 0; k < trust.directions.rows(); ++k) {
    directions.push_back(numbers_of(trust.directions.row(k).transpose()));
  }
  return json({{"directions", directions},
               {"inverse_variance", numbers_of(trust.inverse_variance)},
               {"inverse_residual_variance", trust.inverse_residual_variance},
               {"full_distance", trust.full_distance},
               {"none_distance", trust.none_distance}})
      .dump();
}

/// `size` finite numbers, or nothing.
std::optional<Eigen::VectorXf> floats_from(const json& array, std::size_t size) {
  if (!array.is_array() || array.size() != size) return std::nullopt;
  Eigen::VectorXf values(static_cast<Eigen::Index>(size));
  for (std::size_t i = 0; i < size; ++i) {
    if (!array[i].is_number() || !std::isfinite(array[i].get<float>())) return std::nullopt;
    values(static_cast<Eigen::Index>(i)) = array[i].get<float>();
  }
  return values;
}

/// Shapes and finiteness; the rest is checked where a blob is made of it.
core::Result<model::TrustRegion> trust_from(const json& object, std::size_t inputs) {
  const auto wrong = [] {
    return core::data_error("metadata 'ravencal.input_trust' is not a trust region");
  };
  for (const char* key : {"directions", "inverse_variance", "inverse_residual_variance",
                          "full_distance", "none_distance"}) {
    if (!object.is_object() || !object.contains(key)) return wrong();
  }
  const json& rows = object["directions"];
  if (!rows.is_array() || rows.empty() || rows.size() > model::blob::kMaxTrustRank) return wrong();
  model::TrustRegion trust;
  trust.directions.resize(static_cast<Eigen::Index>(rows.size()),
                          static_cast<Eigen::Index>(inputs));
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const auto row = floats_from(rows[k], inputs);
    if (!row) return wrong();
    trust.directions.row(static_cast<Eigen::Index>(k)) = row->transpose();
  }
  const auto inverse = floats_from(object["inverse_variance"], rows.size());
  const auto numbers = floats_from(
      {object["inverse_residual_variance"], object["full_distance"], object["none_distance"]}, 3);
  if (!inverse || !numbers) return wrong();
  trust.inverse_variance = *inverse;
  trust.inverse_residual_variance = (*numbers)[0];
  trust.full_distance = (*numbers)[1];
  trust.none_distance = (*numbers)[2];
  return trust;
}

std::string gains_text(const model::LoopGains& gains) {
  json object = {{"rows", gains.rows}, {"channels", gains.channels}};
  for (const auto& [key, matrix] :
       {std::pair{"largest", &gains.largest}, std::pair{"by_group", &gains.by_group}}) {
    object[key] = json::array();
    for (const auto& row : matrix->rowwise()) {
      object[key].push_back(std::vector<double>(row.begin(), row.end()));
    }
  }
  return object.dump();
}

/// [rows x columns] finite numbers, none below 0; or nothing.
std::optional<Eigen::MatrixXd> gains_matrix(const json& lists, std::size_t rows,
                                            std::size_t columns) {
  if (!lists.is_array() || lists.size() != rows) return std::nullopt;
  Eigen::MatrixXd matrix(static_cast<Eigen::Index>(rows), static_cast<Eigen::Index>(columns));
  for (std::size_t j = 0; j < rows; ++j) {
    if (!lists[j].is_array() || lists[j].size() != columns) return std::nullopt;
    for (std::size_t i = 0; i < columns; ++i) {
      const json& number = lists[j][i];
      if (!number.is_number() || !(number.get<double>() >= 0.0)) return std::nullopt;
      matrix(static_cast<Eigen::Index>(j), static_cast<Eigen::Index>(i)) = number.get<double>();
    }
  }
  return matrix;
}

core::Result<model::LoopGains> gains_from(const json& object, std::size_t outputs) {
  const auto wrong = [] {
    return core::data_error("metadata 'ravencal.gains' holds no loop gains");
  };
  for (const char* key : {"rows", "channels", "largest", "by_group"}) {
    if (!object.is_object() || !object.contains(key)) return wrong();
  }
  if (!object["rows"].is_number_unsigned() || !object["channels"].is_array()) return wrong();
  model::LoopGains gains;
  gains.rows = object["rows"].get<std::uint32_t>();
  for (const json& channel : object["channels"]) {
    if (!channel.is_string()) return wrong();
    gains.channels.push_back(channel.get<std::string>());
  }
  const auto largest = gains_matrix(object["largest"], outputs, gains.channels.size());
  const auto by_group = gains_matrix(object["by_group"], outputs, model::kLoopGroupCount);
  if (!largest || !by_group) return wrong();
  gains.largest = *largest;
  gains.by_group = *by_group;
  return gains;
}

core::Result<model::Origin> origin_from(const json& object) {
  const auto text = [&](const char* key) {
    return object.is_object() && object.contains(key) && object[key].is_string()
               ? std::optional(object[key].get<std::string>())
               : std::nullopt;
  };
  const auto robot = text("robot");
  const auto controller = text("controller");
  const auto arm = model::arm_from(text("arm").value_or(""));
  const auto coordinates = model::coordinates_from(text("coordinates").value_or(""));
  if (!robot || !controller || !arm || !coordinates) {
    return core::data_error(
        "metadata 'ravencal.origin' is not an arm, a robot, a controller and coordinates");
  }
  return model::Origin{*arm, *coordinates, *robot, *controller};
}

}  // namespace

Metadata metadata_of(const model::CalibrationModel& model) {
  json features = json::array();
  for (const model::FeatureSpec& feature : model.features) features.push_back(feature.text());
  json outputs = json::array();
  for (const model::OutputSpec& output : model.outputs) {
    outputs.push_back(
        {{"joint", output.joint}, {"estimate", output.estimate_channel}, {"unit", output.unit}});
  }
  Metadata metadata = {{"ravencal.format", json(kFormatVersion).dump()},
                       {"ravencal.features", features.dump()},
                       {"ravencal.outputs", outputs.dump()},
                       {"ravencal.input_mean", numbers_text(model.input.mean)},
                       {"ravencal.input_scale", numbers_text(model.input.scale)},
                       {"ravencal.input_min", numbers_text(model.input_min)},
                       {"ravencal.input_max", numbers_text(model.input_max)},
                       {"ravencal.output_mean", numbers_text(model.output.mean)},
                       {"ravencal.output_scale", numbers_text(model.output.scale)},
                       {"ravencal.row_period_s", json(model.row_period_s).dump()},
                       {"ravencal.origin", json(model::origin_json(model.origin)).dump()},
                       {"ravencal.provenance", json(model.provenance).dump()}};
  if (model.trust) metadata["ravencal.input_trust"] = trust_text(*model.trust);
  if (model.loop_gains) metadata["ravencal.gains"] = gains_text(*model.loop_gains);
  if (!model.expected.empty()) metadata["ravencal.expected"] = expected_text(model.expected);
  if (model.motion) metadata["ravencal.motion"] = motion_text(*model.motion);
  if (!model.seeds.empty()) metadata["ravencal.random_seeds"] = seeds_json(model.seeds).dump();
  return metadata;
}

core::Result<model::CalibrationModel> model_from_metadata(const Metadata& metadata) {
  const Reader reader(metadata);
  model::CalibrationModel model;
  RAVENCAL_ASSIGN_OR_RETURN(const json format, reader.value("ravencal.format"));
  if (format != kFormatVersion) {
    return core::data_error(
        fmt::format("metadata format {} is unknown; this program reads format {}", format.dump(),
                    kFormatVersion));
  }
  RAVENCAL_ASSIGN_OR_RETURN(const json features, reader.value("ravencal.features"));
  RAVENCAL_ASSIGN_OR_RETURN(model.features, features_from(features));
  RAVENCAL_ASSIGN_OR_RETURN(const json outputs, reader.value("ravencal.outputs"));
  RAVENCAL_ASSIGN_OR_RETURN(model.outputs, outputs_from(outputs));
  const std::size_t n = model.features.size();
  RAVENCAL_ASSIGN_OR_RETURN(model.input, reader.standardiser("ravencal.input", n));
  RAVENCAL_ASSIGN_OR_RETURN(model.input_min, reader.numbers("ravencal.input_min", n));
  RAVENCAL_ASSIGN_OR_RETURN(model.input_max, reader.numbers("ravencal.input_max", n));
  // Models of ravencal 0.1 have none.
  if (metadata.contains("ravencal.input_trust")) {
    RAVENCAL_ASSIGN_OR_RETURN(const json trust, reader.value("ravencal.input_trust"));
    RAVENCAL_ASSIGN_OR_RETURN(model.trust, trust_from(trust, n));
  }
  // Not every model has these: unknown.
  if (metadata.contains("ravencal.motion")) {
    RAVENCAL_ASSIGN_OR_RETURN(const json motion, reader.value("ravencal.motion"));
    RAVENCAL_ASSIGN_OR_RETURN(model.motion, motion_from(motion, model.outputs.size()));
  }
  if (metadata.contains("ravencal.expected")) {
    RAVENCAL_ASSIGN_OR_RETURN(const json expected, reader.value("ravencal.expected"));
    RAVENCAL_ASSIGN_OR_RETURN(model.expected, expected_from(expected, model.outputs.size()));
  }
  if (metadata.contains("ravencal.random_seeds")) {
    RAVENCAL_ASSIGN_OR_RETURN(const json seeds, reader.value("ravencal.random_seeds"));
    RAVENCAL_ASSIGN_OR_RETURN(model.seeds, seeds_from(seeds));
  }
  if (metadata.contains("ravencal.gains")) {
    RAVENCAL_ASSIGN_OR_RETURN(const json gains, reader.value("ravencal.gains"));
    RAVENCAL_ASSIGN_OR_RETURN(model.loop_gains, gains_from(gains, model.outputs.size()));
  }
  if (metadata.contains("ravencal.origin")) {
    RAVENCAL_ASSIGN_OR_RETURN(const json origin, reader.value("ravencal.origin"));
    RAVENCAL_ASSIGN_OR_RETURN(model.origin, origin_from(origin));
  }
  RAVENCAL_ASSIGN_OR_RETURN(model.output,
                            reader.standardiser("ravencal.output", model.outputs.size()));
  RAVENCAL_ASSIGN_OR_RETURN(const json period, reader.value("ravencal.row_period_s"));
  if (!period.is_number() || !(period.get<double>() >= 0.0)) {
    return core::data_error("metadata 'ravencal.row_period_s' is not a duration");
  }
  model.row_period_s = period.get<double>();
  RAVENCAL_ASSIGN_OR_RETURN(const json provenance, reader.value("ravencal.provenance"));
  if (!provenance.is_object())
    return core::data_error("metadata 'ravencal.provenance' is not an object");
  for (const auto& [key, value] : provenance.items()) {
    model.provenance[key] = value.is_string() ? value.get<std::string>() : value.dump();
  }
  return model;
}

}  // namespace ravencal::learn
