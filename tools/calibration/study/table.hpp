// SPDX-License-Identifier: Apache-2.0
//
// One table of results, as the studies make them: a figure per cell with its spread over seeds, its
// 95 % interval, a mark and somebody else's figure beside it. The same table is written as JSON
// (for the page), CSV (one line per cell, for programs), Markdown and LaTeX (booktabs, the paper's
// own form). Any thread. Figures are in the column's display unit.
#pragma once

#include <filesystem>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "core/result.hpp"

namespace ravencal::study {

inline constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

/// What a reader should notice about a cell.
enum class Mark {
  kNone,
  kWorse,  ///< e.g. the paper's bold: an error that rose by more than 30 %
  kBest    ///< e.g. the best method of a column
};

/// One result. What is kUnknown is left out; a cell with neither text nor mean is a dash.
struct Cell {
  double mean = kUnknown;
  double deviation = kUnknown;  ///< standard deviation over seeds
  double low = kUnknown;        ///< 95 % interval of the mean
  double high = kUnknown;
  double theirs = kUnknown;  ///< somebody else's figure for the same thing (Table::theirs_label)
  Mark mark = Mark::kNone;
  std::string text;  ///< shown in place of the figure, e.g. "yes" or "not run"
};

/// Neighbouring columns of one non-empty `group` share a heading above theirs.
struct Column {
  std::string title;
  std::string unit;   ///< "deg", "mm", "s", "%", ...; may be empty
  std::string group;  ///< e.g. "500 g"; may be empty
  int decimals = -1;  ///< of the figures; negative: three significant digits of the least one
};

struct Row {
  std::string title;
  std::vector<Cell> cells;  ///< as many as the table has columns
  bool rule_above = false;  ///< a line sets this row off from the one before
};

struct Table {
  std::string id;         ///< file-safe name, also LaTeX label and id on the page, e.g. "removal"
  std::string title;      ///< caption
  std::string row_title;  ///< heading of the first column, e.g. "without"
  std::string note;       ///< below the table: what the marks and intervals mean; may be empty
  std::string theirs_label;  ///< whose `theirs` figures are, e.g. "theirs: arXiv 2302.04999, robot"
  std::vector<Column> columns;
  std::vector<Row> rows;
};

/// What study_table() of report/page/draw.js shows: id, title, row_title, columns, rows, notes.
/// Columns have their decimals, unknown figures are NaN, which is written as null.
nlohmann::ordered_json table_json(const Table& table);
/// GitHub's pipe table below a bold caption; the row title of a column group is `group: title`.
std::string to_markdown(const Table& table);
/// Columns of even width for a terminal, one block per column group; a mark is `*`, `theirs` is in
/// parentheses. Intervals are left out.
std::string to_text(const Table& table);
/// A floating table; needs \usepackage{booktabs} and, for interval text, nothing else.
std::string to_latex(const Table& table);
/// RFC 4180 with one line per cell:
/// table,row,group,column,unit,mean,deviation,low,high,theirs,mark, text. Unknown figures are
/// empty; figures are given with all their digits.
std::string to_csv(std::span<const Table> tables);
/// Writes STEM.txt, STEM.csv, STEM.md below `preface` and STEM.tex, each whole. Errors: kIo.
core::Status write_tables(std::span<const Table> tables, const std::filesystem::path& stem,
                          const std::string& preface);

/// Decimals that the figures of column `index` are shown with.
int decimals_of(const Table& table, std::size_t index);

}  // namespace ravencal::study
