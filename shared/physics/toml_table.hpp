// SPDX-License-Identifier: Apache-2.0
//
// Strict reading of one TOML table: every key that nobody asked for is an error with file and line,
// and so are a missing key and a value of the wrong type. Include from .cpp files only.
#pragma once

#include <toml++/toml.h>
#include <array>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"

namespace ravencal::physics {

/// Reads one table; remembers the first error, so that a caller can read all keys and ask once.
class TomlTable {
 public:
  TomlTable(const toml::table& table, std::string source, std::string where);

  double number(std::string_view key);
  double number_or(std::string_view key, double fallback);
  bool boolean_or(std::string_view key, bool fallback);
  std::string text(std::string_view key);
  std::string text_or(std::string_view key, std::string_view fallback);
  /// Array of numbers; `count` 0 accepts any length.
  std::vector<double> numbers(std::string_view key, std::size_t count);
  /// Square array of arrays of numbers, [size x size].
  std::vector<std::vector<double>> matrix(std::string_view key, std::size_t size);
  std::optional<TomlTable> table(std::string_view key);
  std::vector<TomlTable> tables(std::string_view key);
  [[nodiscard]] bool has(std::string_view key) const;
  /// Keys that have not been read yet, for tables whose keys are data.
  [[nodiscard]] std::vector<std::string> unread_keys() const;

  /// Records an error at `key`'s line (or the table's, if the key is absent).
  void fail(std::string_view key, const std::string& message);
  /// First error, or an unknown key.
  [[nodiscard]] core::Status finish() const;
  [[nodiscard]] bool failed() const { return error_.has_value(); }

 private:
  const toml::node* take(std::string_view key);
  [[nodiscard]] std::string position(std::string_view key) const;

  const toml::table* table_;
  std::string source_;
  std::string where_;
  std::set<std::string, std::less<>> read_;
  std::optional<core::Error> error_;
};

}  // namespace ravencal::physics
