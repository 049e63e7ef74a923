// SPDX-License-Identifier: Apache-2.0
//
// Numbers out of a large CSV file, by all cores, without a copy of the file. Private to record/.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"
#include "record/table_source.hpp"

namespace ravencal::record {

/// An open CSV file. All calls are thread-safe.
class CsvFile {
 public:
  static core::Result<CsvFile> open(const std::filesystem::path& path);
  CsvFile(CsvFile&& other) noexcept;
  CsvFile& operator=(CsvFile&&) = delete;
  CsvFile(const CsvFile&) = delete;
  CsvFile& operator=(const CsvFile&) = delete;
  ~CsvFile();

  /// The fields of the first line, without blanks and quotes around them.
  core::Result<std::vector<std::string>> first_line() const;

  /// Bytes up to and without the line ends that close the file.
  [[nodiscard]] std::uint64_t size() const { return size_; }
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

  /// Reads [offset, offset + count) whole.
  core::Status read(std::uint64_t offset, char* buffer, std::size_t count) const;

 private:
  CsvFile(std::filesystem::path path, int descriptor) : path_(std::move(path)), file_(descriptor) {}
  core::Status find_end();

  std::filesystem::path path_;
  int file_;
  std::uint64_t size_ = 0;
};

/// The rows of one CSV file: finds how many there are, then parses them into the output.
class CsvRows {
 public:
  /// Counts the rows after the header. `threads` 0 = all cores.
  static core::Result<CsvRows> count(const CsvFile& file, bool header, unsigned threads);

  [[nodiscard]] std::size_t rows() const { return rows_; }

  /// Parses all rows. With `stop_at_bad` the result holds only the first bad row and what else is
  /// in the output is unspecified; without, values of bad rows are unspecified.
  core::Result<std::vector<BadRow>> parse(std::span<const BoundColumn> columns,
                                          const ColumnOutput& output, bool stop_at_bad) const;

 private:
  explicit CsvRows(const CsvFile& file) : file_(&file) {}
  const CsvFile* file_;
  std::uint64_t begin_ = 0;  ///< of the first row
  std::size_t rows_ = 0;
  unsigned threads_ = 1;
  std::vector<std::size_t> line_ends_before_;  ///< per chunk
};

}  // namespace ravencal::record
