// SPDX-License-Identifier: Apache-2.0
//
// Strict reading of a TOML file, table by table: a key that nobody asked for is an error, and so
// are a missing key, a value of the wrong type and a number that is not finite or out of range.
// Errors read `FILE:LINE: what is wrong (column N)`. toml++ stays behind this header. One thread
// per file.
#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"

namespace ravencal::core {

/// Where a number may lie, ends included. Without a range every finite number is accepted.
struct NumberRange {
  double low = std::numeric_limits<double>::lowest();
  double high = std::numeric_limits<double>::max();
};

/// Likewise for whole numbers.
struct IntegerRange {
  std::int64_t low = std::numeric_limits<std::int64_t>::min();
  std::int64_t high = std::numeric_limits<std::int64_t>::max();
};

/// One table of a TOML file. Remembers the first thing that is wrong with it, so that a caller
/// reads all keys and asks once. In each family of readers the bare name wants the key to be there,
/// `_or` has a fallback and `find_` says whether it was there. A wrong value counts as absent.
/// Keeps the parsed file alive; may outlive the table it came from.
class TomlTable {
 public:
  TomlTable(TomlTable&& other) noexcept;
  TomlTable& operator=(TomlTable&& other) noexcept;
  TomlTable(const TomlTable&) = delete;
  TomlTable& operator=(const TomlTable&) = delete;
  ~TomlTable();

  double number(std::string_view key, NumberRange range = {});
  double number_or(std::string_view key, double fallback, NumberRange range = {});
  std::optional<double> find_number(std::string_view key, NumberRange range = {});

  std::int64_t integer_or(std::string_view key, std::int64_t fallback, IntegerRange range = {});
  std::optional<std::int64_t> find_integer(std::string_view key, IntegerRange range = {});

  bool boolean_or(std::string_view key, bool fallback);

  std::string text(std::string_view key);
  std::string text_or(std::string_view key, std::string_view fallback);
  std::optional<std::string> find_text(std::string_view key);

  /// List of exactly `count` numbers.
  std::vector<double> numbers(std::string_view key, std::size_t count, NumberRange range = {});
  /// Square list of lists of numbers, [size x size].
  std::vector<std::vector<double>> matrix(std::string_view key, std::size_t size,
                                          NumberRange range = {});
  /// One text or number, or a list of them, as texts; at least one.
  std::vector<std::string> words(std::string_view key);

  std::optional<TomlTable> table(std::string_view key);
  /// The tables of [[key]], in the file's order; empty if there are none.
  std::vector<TomlTable> tables(std::string_view key);

  [[nodiscard]] bool has(std::string_view key) const;
  [[nodiscard]] bool holds_text(std::string_view key) const;
  [[nodiscard]] bool holds_integer(std::string_view key) const;
  /// Keys that have not been read yet, for tables whose keys are data.
  [[nodiscard]] std::vector<std::string> unread_keys() const;

  /// Records an error at the line of `key`, or of the table if the key is absent.
  void fail(std::string_view key, std::string_view message);
  /// Records an error at the line where the table begins.
  void fail(std::string_view message);
  /// Records an error where one of the values of `key` is out of the range.
  void check_range(std::string_view key, const std::vector<double>& values, NumberRange range);
  /// Records that `key` is missing.
  void fail_missing(std::string_view key);
  [[nodiscard]] bool failed() const;

  /// The first error (kData), or the first key that nobody asked for, with those that are known.
  [[nodiscard]] Status finish() const;

 private:
  struct State;
  explicit TomlTable(std::unique_ptr<State> state);
  friend Result<TomlTable> parse_toml(std::string_view text, const std::string& source,
                                      std::string_view name);

  std::unique_ptr<State> state_;
};

/// A text as a TOML file holds it, in quotes.
std::string toml_text(std::string_view text);
/// A key that is data: bare where TOML allows it.
std::string toml_key(std::string_view key);

/// Parses `text`. `source` is the file's name in errors, `name` what the whole file is ("a
/// profile"). Errors: kData.
Result<TomlTable> parse_toml(std::string_view text, const std::string& source,
                             std::string_view name);

/// Reads and parses a file. Errors: kIo if it cannot be read, else kData.
Result<TomlTable> read_toml(const std::filesystem::path& path, std::string_view name);

}  // namespace ravencal::core
