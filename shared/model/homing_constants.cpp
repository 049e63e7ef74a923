// SPDX-License-Identifier: Apache-2.0
#include "model/homing_constants.hpp"

#include <nlohmann/json.hpp>

#include "core/json_text.hpp"

namespace ravencal::model {
namespace {

constexpr const char* kHomingConstants = "homing_constants";  // of the provenance

}  // namespace

void keep_homing_constants(CalibrationModel& model, const std::vector<HomingConstants>& constants) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const HomingConstants& of_joint : constants) {
    list.push_back({{"joint", of_joint.joint},
                    {"constants", of_joint.constants},
                    {"rmse_about_mean", of_joint.rmse_about_mean}});
  }
  model.provenance[kHomingConstants] = list.dump();
}

core::Result<std::vector<HomingConstants>> homing_constants_of(const CalibrationModel& model) {
  std::vector<HomingConstants> constants;
  const auto found = model.provenance.find(kHomingConstants);
  if (found == model.provenance.end()) return constants;
  const auto wrong = [] {
    return core::data_error("the model's provenance 'homing_constants' is no list of joints");
  };
  const auto list = core::parse_json(found->second);
  if (!list.ok() || !list->is_array()) return wrong();
  for (const nlohmann::json& item : *list) {
    if (!item.is_object() || !item.contains("joint") || !item.contains("constants") ||
        !item.contains("rmse_about_mean") || !item["joint"].is_string() ||
        !item["constants"].is_array() || !item["rmse_about_mean"].is_number()) {
      return wrong();
    }
    HomingConstants& of_joint = constants.emplace_back();
    of_joint.joint = item["joint"].get<std::string>();
    of_joint.rmse_about_mean = item["rmse_about_mean"].get<double>();
    for (const nlohmann::json& value : item["constants"]) {
      if (!value.is_number()) return wrong();
      of_joint.constants.push_back(value.get<double>());
    }
  }
  return constants;
}

}  // namespace ravencal::model
