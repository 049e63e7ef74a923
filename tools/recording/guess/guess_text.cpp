// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "core/toml_table.hpp"
#include "guess/guess.hpp"

namespace ravencal::guess {
namespace {

/// `key = "header name"`, or the column's number where the file has no header.
std::string place(const record::Table& table, std::size_t column, std::string_view by_name,
                  std::string_view by_number) {
  if (!table.has_header) return fmt::format("{} = {}\n", by_number, column);
  return fmt::format("{} = {}\n", by_name, core::toml_text(table.columns[column].name));
}

std::string clock_text(const Guess& guess, const record::Table& table) {
  const record::Clock& clock = guess.clock;
  std::string text = fmt::format("time_unit = {}\n", core::toml_text(clock.unit));
  if (guess.time_fraction) {
    text += place(table, *guess.time_fraction, "time_fraction", "time_fraction");
    text += fmt::format("time_fraction_unit = {}\n", core::toml_text(clock.fraction_unit));
  }
  if (clock.wraps_at > 0.0) text += fmt::format("time_wraps_at = {}\n", clock.wraps_at);
  if (clock.rounded_to > 0.0) text += fmt::format("time_rounded_to = {}\n", clock.rounded_to);
  if (clock.drops_bad) text += "bad_stamps = \"drop\"\n";
  if (guess.time_restarts) text += "time_restarts = true\n";
  if (guess.time_unit_assumed)
    text += "assumed = true  # no word says time_unit; delete this line when it is right\n";
  return text;
}

}  // namespace

std::string profile_text(const Guess& guess, const record::Table& table) {
  using core::toml_text;
  std::string text = fmt::format(
      "# What the columns of {} are, guessed from their names and values: correct what is wrong.\n",
      table.path.filename().string());
  auto out = std::back_inserter(text);
  for (const std::string& question : guess.questions)
    fmt::format_to(out, "# Check: {}\n", question);
  text += "\n[source]\nformat = \"csv\"\n";
  if (!table.has_header) text += "header = false\n";
  if (guess.time_column) {
    text += place(table, *guess.time_column, "time", "time");
    text += clock_text(guess, table);
  } else if (table.t_ns.empty()) {
    fmt::format_to(
        out,
        "row_period_s = {:g}\n"
        "assumed = true  # no column is a time; delete this line when the period is right\n",
        guess.row_period_s);
  }
  for (const GuessedChannel& channel : guess.channels) {
    text += "\n";
    if (!channel.because.empty()) fmt::format_to(out, "# {}\n", channel.because);
    fmt::format_to(out, "[[channel]]\nname = {}\n{}unit = {}\n", toml_text(channel.name),
                   place(table, channel.column, "column", "index"), toml_text(channel.unit));
    if (channel.scale != 1.0) fmt::format_to(out, "scale = {}\n", channel.scale);
    if (channel.wraps_at > 0.0) fmt::format_to(out, "wraps_at = {}\n", channel.wraps_at);
    fmt::format_to(out, "role = {}\n", toml_text(channel.role));
    if (!channel.joint.empty()) fmt::format_to(out, "joint = {}\n", toml_text(channel.joint));
    if (channel.may_be_missing) text += "may_be_missing = true\n";
    if (channel.assumed) text += "assumed = true  # see Check; delete this line when it is right\n";
  }
  return text;
}

std::string describe(const Guess& guess, const record::Table& table) {
  std::string text;
  auto out = std::back_inserter(text);
  std::size_t width = 6;
  for (const GuessedChannel& channel : guess.channels)
    width = std::max(width, table.columns[channel.column].name.size());
  std::string time = table.t_ns.empty() ? "no time" : "stamps of the messages";
  if (guess.time_column) {
    time = fmt::format("time {} in {}{}", table.columns[*guess.time_column].name, guess.clock.unit,
                       guess.time_unit_assumed ? " (assumed)" : "");
  }
  if (guess.time_fraction) {
    time += fmt::format(" and {} in {}", table.columns[*guess.time_fraction].name,
                        guess.clock.fraction_unit);
  }
  fmt::format_to(out, "{}: {} rows, {}, {:.4g} Hz\n", table.path.string(), guess.rows, time,
                 1.0 / guess.row_period_s);
  fmt::format_to(out, "{:<{}}  {:<16}  {:<14}  {:<10}  {}\n", "column", width, "role", "joint",
                 "unit", "because");
  for (const GuessedChannel& channel : guess.channels) {
    const std::string unit =
        channel.scale == 1.0 ? channel.unit : fmt::format("{:g} {}", channel.scale, channel.unit);
    fmt::format_to(out, "{:<{}}  {:<16}  {:<14}  {:<10}  {}{}\n",
                   table.columns[channel.column].name, width, channel.role, channel.joint, unit,
                   channel.because.empty() ? "its name" : channel.because,
                   channel.assumed ? "; the rest is assumed, see To check" : "");
  }
  for (const LeftColumn& left : guess.left_out)
    fmt::format_to(out, "left out: {} ({})\n", table.columns[left.column].name, left.why);
  if (!guess.questions.empty()) text += "To check:\n";
  for (std::size_t i = 0; i < guess.questions.size(); ++i)
    fmt::format_to(out, "{:>3}. {}\n", i + 1, guess.questions[i]);
  return text;
}

}  // namespace ravencal::guess
