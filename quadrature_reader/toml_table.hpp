// SPDX-License-Identifier: Apache-2.0
//
// Reads one TOML table key by key, remembers the first thing wrong with it, and refuses keys that
// nobody asked for. Private to the configuration.
#pragma once

#include <fmt/format.h>
#include <toml++/toml.h>

#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <string_view>

#include "core/result.hpp"

namespace ravencal::quadrature_reader {

class TomlTable {
 public:
  TomlTable(const toml::table& table, std::string name, const std::filesystem::path& path)
      : table_(table), name_(std::move(name)), path_(path) {}

  /// The node of that key, if present; marks the key as known.
  const toml::node* find(std::string_view key) {
    known_.insert(std::string(key));
    return table_.get(key);
  }

  std::optional<std::string> text(std::string_view key) { return read<std::string>(key, "a text"); }
  std::optional<bool> boolean(std::string_view key) { return read<bool>(key, "true or false"); }

  /// A number within [low, high].
  std::optional<double> number(std::string_view key, double low, double high) {
    const auto value = read<double>(key, "a number");
    if (value && !(*value >= low && *value <= high)) {
      fail(key, fmt::format("{} is {}, must be from {} to {}", key, *value, low, high));
      return std::nullopt;
    }
    return value;
  }
  /// A whole number within [low, high].
  std::optional<std::int64_t> integer(std::string_view key, std::int64_t low, std::int64_t high) {
    const toml::node* node = find(key);
    if (node == nullptr) return std::nullopt;
    const auto value = node->is_integer() ? node->value<std::int64_t>() : std::nullopt;
    if (value && *value >= low && *value <= high) return value;
    fail(key, fmt::format("{} must be a whole number from {} to {}", key, low, high));
    return std::nullopt;
  }
  const toml::table* table(std::string_view key) {
    const toml::node* node = find(key);
    if (node == nullptr) return nullptr;
    if (node->is_table()) return node->as_table();
    fail(key, fmt::format("{} must be a table", key));
    return nullptr;
  }

  void fail(std::string_view key, std::string why) {
    const toml::node* node = table_.get(key);
    fail_at(node != nullptr ? *node : table_, std::move(why));
  }
  void require(bool present, std::string_view key) {
    if (!present) fail_at(table_, fmt::format("{} needs '{}'", name_, key));
  }

  /// The first failure, or the first key that nobody asked for.
  core::Status finish() {
    for (const auto& [key, node] : table_) {
      const std::string word(key.str());
      if (known_.contains(word)) continue;
      fail_at(node, fmt::format("unknown key '{}' in {}; known: {}", word, name_,
                                fmt::join(known_, ", ")));
    }
    return error_ ? core::Status(*error_) : core::Status();
  }

 private:
  template <typename T>
  std::optional<T> read(std::string_view key, std::string_view kind) {
    const toml::node* node = find(key);
    if (node == nullptr) return std::nullopt;
    auto value = node->value<T>();
    if (!value) fail(key, fmt::format("{} must be {}", key, kind));
    return value;
  }
  void fail_at(const toml::node& node, std::string why) {
    if (error_) return;
    error_ = core::Error{core::ErrorCode::kData,
                         fmt::format("{}:{}:{}: {}", path_.string(), node.source().begin.line,
                                     node.source().begin.column, why)};
  }

  const toml::table& table_;
  std::string name_;
  const std::filesystem::path& path_;
  std::set<std::string> known_;
  std::optional<core::Error> error_;
};

}  // namespace ravencal::quadrature_reader
