// SPDX-License-Identifier: Apache-2.0
#include "conversion/scaling_file.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "core/json_text.hpp"
#include "core/units.hpp"
#include "core/whole_file.hpp"
#include "exchange/npz.hpp"
#include "record/profile.hpp"

namespace ravencal::conversion {
namespace {

using nlohmann::json;

const std::set<std::string> kKeys = {"profile",        "arm",
                                     "features",       "feature_units",
                                     "input_mean",     "input_scale",
                                     "input_min",      "input_max",
                                     "output_joints",  "output_estimates",
                                     "output_units",   "output_mean",
                                     "output_scale",   "row_period_s",
                                     "window",         "stride_rows",
                                     "newest_rows_ago"};

/// Lists of numbers and of texts by name; a single value is a list of one.
struct NamedLists {
  std::map<std::string, std::vector<double>> numbers;
  std::map<std::string, std::vector<std::string>> texts;
};

core::Result<NamedLists> lists_from_npz(const std::string& path) {
  RAVENCAL_ASSIGN_OR_RETURN(const auto arrays, exchange::read_npz(path));
  NamedLists lists;
  for (const exchange::NamedArray& array : arrays) {
    const auto refuse = [&](std::string_view why) {
      return core::data_error(fmt::format("{}: array '{}': {}", path, array.name, why));
    };
    if (!array.unreadable.empty()) return refuse(array.unreadable);
    const auto is_long = [](std::size_t size) { return size > 1; };
    if (std::count_if(array.shape.begin(), array.shape.end(), is_long) > 1)
      return refuse("has several rows and columns; a list is needed");
    if (array.values.empty() && array.texts.empty()) return refuse("is empty");
    if (!array.values.empty()) lists.numbers[array.name] = array.values;
    if (!array.texts.empty()) lists.texts[array.name] = array.texts;
  }
  return lists;
}

core::Result<NamedLists> lists_from_json(const std::string& text) {
  RAVENCAL_ASSIGN_OR_RETURN(const json object, core::parse_json(text));
  if (!object.is_object()) return core::data_error("is not a JSON object");
  NamedLists lists;
  for (const auto& [key, value] : object.items()) {
    for (const json& item : value.is_array() ? value : json::array({value})) {
      if (item.is_number()) {
        lists.numbers[key].push_back(item.get<double>());
      } else if (item.is_string()) {
        lists.texts[key].push_back(item.get<std::string>());
      } else {
        return core::data_error(fmt::format(
            "'{}' holds {}; it must be a number, a text or a list of these", key, item.dump()));
      }
    }
  }
  return lists;
}

/// Takes the lists apart, key by key.
class Reader {
 public:
  explicit Reader(NamedLists lists) : lists_(std::move(lists)) {}

  core::Result<ScalingFile> read() {
    RAVENCAL_RETURN_IF_ERROR(check_keys());
    RAVENCAL_RETURN_IF_ERROR(read_features());
    RAVENCAL_RETURN_IF_ERROR(read_outputs());
    RAVENCAL_ASSIGN_OR_RETURN(file_.input, scaling("input", features_count()));
    RAVENCAL_ASSIGN_OR_RETURN(file_.output, scaling("output", outputs_count()));
    RAVENCAL_RETURN_IF_ERROR(read_range());
    return read_times();
  }

 private:
  [[nodiscard]] Eigen::Index features_count() const {
    return static_cast<Eigen::Index>(file_.features.size());
  }
  [[nodiscard]] Eigen::Index outputs_count() const {
    return static_cast<Eigen::Index>(file_.outputs.size());
  }
  [[nodiscard]] const std::vector<std::string>* texts(const std::string& key) const {
    const auto it = lists_.texts.find(key);
    return it == lists_.texts.end() ? nullptr : &it->second;
  }

  core::Status check_keys() const {
    std::vector<std::string> keys;
    for (const auto& [key, values] : lists_.numbers) keys.push_back(key);
    for (const auto& [key, values] : lists_.texts) keys.push_back(key);
    for (const std::string& key : keys) {
      if (!kKeys.contains(key)) {
        return core::data_error(
            fmt::format("unknown key '{}'; known: {}", key, fmt::join(kKeys, ", ")));
      }
      if (lists_.numbers.contains(key) && lists_.texts.contains(key)) {
        return core::data_error(fmt::format("'{}' mixes numbers and texts", key));
      }
    }
    return {};
  }

  core::Result<std::string> word(const std::string& key, const std::string& otherwise) const {
    const auto* values = texts(key);
    if (values == nullptr && !lists_.numbers.contains(key)) return otherwise;
    if (values == nullptr || values->size() != 1)
      return core::data_error(fmt::format("'{}' is not one text", key));
    return values->front();
  }

  /// One finite number.
  core::Result<double> number(const std::string& key, double otherwise) const {
    if (!lists_.numbers.contains(key) && !lists_.texts.contains(key)) return otherwise;
    RAVENCAL_ASSIGN_OR_RETURN(const Eigen::VectorXd values, vector(key, 1));
    return values[0];
  }

  /// `size` finite numbers; a single one counts for all.
  core::Result<Eigen::VectorXd> vector(const std::string& key, Eigen::Index size) const {
    const auto it = lists_.numbers.find(key);
    if (it == lists_.numbers.end())
      return core::data_error(fmt::format("'{}' is missing or no list of numbers", key));
    const std::vector<double>& values = it->second;
    const auto count = static_cast<Eigen::Index>(values.size());
    if (count != 1 && count != size) {
      return core::data_error(fmt::format("'{}' has {} numbers; {} are needed", key, count, size));
    }
    Eigen::VectorXd result(size);
    for (Eigen::Index i = 0; i < size; ++i) {
      result[i] = values[static_cast<std::size_t>(count == 1 ? 0 : i)];
      if (!std::isfinite(result[i]))
        return core::data_error(fmt::format("'{}': number {} is not finite", key, i));
    }
    return result;
  }

  /// Columns of the profile, channel names, or a built-in set.
  core::Status read_features() {
    RAVENCAL_ASSIGN_OR_RETURN(const std::string profile_name, word("profile", "raven2"));
    record::ProfileOptions options;
    RAVENCAL_ASSIGN_OR_RETURN(options.arm, word("arm", options.arm));
    file_.arm = model::arm_from(options.arm).value_or(model::Arm::kUnknown);
    RAVENCAL_ASSIGN_OR_RETURN(profile_, record::load_profile(profile_name, options));
    if (lists_.numbers.contains("features")) {
      RAVENCAL_RETURN_IF_ERROR(features_by_column());
    } else if (const auto* names = texts("features")) {
      RAVENCAL_RETURN_IF_ERROR(features_by_name(*names));
    } else {
      return core::data_error(
          "'features' is missing: column numbers of the profile, channel names, or one of "
          "paper112, notebook208, light and light-open");
    }
    return read_feature_units();
  }

  core::Status features_by_column() {
    for (const double value : lists_.numbers.at("features")) {
      const record::ProfileChannel* found = nullptr;
      for (const record::ProfileChannel& channel : profile_.channels) {
        if (channel.index && static_cast<double>(*channel.index) == value) found = &channel;
      }
      if (found == nullptr || record::tells_truth(found->channel.role)) {
        return core::data_error(
            fmt::format("'features': column {} of profile {} is no input", value, profile_.name));
      }
      file_.features.push_back({found->channel.name});
    }
    return {};
  }

  core::Status features_by_name(const std::vector<std::string>& names) {
    std::vector<record::Channel> channels;
    for (const auto& channel : profile_.channels) channels.push_back(channel.channel);
    const bool is_set = names.size() == 1 && (names[0] == "paper112" || names[0] == "notebook208" ||
                                              names[0] == "light" || names[0] == "light-open");
    if (is_set) {
      RAVENCAL_ASSIGN_OR_RETURN(file_.features, model::select_features(names[0], channels));
      return {};
    }
    for (const std::string& name : names) {
      RAVENCAL_ASSIGN_OR_RETURN(const model::FeatureSpec feature, model::FeatureSpec::parse(name));
      file_.features.push_back(feature);
    }
    return {};
  }

  /// Of the profile's columns, unless the file says otherwise.
  core::Status read_feature_units() {
    const auto* units = texts("feature_units");
    const bool is_si = units != nullptr && *units == std::vector<std::string>{"si"};
    const bool is_listed =
        units != nullptr && !is_si && *units != std::vector<std::string>{"profile"};
    if (is_listed && units->size() != file_.features.size()) {
      return core::data_error(fmt::format("'feature_units' has {} units for {} features",
                                          units->size(), file_.features.size()));
    }
    file_.feature_to_si = Eigen::VectorXd::Ones(features_count());
    for (std::size_t i = 0; i < file_.features.size() && !is_si; ++i) {
      const model::FeatureSpec& feature = file_.features[i];
      std::string name = is_listed ? (*units)[i] : "";
      for (const auto& channel : profile_.channels) {
        if (is_listed || channel.channel.name != feature.channel) continue;
        if (channel.scale != 1.0 || channel.offset != 0.0) {
          return core::data_error(fmt::format(
              "profile {} scales or shifts the column of '{}': give 'feature_units', \"si\" or one "
              "for each feature, in which the network takes it",
              profile_.name, feature.channel));
        }
        name = channel.channel.unit;
      }
      const auto unit = core::find_unit(name);
      if (!unit) {
        return core::data_error(
            name.empty() ? fmt::format("profile {} has no channel '{}'; give 'feature_units', "
                                       "\"si\" or one for each feature",
                                       profile_.name, feature.channel)
                         : fmt::format("'feature_units': unknown unit '{}'", name));
      }
      file_.feature_to_si[static_cast<Eigen::Index>(i)] = unit->to_si;
    }
    return {};
  }

  core::Status read_outputs() {
    const auto* joints = texts("output_joints");
    const auto* units = texts("output_units");
    const auto* estimates = texts("output_estimates");
    if (joints == nullptr || units == nullptr || joints->size() != units->size() ||
        (estimates != nullptr && estimates->size() != joints->size())) {
      return core::data_error(
          "'output_joints' and 'output_units' (and 'output_estimates', if given) must be "
          "lists of texts, one for each output, as [\"shoulder\", \"elbow\", \"insertion\"] and "
          "[\"deg\", \"deg\", \"m\"]");
    }
    file_.output_to_si.resize(static_cast<Eigen::Index>(joints->size()));
    for (std::size_t k = 0; k < joints->size(); ++k) {
      const auto unit = core::find_unit((*units)[k]);
      if (!unit || (unit->si_name != "rad" && unit->si_name != "m")) {
        return core::data_error(
            fmt::format("'output_units': '{}' is no unit of a joint", (*units)[k]));
      }
      const std::string estimate = estimates != nullptr ? (*estimates)[k] : "jpos." + (*joints)[k];
      file_.outputs.push_back({(*joints)[k], estimate, std::string(unit->si_name)});
      file_.output_to_si[static_cast<Eigen::Index>(k)] = unit->to_si;
    }
    return {};
  }

  core::Result<std::optional<FileScaling>> scaling(const std::string& prefix,
                                                   Eigen::Index size) const {
    const std::string mean = prefix + "_mean";
    const std::string scale = prefix + "_scale";
    if (!lists_.numbers.contains(mean) && !lists_.numbers.contains(scale)) {
      return std::optional<FileScaling>();
    }
    FileScaling result;
    RAVENCAL_ASSIGN_OR_RETURN(result.mean, vector(mean, size));
    RAVENCAL_ASSIGN_OR_RETURN(result.scale, vector(scale, size));
    if (!(result.scale.minCoeff() > 0.0)) {
      return core::data_error(fmt::format(
          "'{}' has a value that is not above 0; a constant column has scale 1", scale));
    }
    return std::optional(result);
  }

  core::Status read_range() {
    if (!lists_.numbers.contains("input_min") && !lists_.numbers.contains("input_max")) return {};
    RAVENCAL_ASSIGN_OR_RETURN(file_.input_min, vector("input_min", features_count()));
    RAVENCAL_ASSIGN_OR_RETURN(file_.input_max, vector("input_max", features_count()));
    if (((file_.input_max - file_.input_min).array() < 0.0).any()) {
      return core::data_error("'input_max' is below 'input_min'");
    }
    return {};
  }

  core::Result<std::uint32_t> count(const std::string& key, std::uint32_t otherwise,
                                    double most) const {
    RAVENCAL_ASSIGN_OR_RETURN(const double value, number(key, otherwise));
    if (!(value >= 0.0 && value <= most) || value != std::floor(value)) {
      return core::data_error(
          fmt::format("'{}' is {}; it must be a whole number up to {}", key, value, most));
    }
    return static_cast<std::uint32_t>(value);
  }

  core::Result<ScalingFile> read_times() {
    RAVENCAL_ASSIGN_OR_RETURN(file_.row_period_s, number("row_period_s", file_.row_period_s));
    if (!(file_.row_period_s > 0.0)) return core::data_error("'row_period_s' is not above 0");
    RAVENCAL_ASSIGN_OR_RETURN(file_.window, count("window", 0, model::packed::kMaxWindow));
    RAVENCAL_ASSIGN_OR_RETURN(
        file_.stride_rows, count("stride_rows", file_.stride_rows, model::packed::kMaxStrideRows));
    RAVENCAL_ASSIGN_OR_RETURN(const std::uint32_t ago,
                              count("newest_rows_ago", 0, model::packed::kMaxStrideRows));
    for (model::FeatureSpec& feature : file_.features) {
      if (ago == 0) break;
      if (feature.transform == model::Transform::kPlay || model::is_mean(feature.transform) ||
          model::is_travel_mean(feature.transform)) {
        return core::data_error(fmt::format(
            "'newest_rows_ago' cannot be had together with a play or mean ('{}')", feature.text()));
      }
      feature.transform = model::Transform::kLag;
      feature.lag_rows += ago;
    }
    return std::move(file_);
  }

  NamedLists lists_;
  record::Profile profile_;
  ScalingFile file_;
};

}  // namespace

core::Result<ScalingFile> read_scaling_file(const std::string& path) {
  NamedLists lists;
  if (path.ends_with(".npz")) {
    RAVENCAL_ASSIGN_OR_RETURN(lists, lists_from_npz(path));
  } else {
    RAVENCAL_ASSIGN_OR_RETURN(const std::string text, core::read_whole_file(path));
    auto from_json = lists_from_json(text);
    if (!from_json.ok())
      return core::data_error(fmt::format("{}: {}", path, from_json.error().message));
    lists = std::move(*from_json);
  }
  auto file = Reader(std::move(lists)).read();
  if (!file.ok()) return core::data_error(fmt::format("{}: {}", path, file.error().message));
  return file;
}

}  // namespace ravencal::conversion
