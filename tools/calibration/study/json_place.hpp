// SPDX-License-Identifier: Apache-2.0
//
// Reads JSON of a plan or a result and says where what does not fit stands: `jobs[3].width`. Every
// function throws std::invalid_argument; whoever reads the file catches it and adds the file's
// name.
#pragma once

#include <fmt/format.h>

#include <cmath>
#include <concepts>
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <vector>

namespace ravencal::study {

class JsonPlace {
 public:
  using Json = nlohmann::ordered_json;

  /// `json` must outlive the place.
  explicit JsonPlace(const Json& json, std::string path = {})
      : json_(&json), path_(std::move(path)) {}

  [[nodiscard]] JsonPlace operator[](const char* key) const {
    const std::string path = path_.empty() ? key : fmt::format("{}.{}", path_, key);
    if (!json_->is_object() || !json_->contains(key))
      throw std::invalid_argument(path + " is missing");
    return JsonPlace(json_->at(key), path);
  }

  [[nodiscard]] bool has(const char* key) const {
    return json_->is_object() && json_->contains(key);
  }

  [[nodiscard]] std::vector<JsonPlace> items() const {
    if (!json_->is_array()) refuse("a list");
    std::vector<JsonPlace> places;
    for (std::size_t i = 0; i < json_->size(); ++i)
      places.push_back(JsonPlace((*json_)[i], fmt::format("{}[{}]", path_, i)));
    return places;
  }

  /// The items of a list that has some.
  [[nodiscard]] std::vector<JsonPlace> some() const {
    std::vector<JsonPlace> places = items();
    if (places.empty()) refuse("a list with items");
    return places;
  }

  [[nodiscard]] std::string text() const {
    if (!json_->is_string()) refuse("a text");
    return json_->get<std::string>();
  }

  [[nodiscard]] bool flag() const {
    if (!json_->is_boolean()) refuse("true or false");
    return json_->get<bool>();
  }

  /// A whole number from `least` to `most`.
  template <std::unsigned_integral T>
  [[nodiscard]] T whole(T least = 0, T most = std::numeric_limits<T>::max()) const {
    if (!json_->is_number_unsigned() || json_->get<std::uint64_t>() < least ||
        json_->get<std::uint64_t>() > most) {
      refuse(fmt::format("a whole number from {} to {}", least, most));
    }
    return json_->get<T>();
  }

  [[nodiscard]] double number() const {
    if (!json_->is_number()) refuse("a number");
    return json_->get<double>();
  }

  /// A figure that is never negative. JSON has no infinity or NaN: null stands for an infinite
  /// figure, of a model that overflowed.
  [[nodiscard]] double figure() const {
    if (json_->is_null()) return std::numeric_limits<double>::infinity();
    if (!json_->is_number() || json_->get<double>() < 0.0)
      refuse("a number of at least 0, or null");
    return json_->get<double>();
  }

  [[nodiscard]] bool is_null() const { return json_->is_null(); }

  /// Says what stands here in place of `expected`.
  [[noreturn]] void refuse(const std::string& expected) const {
    constexpr std::size_t kShown = 40;  // of what may be a long list
    std::string found = json_->dump(-1, ' ', false, Json::error_handler_t::replace);
    if (found.size() > kShown) found = found.substr(0, kShown) + "...";
    throw std::invalid_argument(fmt::format("{} is {}, not {}", path_, found, expected));
  }

 private:
  const Json* json_;
  std::string path_;
};

}  // namespace ravencal::study
