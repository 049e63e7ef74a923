// SPDX-License-Identifier: Apache-2.0
#include "rezero/constant_file.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "core/joint_layout.hpp"
#include "core/json_text.hpp"
#include "core/whole_file.hpp"
#include "model/blob_format.hpp"

namespace ravencal::rezero {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kFormat = "ravencal homing constant";
constexpr int kVersion = 1;

/// Of everything but the checksum.
std::string checksum_of(Json json) {
  json.erase("checksum");
  const std::string text = json.dump();
  return fmt::format(
      "{:08x}", model::blob::crc32c(reinterpret_cast<const std::byte*>(text.data()), text.size()));
}

Json json_of(const JointConstant& joint) {
  return {{"joint", joint.joint},
          {"unit", joint.unit},
          {"known", joint.is_known},
          {"pose", joint.pose},
          {"uncertainty", joint.uncertainty},
          {"reading", joint.reading},
          {"predicted", joint.predicted},
          {"constant", joint.constant},
          {"at_most", joint.bound},
          {"expected_rest", joint.expected_rest}};
}

JointConstant joint_from(const Json& json) {
  return {json.at("joint").get<std::string>(),  json.at("unit").get<std::string>(),
          json.at("known").get<bool>(),         json.at("pose").get<double>(),
          json.at("uncertainty").get<double>(), json.at("reading").get<double>(),
          json.at("predicted").get<double>(),   json.at("constant").get<double>(),
          json.at("at_most").get<double>(),     json.at("expected_rest").get<double>()};
}

ConstantFile file_from(const Json& json) {
  ConstantFile file;
  file.weights_checksum = json.at("weights_checksum").get<std::uint32_t>();
  file.homing = json.at("enc_offset_counts").get<Homing>();
  file.source = json.at("source").get<std::string>();
  file.realtime_ns = json.at("realtime_ns").get<std::int64_t>();
  for (const Json& joint : json.at("joints")) file.joints.push_back(joint_from(joint));
  return file;
}

}  // namespace

std::filesystem::path path_beside(const std::filesystem::path& weights) {
  return weights.string() + ".homing.json";
}

core::Status write_constant(const ConstantFile& file, const std::filesystem::path& path) {
  Json json = {{"format", kFormat},
               {"version", kVersion},
               {"weights_checksum", file.weights_checksum},
               {"enc_offset_counts", file.homing},
               {"source", file.source},
               {"realtime_ns", file.realtime_ns},
               {"joints", Json::array()}};
  for (const JointConstant& joint : file.joints) json["joints"].push_back(json_of(joint));
  json["checksum"] = checksum_of(json);
  return core::write_whole_file(path, json.dump(2) + "\n");
}

core::Result<ConstantFile> read_constant(const std::filesystem::path& path) {
  RAVENCAL_ASSIGN_OR_RETURN(const std::string text, core::read_whole_file(path));
  const auto wrong = [&](std::string_view what) {
    return core::data_error(
        fmt::format("{}: {}; make it with `ravencal rezero`", path.string(), what));
  };
  const auto json = core::parse_json<Json>(text);
  if (!json.ok() || !json->is_object() || json->value("format", Json()) != kFormat) {
    return wrong("is no constant of a homing");
  }
  if (json->value("version", Json()) != kVersion) {
    return wrong(fmt::format("is not of version {}, which this program reads", kVersion));
  }
  if (json->value("checksum", Json()) != checksum_of(*json)) {
    return wrong("was changed since it was written");
  }
  try {
    return file_from(*json);
  } catch (const Json::exception&) {
    return wrong("lacks a value, or has one of another kind");
  }
}

bool is_constant_file(const std::filesystem::path& path) { return read_constant(path).ok(); }

ravencal_homing_constant for_plugin(const ConstantFile& file) {
  ravencal_homing_constant constant{};
  constant.struct_size = sizeof constant;
  constant.weights_checksum = file.weights_checksum;
  std::copy(file.homing.begin(), file.homing.end(), constant.enc_offset_counts);
  for (const JointConstant& joint : file.joints) {
    for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
      if (joint.joint == core::kSlotNames[j]) {
        constant.constant_ji[j] = static_cast<float>(joint.constant);
      }
    }
  }
  return constant;
}

}  // namespace ravencal::rezero
