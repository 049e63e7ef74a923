// SPDX-License-Identifier: Apache-2.0
#include "record/csv_load.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <memory>
#include <optional>

#include "record/csv_file.hpp"
#include "record/csv_number.hpp"
#include "record/table_binding.hpp"
#include "record/table_load.hpp"

namespace ravencal::record {
namespace {

class CsvSource final : public TableSource {
 public:
  /// Without `has_header`: a first line of numbers alone is none.
  static core::Result<std::unique_ptr<CsvSource>> open(const std::filesystem::path& path,
                                                       std::optional<bool> has_header,
                                                       unsigned threads) {
    RAVENCAL_ASSIGN_OR_RETURN(CsvFile file, CsvFile::open(path));
    RAVENCAL_ASSIGN_OR_RETURN(std::vector<std::string> names, file.first_line());
    if (!has_header) {
      has_header = !std::all_of(names.begin(), names.end(), [](const std::string& field) {
        return number_of(field).has_value();
      });
    }
    std::unique_ptr<CsvSource> source(
        new CsvSource(std::move(file), std::move(names), *has_header));
    RAVENCAL_ASSIGN_OR_RETURN(source->rows_, CsvRows::count(source->file_, *has_header, threads));
    return source;
  }

  [[nodiscard]] bool has_header() const { return has_header_; }
  [[nodiscard]] const std::filesystem::path& path() const override { return file_.path(); }
  [[nodiscard]] const std::vector<std::string>& names() const override { return names_; }
  [[nodiscard]] std::string place_of_names() const override {
    return fmt::format("{}:1", path().string());
  }
  [[nodiscard]] std::string name_of(std::size_t row) const override {
    return fmt::format("line {}", line_of(row));
  }
  [[nodiscard]] std::string place_of(std::size_t row) const override {
    return fmt::format("{}:{}", path().string(), line_of(row));
  }
  [[nodiscard]] std::string why_left_out(const std::string&) const override { return {}; }
  [[nodiscard]] std::span<const std::int64_t> stamps_ns() const override { return {}; }
  [[nodiscard]] core::Result<std::size_t> rows(std::span<const BoundColumn>) const override {
    return rows_->rows();
  }
  core::Result<std::vector<BadRow>> parse(std::span<const BoundColumn> columns,
                                          const ColumnOutput& output,
                                          bool stop_at_bad) const override {
    return rows_->parse(columns, output, stop_at_bad);
  }

 private:
  CsvSource(CsvFile file, std::vector<std::string> names, bool has_header)
      : file_(std::move(file)), names_(std::move(names)), has_header_(has_header) {}
  [[nodiscard]] std::size_t line_of(std::size_t row) const { return row + (has_header_ ? 2 : 1); }

  CsvFile file_;
  std::vector<std::string> names_;
  bool has_header_;
  std::optional<CsvRows> rows_;
};

constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();

/// Reads all columns as numbers, and again those that turn out to hold words as such.
class CsvTableReader {
 public:
  CsvTableReader(const CsvSource& source, std::size_t rows)
      : source_(source), columns_(source.names().size()) {
    table_.path = source.path();
    table_.has_header = source.has_header();
    table_.columns.resize(columns_.size());
    for (std::size_t i = 0; i < columns_.size(); ++i) {
      columns_[i].number = i;
      columns_[i].may_be_missing = true;
      TableColumn& column = table_.columns[i];
      column.name = table_.has_header ? source.names()[i] : std::to_string(i);
      column.values.resize(rows);
      output_.numbers.push_back(column.values.data());
      output_.factors.push_back(1.0);
    }
  }

  core::Result<Table> read(bool skip_bad) {
    std::vector<BadRow> bad;
    do {
      RAVENCAL_ASSIGN_OR_RETURN(bad, source_.parse(columns_, output_, false));
    } while (found_words(bad));
    if (!bad.empty() && !skip_bad) {
      return core::data_error(fmt::format("{}: {}; use --skip-bad to drop such rows",
                                          source_.place_of(bad.front().row), bad.front().why));
    }
    for (TableColumn& column : table_.columns) {
      for (std::size_t row = 0; row < column.texts.size(); ++row)
        column.values[row] = number_of(column.texts[row]).value_or(kNoNumber);
      drop(bad, column.values);
      if (!column.texts.empty()) drop(bad, column.texts);
    }
    for (const BadRow& row : bad)
      table_.events.push_back(
          {0, "drop", fmt::format("{}: {}", source_.name_of(row.row), row.why)});
    return std::move(table_);
  }

 private:
  /// True if a column was read as numbers that holds more; it is one of words from now on.
  bool found_words(const std::vector<BadRow>& bad) {
    bool found = false;
    for (const BadRow& row : bad) {
      if (!row.column || columns_[*row.column].word) continue;
      found = true;
      columns_[*row.column].number.reset();
      columns_[*row.column].word = output_.words.size();
      TableColumn& column = table_.columns[*row.column];
      column.texts.resize(column.values.size());
      output_.words.push_back(column.texts.data());
    }
    return found;
  }

  template <typename T>
  static void drop(const std::vector<BadRow>& bad, std::vector<T>& values) {
    std::size_t kept = 0;
    auto next_bad = bad.begin();
    for (std::size_t row = 0; row < values.size(); ++row) {
      if (next_bad != bad.end() && next_bad->row == row) {
        ++next_bad;
      } else {
        std::swap(values[kept++], values[row]);
      }
    }
    values.resize(kept);
  }

  const CsvSource& source_;
  std::vector<BoundColumn> columns_;
  ColumnOutput output_;
  Table table_;
};

}  // namespace

core::Result<Recording> load_csv(const std::filesystem::path& path, Profile profile,
                                 const LoadOptions& options) {
  RAVENCAL_ASSIGN_OR_RETURN(const auto source,
                            CsvSource::open(path, profile.header, options.threads));
  return load_source(*source, std::move(profile), options);
}

core::Result<Table> read_csv_table(const std::filesystem::path& path, const LoadOptions& options) {
  RAVENCAL_ASSIGN_OR_RETURN(const auto source, CsvSource::open(path, {}, options.threads));
  if (source->has_header()) RAVENCAL_RETURN_IF_ERROR(check_names_differ(*source));
  RAVENCAL_ASSIGN_OR_RETURN(const std::size_t rows, source->rows({}));
  return CsvTableReader(*source, rows).read(options.skip_bad);
}

}  // namespace ravencal::record
