// SPDX-License-Identifier: Apache-2.0
#include "record/table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "record/csv_number.hpp"
#include "record/table_load.hpp"

namespace ravencal::record {
namespace {

class ArraySource final : public TableSource {
 public:
  explicit ArraySource(const Table& table) : table_(table) {
    for (const TableColumn& column : table.columns) names_.push_back(column.name);
  }

  [[nodiscard]] const std::filesystem::path& path() const override { return table_.path; }
  [[nodiscard]] const std::vector<std::string>& names() const override { return names_; }
  [[nodiscard]] std::string place_of_names() const override { return table_.path.string(); }
  [[nodiscard]] std::string name_of(std::size_t row) const override {
    return fmt::format("row {}", row);
  }
  [[nodiscard]] std::string place_of(std::size_t row) const override {
    return fmt::format("{}: row {}", table_.path.string(), row);
  }
  [[nodiscard]] std::string why_left_out(const std::string& name) const override {
    const auto it = table_.left_out.find(name);
    return it == table_.left_out.end() ? "" : it->second;
  }
  [[nodiscard]] std::span<const std::int64_t> stamps_ns() const override { return table_.t_ns; }
  [[nodiscard]] core::Result<std::size_t> rows(std::span<const BoundColumn> columns) const override;
  core::Result<std::vector<BadRow>> parse(std::span<const BoundColumn> columns,
                                          const ColumnOutput& output,
                                          bool stop_at_bad) const override;

 private:
  const Table& table_;
  std::vector<std::string> names_;
};

core::Result<std::size_t> ArraySource::rows(std::span<const BoundColumn> columns) const {
  const TableColumn* first = nullptr;
  for (std::size_t i = 0; i < columns.size(); ++i) {
    if (!columns[i].is_wanted()) continue;
    const TableColumn& column = table_.columns[i];
    if (first == nullptr) first = &column;
    if (column.values.size() == first->values.size()) continue;
    return core::data_error(
        fmt::format("{}: '{}' has {} values and '{}' has {}; the columns of a recording are of one "
                    "length, so bind those that were recorded together",
                    table_.path.string(), first->name, first->values.size(), column.name,
                    column.values.size()));
  }
  const std::size_t count = first == nullptr ? 0 : first->values.size();
  if (first != nullptr && !table_.t_ns.empty() && table_.t_ns.size() != count) {
    return core::data_error(fmt::format("{}: '{}' has {} values and there are {} stamps",
                                        table_.path.string(), first->name, count,
                                        table_.t_ns.size()));
  }
  return count;
}

core::Result<std::vector<BadRow>> ArraySource::parse(std::span<const BoundColumn> columns,
                                                     const ColumnOutput& output,
                                                     bool stop_at_bad) const {
  std::vector<BadRow> bad;
  std::vector<char> is_bad(columns.empty() ? 0 : *rows(columns), 0);
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const TableColumn& column = table_.columns[i];
    for (std::size_t row = 0; row < is_bad.size() && columns[i].is_wanted(); ++row) {
      const double value = column.values[row];
      const std::string* const text = column.texts.empty() ? nullptr : &column.texts[row];
      if (columns[i].word)
        output.words[*columns[i].word][row] = text != nullptr ? *text : fmt::format("{}", value);
      if (!columns[i].number) continue;
      const bool is_lost = text != nullptr ? trimmed(*text).empty() : std::isnan(value);
      if (!std::isfinite(value) && !(is_lost && columns[i].may_be_missing) && !is_bad[row]) {
        is_bad[row] = 1;
        bad.push_back(
            {row,
             fmt::format("column '{}' ({}): '{}' is not a number", column.name, columns[i].name,
                         text != nullptr ? text->substr(0, 40) : fmt::format("{}", value)),
             i});
      }
      output.numbers[*columns[i].number][row] = value * output.factors[*columns[i].number];
    }
  }
  std::sort(bad.begin(), bad.end(), [](const BadRow& a, const BadRow& b) { return a.row < b.row; });
  if (stop_at_bad && bad.size() > 1) bad.resize(1);
  return bad;
}

}  // namespace

core::Result<Recording> load_table(const Table& table, Profile profile,
                                   const LoadOptions& options) {
  RAVENCAL_ASSIGN_OR_RETURN(Recording recording,
                            load_source(ArraySource(table), std::move(profile), options));
  if (!table.note.empty()) recording.meta["joined"] = table.note;
  if (!table.events.empty()) {
    const auto dropped = recording.meta.find("dropped_rows");
    const double rows = dropped == recording.meta.end() ? 0.0 : *number_of(dropped->second);
    recording.meta["dropped_rows"] =
        fmt::format("{}", rows + static_cast<double>(table.events.size()));
  }
  recording.events.insert(recording.events.end(), table.events.begin(), table.events.end());
  std::stable_sort(recording.events.begin(), recording.events.end(),
                   [](const Event& a, const Event& b) { return a.t_ns < b.t_ns; });
  return recording;
}

}  // namespace ravencal::record
