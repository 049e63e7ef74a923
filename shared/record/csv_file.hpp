// SPDX-License-Identifier: Apache-2.0
//
// Numbers out of a large CSV file, by all cores; without a copy of the file where it is plain
// (csv_dialect.hpp). Private to record/.
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

  /// The fields of the first line, without blanks and quotes around them. Errors (kData): quotes
  /// that do not end.
  core::Result<std::vector<std::string>> first_line() const;

  /// Bytes in plain form up to and without the line ends that close the file.
  [[nodiscard]] std::uint64_t size() const { return size_; }
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

  /// Reads [offset, offset + count) of the plain form whole.
  core::Status read(std::uint64_t offset, char* buffer, std::size_t count) const;

 private:
  CsvFile(std::filesystem::path path, int descriptor) : path_(std::move(path)), file_(descriptor) {}
  core::Status find_end();
  /// Leaves the byte order mark out; turns UTF-16 into UTF-8.
  core::Status settle_encoding();
  /// Turns what is not plain into plain form.
  core::Status settle_dialect();
  core::Result<std::string> read_all() const;
  /// Whole lines, at least `lines` if there are so many.
  core::Result<std::string> beginning(std::size_t lines) const;

  std::filesystem::path path_;
  int file_;
  std::uint64_t begin_ = 0;  ///< in the file
  std::uint64_t size_ = 0;
  std::optional<std::string> text_;  ///< the plain form of a file that is not
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
