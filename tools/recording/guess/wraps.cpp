// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "guess/columns.hpp"
#include "guess/wrap_width.hpp"
#include "record/relation.hpp"
#include "record/unwrap.hpp"

namespace ravencal::guess {
namespace {

Eigen::VectorXd unwrapped(const Columns& columns, const Column& column, double width,
                          std::size_t& wraps) {
  std::vector<std::int64_t> t_ns;
  for (const double t_s : columns.t_s) t_ns.push_back(std::llround(t_s * record::kNsPerS));
  Eigen::VectorXd values = column.values;
  wraps = record::unwrap({values.data(), t_ns.size()}, t_ns, width);
  return values;
}

/// A command may well step or start its ramp again: it wraps where that brings it nearer to what
/// was measured. Where nothing was, it wraps at a width that counters have.
bool answers_agree(const Columns& columns, const Column& command, const Eigen::VectorXd& values,
                   bool estimated) {
  double as_read = 0.0, unwrapped = 0.0;
  for (const Column& answer : columns.all) {
    if (!answer.is(Quantity::kPosition) || answer.said.side == Side::kCommand) continue;
    if (answer.said.joint != command.said.joint) continue;
    if (const auto line = record::line_through(answer.values, command.values))
      as_read = std::max(as_read, std::abs(line->correlation));
    if (const auto line = record::line_through(answer.values, values))
      unwrapped = std::max(unwrapped, std::abs(line->correlation));
  }
  return unwrapped == as_read ? !estimated : unwrapped > as_read;
}

void unwrap_column(Columns& columns, Column& column) {
  const auto wrap = wrap_of(column.values, column.whole_numbers, column.said.unit);
  if (!wrap) return;
  std::size_t wraps = 0;
  Eigen::VectorXd values = unwrapped(columns, column, wrap->width, wraps);
  const bool is_command = column.said.side == Side::kCommand;
  if (is_command && !answers_agree(columns, column, values, wrap->estimated)) return;
  column.as_read = std::exchange(column.values, std::move(values));
  column.wraps_at = wrap->width;
  column.wraps = wraps;
  column.wrap_estimated = wrap->estimated;
  const bool is_reading = column.said.side ? !is_command : column.said.unit == "counts";
  if (!column.said.quantity && is_reading) column.said.quantity = Quantity::kPosition;
}

/// Of one counter with a column that wraps: the same joint, or both without a unit of their own.
bool counts_as(const Column& column, const Column& wrapping) {
  const bool same = column.said.joint == wrapping.said.joint || column.said.unit.empty() ||
                    column.said.unit == "counts";
  const double range =
      std::max(column.highest, wrapping.highest) - std::min(column.lowest, wrapping.lowest);
  return same && column.said.unit == wrapping.said.unit &&
         range <= wrapping.wraps_at * (1.0 + kRangeRounding);
}

}  // namespace

void find_wraps(Columns& columns) {
  for (const bool commands : {false, true}) {
    for (Column& column : columns.all) {
      const bool may_count = !column.said.quantity || column.is(Quantity::kPosition);
      if (!may_count || column.constant()) continue;
      if ((column.said.side == Side::kCommand) == commands) unwrap_column(columns, column);
    }
  }
}

void settle_wraps(Columns& columns) {
  for (Column& column : columns.all) {
    if (column.wraps_at == 0.0) continue;
    if (!column.is(Quantity::kPosition)) {
      column.values = column.as_read;
      column.wraps_at = 0.0;
      column.wraps = 0;
    } else if (column.wrap_estimated) {
      column.assumed = true;
      columns.ask(fmt::format(
          "{} starts again after about {:.6g}, by its values: is that the width of its counter?",
          column.name, column.wraps_at));
    }
  }
  for (const Column& wrapping : columns.all) {
    if (wrapping.wraps == 0) continue;
    for (Column& column : columns.all) {
      if (column.is(Quantity::kPosition) && !column.constant() && column.wraps_at == 0.0 &&
          counts_as(column, wrapping))
        column.wraps_at = wrapping.wraps_at;
    }
  }
}

}  // namespace ravencal::guess
