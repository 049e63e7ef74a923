// SPDX-License-Identifier: Apache-2.0
#include "physics/toml_table.hpp"

#include <fmt/format.h>

#include <cmath>

namespace ravencal::physics {

TomlTable::TomlTable(const toml::table& table, std::string source, std::string where)
    : table_(&table), source_(std::move(source)), where_(std::move(where)) {}

std::string TomlTable::position(std::string_view key) const {
  const toml::node* node = table_->get(key);
  const auto line = node != nullptr ? node->source().begin.line : table_->source().begin.line;
  return fmt::format("{}:{}", source_, line);
}

void TomlTable::fail(std::string_view key, const std::string& message) {
  if (error_) return;
  error_ = core::Error{core::ErrorCode::kData,
                       fmt::format("{}: {}: {}", position(key), where_, message)};
}

const toml::node* TomlTable::take(std::string_view key) {
  read_.emplace(key);
  return table_->get(key);
}

bool TomlTable::has(std::string_view key) const { return table_->contains(key); }

double TomlTable::number(std::string_view key) {
  const toml::node* node = take(key);
  if (node == nullptr) {
    fail(key, fmt::format("key '{}' is missing", key));
    return 0.0;
  }
  const auto value = node->value<double>();
  if (!value || !node->is_number() || !std::isfinite(*value)) {
    fail(key, fmt::format("'{}' must be a finite number", key));
    return 0.0;
  }
  return *value;
}

double TomlTable::number_or(std::string_view key, double fallback) {
  return has(key) ? number(key) : fallback;
}

bool TomlTable::boolean_or(std::string_view key, bool fallback) {
  const toml::node* node = take(key);
  if (node == nullptr) return fallback;
  const auto value = node->value<bool>();
  if (!value || !node->is_boolean()) fail(key, fmt::format("'{}' must be true or false", key));
  return value.value_or(fallback);
}

std::string TomlTable::text(std::string_view key) {
  const toml::node* node = take(key);
  const auto value = node != nullptr ? node->value<std::string>() : std::nullopt;
  if (!value) fail(key, fmt::format("'{}' must be a text", key));
  return value.value_or("");
}

std::string TomlTable::text_or(std::string_view key, std::string_view fallback) {
  return has(key) ? text(key) : std::string(fallback);
}

std::vector<double> TomlTable::numbers(std::string_view key, std::size_t count) {
  const toml::node* node = take(key);
  const toml::array* array = node != nullptr ? node->as_array() : nullptr;
  std::vector<double> values;
  if (array != nullptr) {
    for (const toml::node& element : *array) {
      const auto value = element.is_number() ? element.value<double>() : std::nullopt;
      if (value && std::isfinite(*value)) values.push_back(*value);
    }
  }
  if (array == nullptr || values.size() != array->size() ||
      (count != 0 && values.size() != count)) {
    fail(key, count == 0 ? fmt::format("'{}' must be a list of numbers", key)
                         : fmt::format("'{}' must be a list of {} numbers", key, count));
    values.assign(count, 0.0);
  }
  return values;
}

std::vector<std::vector<double>> TomlTable::matrix(std::string_view key, std::size_t size) {
  std::vector<std::vector<double>> rows(size, std::vector<double>(size, 0.0));
  const toml::node* node = take(key);
  const toml::array* outer = node != nullptr ? node->as_array() : nullptr;
  bool valid = outer != nullptr && outer->size() == size;
  for (std::size_t i = 0; valid && i < size; ++i) {
    const toml::array* row = outer->get(i)->as_array();
    valid = row != nullptr && row->size() == size;
    for (std::size_t k = 0; valid && k < size; ++k) {
      const auto value = row->get(k)->value<double>();
      valid = value.has_value() && std::isfinite(*value);
      if (valid) rows[i][k] = *value;
    }
  }
  if (!valid) fail(key, fmt::format("'{}' must be {} rows of {} numbers", key, size, size));
  return rows;
}

std::optional<TomlTable> TomlTable::table(std::string_view key) {
  const toml::node* node = take(key);
  if (node == nullptr) return std::nullopt;
  const toml::table* inner = node->as_table();
  if (inner == nullptr) {
    fail(key, fmt::format("'{}' must be a table", key));
    return std::nullopt;
  }
  return TomlTable(*inner, source_,
                   where_.empty() ? std::string(key) : fmt::format("{}.{}", where_, key));
}

std::vector<TomlTable> TomlTable::tables(std::string_view key) {
  std::vector<TomlTable> result;
  const toml::node* node = take(key);
  if (node == nullptr) return result;
  const toml::array* array = node->as_array();
  if (array == nullptr) {
    fail(key, fmt::format("'{0}' must be written as [[{0}]]", key));
    return result;
  }
  for (const toml::node& element : *array) {
    const toml::table* inner = element.as_table();
    if (inner == nullptr) {
      fail(key, fmt::format("every '{}' must be a table", key));
      return {};
    }
    result.emplace_back(*inner, source_,
                        where_.empty() ? std::string(key) : fmt::format("{}.{}", where_, key));
  }
  return result;
}

std::vector<std::string> TomlTable::unread_keys() const {
  std::vector<std::string> keys;
  for (const auto& [key, node] : *table_) {
    if (!read_.contains(key.str())) keys.emplace_back(key.str());
  }
  return keys;
}

core::Status TomlTable::finish() const {
  if (error_) return *error_;
  const std::vector<std::string> unknown = unread_keys();
  if (unknown.empty()) return {};
  return core::Error{core::ErrorCode::kData, fmt::format("{}: {}: unknown key '{}'; known here: {}",
                                                         position(unknown.front()), where_,
                                                         unknown.front(), fmt::join(read_, ", "))};
}

}  // namespace ravencal::physics
