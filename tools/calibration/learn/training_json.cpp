// SPDX-License-Identifier: Apache-2.0
#include "learn/training_json.hpp"

#include <fmt/format.h>

#include <cmath>
#include <optional>

namespace ravencal::learn {

using nlohmann::json;

namespace {

/// An unknown range is null.
json range_json(const model::Range& range) {
  if (!std::isfinite(range.low) || !std::isfinite(range.high)) return nullptr;
  return {range.low, range.high};
}

std::optional<model::Range> range_from(const json& pair) {
  if (pair.is_null()) return model::Range{};
  if (!pair.is_array() || pair.size() != 2 || !pair[0].is_number() || !pair[1].is_number())
    return std::nullopt;
  const model::Range range{pair[0].get<double>(), pair[1].get<double>()};
  if (!std::isfinite(range.low) || !std::isfinite(range.high) || range.low > range.high)
    return std::nullopt;
  return range;
}

json rmse_json(const model::ExpectedRmse& e) {
  return {{"rmse", e.rmse}, {"low", e.low}, {"high", e.high}};
}

/// Not negative.
std::optional<double> size_from(const json& object, const char* key) {
  if (!object.contains(key) || !object[key].is_number()) return std::nullopt;
  const double value = object[key].get<double>();
  return value >= 0.0 ? std::optional(value) : std::nullopt;
}

std::optional<model::ExpectedRmse> rmse_from(const json& object) {
  if (!object.is_object()) return std::nullopt;
  const auto rmse = size_from(object, "rmse");
  const auto low = size_from(object, "low");
  const auto high = size_from(object, "high");
  if (!rmse || !low || !high) return std::nullopt;
  return model::ExpectedRmse{*rmse, *low, *high};
}

}  // namespace

std::string expected_text(const std::vector<model::ExpectedError>& expected) {
  json list = json::array();
  for (const model::ExpectedError& e : expected) {
    json item = rmse_json(e.any());
    item["about_mean"] = e.about_mean;
    item["same_homing"] = rmse_json(e.same_homing);
    if (e.other_homing) item["other_homing"] = rmse_json(*e.other_homing);
    list.push_back(std::move(item));
  }
  return list.dump();
}

core::Result<std::vector<model::ExpectedError>> expected_from(const json& list,
                                                              std::size_t outputs) {
  const auto wrong = [&] {
    return core::data_error(
        fmt::format("metadata 'ravencal.expected' is not a list of {} expected errors", outputs));
  };
  if (!list.is_array() || list.size() != outputs) return wrong();
  std::vector<model::ExpectedError> expected;
  for (const json& item : list) {
    if (!item.is_object()) return wrong();
    const auto any = rmse_from(item);
    const auto about_mean = size_from(item, "about_mean");
    // Earlier files have one figure, that of another recording.
    const auto same = item.contains("same_homing") ? rmse_from(item["same_homing"]) : any;
    const bool has_other = item.contains("other_homing");
    const auto other = has_other ? rmse_from(item["other_homing"]) : std::nullopt;
    if (!any || !about_mean || !same || (has_other && !other)) return wrong();
    expected.push_back({*same, other, *about_mean});
  }
  return expected;
}

std::string motion_text(const model::MotionRange& motion) {
  json joints = json::array();
  for (const model::JointMotion& joint : motion) {
    joints.push_back({{"speed", range_json(joint.speed)},
                      {"load_channel", joint.load_channel},
                      {"load", range_json(joint.load)}});
  }
  return joints.dump();
}

core::Result<model::MotionRange> motion_from(const json& joints, std::size_t outputs) {
  const auto wrong = [] {
    return core::data_error("metadata 'ravencal.motion' holds no speeds and loads");
  };
  if (!joints.is_array() || joints.size() != outputs) return wrong();
  model::MotionRange motion;
  for (const json& joint : joints) {
    for (const char* key : {"speed", "load_channel", "load"}) {
      if (!joint.is_object() || !joint.contains(key)) return wrong();
    }
    const auto speed = range_from(joint["speed"]);
    const auto load = range_from(joint["load"]);
    if (!speed || !load || !joint["load_channel"].is_string()) return wrong();
    motion.push_back({*speed, joint["load_channel"].get<std::string>(), *load});
  }
  return motion;
}

json seeds_json(const std::vector<model::RandomSeeds>& seeds) {
  json list = json::array();
  for (const model::RandomSeeds& one : seeds) {
    list.push_back({{"recording", one.recording},
                    {"seed", one.run},
                    {"homing_seed", one.homing},
                    {"rehomings", one.rehomings}});
  }
  return list;
}

core::Result<std::vector<model::RandomSeeds>> seeds_from(const json& list) {
  const auto wrong = [] {
    return core::data_error(
        "metadata 'ravencal.random_seeds' is not a list of recordings with seeds");
  };
  if (!list.is_array()) return wrong();
  std::vector<model::RandomSeeds> seeds;
  for (const json& item : list) {
    model::RandomSeeds& one = seeds.emplace_back();
    for (const auto& [key, value] :
         {std::pair{"seed", &one.run}, std::pair{"homing_seed", &one.homing},
          std::pair{"rehomings", &one.rehomings}}) {
      if (!item.is_object() || !item.contains(key) || !item[key].is_number_unsigned())
        return wrong();
      *value = item[key].get<std::uint64_t>();
    }
    if (!item.contains("recording") || !item["recording"].is_string()) return wrong();
    one.recording = item["recording"].get<std::string>();
  }
  return seeds;
}

}  // namespace ravencal::learn
