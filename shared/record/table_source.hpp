// SPDX-License-Identifier: Apache-2.0
//
// Rows of named columns that a profile binds, wherever they come from: a CSV file or arrays in
// memory. Private to record/.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/result.hpp"

namespace ravencal::record {

/// What to do with one column: keep it as a number, as a word, as both or not at all.
struct BoundColumn {
  std::optional<std::size_t> number;  ///< output column of numbers
  std::optional<std::size_t> word;    ///< output column of words
  bool may_be_missing = false;        ///< "nan" and an empty field are NaN, not errors
  std::string name;                   ///< channel name, for messages

  [[nodiscard]] bool is_wanted() const { return number || word; }
};

/// A row that could not be read.
struct BadRow {
  std::size_t row = 0;                  ///< zero-based, counted without the header
  std::string why;                      ///< "column 14 (jpos.shoulder): 'x' is not a number"
  std::optional<std::size_t> column{};  ///< zero-based; none: the row as a whole
};

/// Where the values go; all have room for every row.
struct ColumnOutput {
  std::vector<double*> numbers;
  std::vector<double> factors;  ///< multiplies numbers[i]
  std::vector<std::string*> words;
};

class TableSource {
 public:
  TableSource() = default;
  TableSource(const TableSource&) = delete;
  TableSource& operator=(const TableSource&) = delete;
  virtual ~TableSource() = default;

  [[nodiscard]] virtual const std::filesystem::path& path() const = 0;
  /// Of the columns, in their order. A CSV without header: the fields of its first row.
  [[nodiscard]] virtual const std::vector<std::string>& names() const = 0;
  /// Where an error of the names is: "run.csv:1", "run.npz".
  [[nodiscard]] virtual std::string place_of_names() const = 0;
  /// "line 12", "row 11".
  [[nodiscard]] virtual std::string name_of(std::size_t row) const = 0;
  /// The same with the file: "run.csv:12", "run.npz: row 11".
  [[nodiscard]] virtual std::string place_of(std::size_t row) const = 0;
  /// Why the file has something of that name that is no column; empty if it has none.
  [[nodiscard]] virtual std::string why_left_out(const std::string& name) const = 0;
  /// Stamps that the rows have beside their columns, or none.
  [[nodiscard]] virtual std::span<const std::int64_t> stamps_ns() const = 0;

  /// Rows of the wanted columns; `columns` has one entry per name. Errors: they differ in length.
  [[nodiscard]] virtual core::Result<std::size_t> rows(
      std::span<const BoundColumn> columns) const = 0;
  /// Reads all rows. With `stop_at_bad` the result holds only the first bad row and what else is
  /// in the output is unspecified; without, values of bad rows are unspecified.
  virtual core::Result<std::vector<BadRow>> parse(std::span<const BoundColumn> columns,
                                                  const ColumnOutput& output,
                                                  bool stop_at_bad) const = 0;
};

}  // namespace ravencal::record
