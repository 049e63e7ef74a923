// SPDX-License-Identifier: Apache-2.0
#include "study/table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string_view>

#include "core/whole_file.hpp"
#include "report/tables.hpp"

namespace ravencal::study {
namespace {

constexpr std::string_view kDash = "–";

bool known(double value) { return std::isfinite(value); }

/// A cell's parts as text; empty where unknown.
struct CellText {
  std::string figure;
  std::string deviation;
  std::string interval;
  std::string theirs;
};

CellText text_of(const Cell& cell, int decimals) {
  CellText text;
  text.figure = cell.text;
  if (text.figure.empty()) {
    text.figure = known(cell.mean) ? fmt::format("{:.{}f}", cell.mean, decimals) : kDash;
    if (known(cell.mean) && known(cell.deviation)) {
      text.deviation = fmt::format("{:.{}f}", cell.deviation, decimals);
    }
  }
  if (known(cell.low) && known(cell.high)) {
    text.interval = fmt::format("{:.{}f} to {:.{}f}", cell.low, decimals, cell.high, decimals);
  }
  if (known(cell.theirs)) text.theirs = fmt::format("{:.{}f}", cell.theirs, decimals);
  return text;
}

std::string heading_of(const Column& column) {
  return column.unit.empty() ? column.title : fmt::format("{} [{}]", column.title, column.unit);
}

/// Runs of columns under one group heading; a column without group is a run of its own.
struct GroupRun {
  std::string group;
  std::size_t first = 0;
  std::size_t count = 0;
};

std::vector<GroupRun> groups_of(const Table& table) {
  std::vector<GroupRun> runs;
  for (std::size_t i = 0; i < table.columns.size(); ++i) {
    const std::string& group = table.columns[i].group;
    if (!runs.empty() && !group.empty() && runs.back().group == group) {
      ++runs.back().count;
    } else {
      runs.push_back({group, i, 1});
    }
  }
  return runs;
}

bool has_groups(const Table& table) {
  return std::any_of(table.columns.begin(), table.columns.end(),
                     [](const Column& column) { return !column.group.empty(); });
}

bool shows_theirs(const Table& table) {
  return std::any_of(table.rows.begin(), table.rows.end(), [](const Row& row) {
    return std::any_of(row.cells.begin(), row.cells.end(),
                       [](const Cell& cell) { return known(cell.theirs); });
  });
}

std::vector<std::string> notes_of(const Table& table) {
  std::vector<std::string> notes;
  if (!table.note.empty()) notes.push_back(table.note);
  if (!table.theirs_label.empty() && shows_theirs(table)) {
    notes.push_back("In parentheses, " + table.theirs_label + ".");
  }
  return notes;
}

std::string_view name_of(Mark mark) {
  switch (mark) {
    case Mark::kWorse:
      return "worse";
    case Mark::kBest:
      return "best";
    case Mark::kNone:
      break;
  }
  return "";
}

// ------------------------------------------------------------------ Markdown

std::string markdown_escape(std::string_view text) {
  std::string escaped;
  for (const char c : text) {
    if (c == '|' || c == '*' || c == '_' || c == '<' || c == '`' || c == '\\') escaped += '\\';
    escaped += c == '\n' ? ' ' : c;
  }
  return escaped;
}

std::string cell_markdown(const Cell& cell, int decimals) {
  const CellText text = text_of(cell, decimals);
  std::string markdown = markdown_escape(text.figure);
  if (!text.deviation.empty()) markdown += " ± " + text.deviation;
  if (cell.mark != Mark::kNone) markdown = "**" + markdown + "**";
  if (!text.interval.empty()) markdown += " [" + text.interval + "]";
  if (!text.theirs.empty()) markdown += " (" + text.theirs + ")";
  return markdown;
}

// ------------------------------------------------------------------ text

std::string cell_plain(const Cell& cell, int decimals) {
  const CellText text = text_of(cell, decimals);
  std::string plain = text.figure;
  if (!text.deviation.empty()) plain += " ±" + text.deviation;
  if (!text.theirs.empty()) plain += " (" + text.theirs + ")";
  return plain + (cell.mark == Mark::kNone ? " " : "*");
}

/// Characters of UTF-8 text, each as wide as the next.
std::size_t width_of(std::string_view text) {
  return static_cast<std::size_t>(std::count_if(text.begin(), text.end(), [](char c) {
    return (static_cast<unsigned char>(c) >> 6U) != 2U;
  }));
}

/// One column group: titles to the left, figures to the right, as wide as they need.
std::string block_text(const Table& table, const GroupRun& run) {
  std::vector<std::vector<std::string>> lines(table.rows.size() + 1);
  lines.front().push_back(run.group.empty() ? table.row_title : run.group);
  for (std::size_t r = 0; r < table.rows.size(); ++r) lines[r + 1].push_back(table.rows[r].title);
  for (std::size_t i = run.first; i < run.first + run.count; ++i) {
    lines.front().push_back(heading_of(table.columns[i]) + " ");
    for (std::size_t r = 0; r < table.rows.size(); ++r) {
      lines[r + 1].push_back(cell_plain(table.rows[r].cells[i], decimals_of(table, i)));
    }
  }
  std::vector<std::size_t> widths(lines.front().size(), 0);
  for (const auto& line : lines) {
    for (std::size_t i = 0; i < line.size(); ++i) {
      widths[i] = std::max(widths[i], width_of(line[i]));
    }
  }
  std::string text;
  for (const auto& line : lines) {
    std::string row;
    for (std::size_t i = 0; i < line.size(); ++i) {
      const std::string space(widths[i] - width_of(line[i]), ' ');
      row += i == 0 ? line[i] + space : "  " + space + line[i];
    }
    text += row.substr(0, row.find_last_not_of(' ') + 1) + "\n";
  }
  return text;
}

// ------------------------------------------------------------------ LaTeX

std::string latex_escape(std::string_view text) {
  std::string escaped;
  for (const char c : text) {
    switch (c) {
      case '\\':
        escaped += "\\textbackslash{}";
        break;
      case '~':
        escaped += "\\textasciitilde{}";
        break;
      case '^':
        escaped += "\\textasciicircum{}";
        break;
      case '&':
      case '%':
      case '$':
      case '#':
      case '_':
      case '{':
      case '}':
        escaped += '\\';
        escaped += c;
        break;
      default:
        escaped += c;
    }
  }
  return escaped;
}

std::string cell_latex(const Cell& cell, int decimals) {
  const CellText text = text_of(cell, decimals);
  std::string latex = text.figure == kDash ? "--" : latex_escape(text.figure);
  if (!text.deviation.empty()) latex += fmt::format(" $\\pm$ {}", text.deviation);
  if (cell.mark != Mark::kNone) latex = "\\textbf{" + latex + "}";
  if (!text.theirs.empty()) latex += " (" + text.theirs + ")";
  return latex;
}

/// The line of group headings with a rule below each.
std::string group_line_latex(const Table& table) {
  std::string heads;
  std::string rules;
  for (const GroupRun& run : groups_of(table)) {
    heads += fmt::format(" & \\multicolumn{{{}}}{{c}}{{{}}}", run.count, latex_escape(run.group));
    if (!run.group.empty()) {
      rules += fmt::format("\\cmidrule(lr){{{}-{}}}", run.first + 2, run.first + run.count + 1);
    }
  }
  return heads + " \\\\\n" + rules + "\n";
}

// ------------------------------------------------------------------ CSV

std::string csv_field(std::string_view text) {
  if (text.find_first_of(",\"\r\n") == std::string_view::npos) return std::string(text);
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"') quoted += '"';
    quoted += c;
  }
  return quoted + '"';
}

std::string csv_number(double value) { return known(value) ? fmt::format("{}", value) : ""; }

}  // namespace

int decimals_of(const Table& table, std::size_t index) {
  if (table.columns[index].decimals >= 0) return table.columns[index].decimals;
  double least = kUnknown;
  for (const Row& row : table.rows) {
    const double mean = std::abs(row.cells[index].mean);
    if (known(mean) && mean > 0.0) least = known(least) ? std::min(least, mean) : mean;
  }
  return report::decimals_for(least);
}

nlohmann::ordered_json table_json(const Table& table) {
  using Json = nlohmann::ordered_json;
  Json columns = Json::array(), rows = Json::array();
  for (std::size_t i = 0; i < table.columns.size(); ++i) {
    const Column& column = table.columns[i];
    columns.push_back({{"title", column.title},
                       {"unit", column.unit},
                       {"group", column.group},
                       {"decimals", decimals_of(table, i)}});
  }
  for (const Row& row : table.rows) {
    Json cells = Json::array();
    for (const Cell& cell : row.cells) {
      cells.push_back({{"mean", cell.mean},
                       {"deviation", cell.deviation},
                       {"ci95", {cell.low, cell.high}},
                       {"theirs", cell.theirs},
                       {"mark", name_of(cell.mark)},
                       {"text", cell.text}});
    }
    rows.push_back(
        {{"title", row.title}, {"rule_above", row.rule_above}, {"cells", std::move(cells)}});
  }
  return {{"id", table.id},
          {"title", table.title},
          {"row_title", table.row_title},
          {"columns", std::move(columns)},
          {"rows", std::move(rows)},
          {"notes", notes_of(table)}};
}

std::string to_markdown(const Table& table) {
  std::string markdown =
      "**" + markdown_escape(table.title) + "**\n\n| " + markdown_escape(table.row_title) + " |";
  std::string rule = "|---|";
  for (const Column& column : table.columns) {
    const std::string group = column.group.empty() ? "" : column.group + ": ";
    markdown += " " + markdown_escape(group + heading_of(column)) + " |";
    rule += "--:|";
  }
  markdown += "\n" + rule + "\n";
  for (const Row& row : table.rows) {
    markdown += "| " + markdown_escape(row.title) + " |";
    for (std::size_t i = 0; i < row.cells.size(); ++i) {
      markdown += " " + cell_markdown(row.cells[i], decimals_of(table, i)) + " |";
    }
    markdown += "\n";
  }
  for (const std::string& note : notes_of(table)) markdown += "\n" + markdown_escape(note) + "\n";
  return markdown;
}

std::string to_text(const Table& table) {
  std::string text = table.title + "\n";
  std::vector<GroupRun> runs;
  for (const GroupRun& run : groups_of(table)) {
    if (run.group.empty() && !runs.empty() && runs.back().group.empty()) {
      runs.back().count += run.count;
    } else {
      runs.push_back(run);
    }
  }
  for (const GroupRun& run : runs) text += "\n" + block_text(table, run);
  for (const std::string& note : notes_of(table)) text += "\n" + note + "\n";
  return text;
}

std::string to_latex(const Table& table) {
  std::string latex = fmt::format(
      "\\begin{{table}}\n\\centering\n\\caption{{{}}}\n\\label{{tab:{}}}\n"
      "\\begin{{tabular}}{{l{}}}\n\\toprule\n",
      latex_escape(table.title), table.id, std::string(table.columns.size(), 'r'));
  if (has_groups(table)) latex += group_line_latex(table);
  latex += latex_escape(table.row_title);
  for (const Column& column : table.columns) latex += " & " + latex_escape(heading_of(column));
  latex += " \\\\\n\\midrule\n";
  for (const Row& row : table.rows) {
    if (row.rule_above && &row != &table.rows.front()) latex += "\\midrule\n";
    latex += latex_escape(row.title);
    for (std::size_t i = 0; i < row.cells.size(); ++i) {
      latex += " & " + cell_latex(row.cells[i], decimals_of(table, i));
    }
    latex += " \\\\\n";
  }
  latex += "\\bottomrule\n\\end{tabular}\n";
  for (const std::string& note : notes_of(table)) {
    latex += "\\par\\smallskip{\\footnotesize " + latex_escape(note) + "}\n";
  }
  return latex + "\\end{table}\n";
}

std::string to_csv(std::span<const Table> tables) {
  std::string csv = "table,row,group,column,unit,mean,deviation,low,high,theirs,mark,text\n";
  for (const Table& table : tables) {
    for (const Row& row : table.rows) {
      for (std::size_t i = 0; i < row.cells.size(); ++i) {
        const Column& column = table.columns[i];
        const Cell& cell = row.cells[i];
        csv += fmt::format("{},{},{},{},{},{},{},{},{},{},{},{}\n", csv_field(table.id),
                           csv_field(row.title), csv_field(column.group), csv_field(column.title),
                           csv_field(column.unit), csv_number(cell.mean),
                           csv_number(cell.deviation), csv_number(cell.low), csv_number(cell.high),
                           csv_number(cell.theirs), name_of(cell.mark), csv_field(cell.text));
      }
    }
  }
  return csv;
}

core::Status write_tables(std::span<const Table> tables, const std::filesystem::path& stem,
                          const std::string& preface) {
  std::string markdown = preface;
  std::string latex;
  std::string text;
  for (const Table& table : tables) {
    text += to_text(table) + "\n";
    markdown += to_markdown(table) + "\n";
    latex += to_latex(table) + "\n";
  }
  const auto write = [&](const char* ending, const std::string& content) {
    return core::write_whole_file(stem.string() + ending, content);
  };
  RAVENCAL_RETURN_IF_ERROR(write(".csv", to_csv(tables)));
  RAVENCAL_RETURN_IF_ERROR(write(".txt", text));
  RAVENCAL_RETURN_IF_ERROR(write(".md", markdown));
  return write(".tex", latex);
}

}  // namespace ravencal::study
