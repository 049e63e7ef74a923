// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/median.hpp"
#include "core/units.hpp"
#include "guess/columns.hpp"

namespace ravencal::guess {
namespace {

using record::Stamps;

/// Sampling rates of robots' recordings, Hz. Times without a unit are taken so that the rate lies
/// nearest to the middle of them.
constexpr double kUsualRateHz = 200.0;
/// A clock's steps: so many of them within so much of the middle step.
constexpr double kClockShare = 0.8;
constexpr double kClockJitter = 0.5;
/// A clock has fewer bad stamps; a column that is none has about its half.
constexpr double kMostBadStamps = 0.05;
/// Stamps are rounded where at least so many are equal to the one before; a message that is
/// published twice now and then is no rounding.
constexpr double kLeastEqualStamps = 0.01;
/// Rounded stamps are whole numbers of the rounding within so much of it.
constexpr double kRoundingError = 1e-3;
/// Counters of microcontrollers start again at these.
constexpr double kCounterWidths[] = {65536.0, 2147483648.0, 4294967296.0};

/// Times since 1970 say their unit: in it they are dates of 2000 to 2100, s.
constexpr double kEarliestDateS = 946'684'800.0;
constexpr double kLatestDateS = 4'102'444'800.0;

/// One way to read the times of the rows.
struct TimeReading {
  std::size_t column = 0;
  std::optional<std::size_t> fraction;
  record::Clock clock;
  Stamps stamps;
  std::vector<bool> rises;  ///< the rows that stay
  std::size_t bad = 0;
  bool restarts = false;
  bool unit_assumed = false;

  void look() {
    rises = record::longest_rising(stamps);
    bad = static_cast<std::size_t>(std::count(rises.begin(), rises.end(), false));
  }
  [[nodiscard]] bool is_clock() const {
    return static_cast<double>(bad) <= kMostBadStamps * static_cast<double>(stamps.size()) &&
           moves();
  }
  [[nodiscard]] bool moves() const {
    const auto known = [](const auto& stamp) { return stamp.has_value(); };
    const auto first = std::find_if(stamps.begin(), stamps.end(), known);
    const auto last = std::find_if(stamps.rbegin(), stamps.rend(), known);
    return first != stamps.end() && **first < **last;
  }
  /// ns between the rows that stay.
  [[nodiscard]] std::vector<double> steps_ns() const {
    std::vector<double> steps;
    std::optional<std::int64_t> before;
    for (std::size_t row = 0; row < stamps.size(); ++row) {
      if (!rises[row]) continue;
      if (before) steps.push_back(static_cast<double>(*stamps[row] - *before));
      before = stamps[row];
    }
    return steps;
  }
};

std::span<const double> numbers_of(const Column& column) {
  return {column.values.data(), static_cast<std::size_t>(column.values.size())};
}

TimeReading reading_of(const Column& column, const record::Clock& clock,
                       const Column* fraction = nullptr) {
  TimeReading reading;
  reading.column = column.index;
  reading.clock = clock;
  record::StampFields fields{numbers_of(column), {}, {}};
  if (fraction != nullptr) {
    reading.fraction = fraction->index;
    fields.fractions = numbers_of(*fraction);
  }
  reading.stamps = record::stamps_of(clock, fields);
  reading.look();
  return reading;
}

/// Times that are written out: a date and a clock, or a clock alone.
std::optional<TimeReading> written_out(const record::Table& table, std::size_t rows) {
  for (std::size_t i = 0; i < table.columns.size(); ++i) {
    const std::vector<std::string>& texts = table.columns[i].texts;
    if (texts.size() != rows) continue;
    for (const char* unit : {"date", "clock"}) {
      TimeReading reading;
      reading.column = i;
      reading.clock.unit = unit;
      reading.stamps = record::stamps_of(reading.clock, {{}, {}, texts});
      reading.look();
      if (reading.is_clock()) return reading;
    }
  }
  return std::nullopt;
}

bool has_time_unit(const Column& column) {
  const auto unit = core::find_unit(column.said.unit);
  return unit && unit->si_name == "s";
}

/// Steps of a clock: most lie near the middle one. A counter of rows has steps of exactly one.
bool ticks(const Column& column) {
  const Eigen::Index count = column.values.size() - 1;
  const Eigen::ArrayXd steps = column.values.tail(count) - column.values.head(count);
  const double middle = core::upper_median(std::vector<double>(steps.begin(), steps.end()));
  const auto near = ((steps - middle).abs() < kClockJitter * middle).count();
  return middle > 0.0 && !(steps == 1.0).all() && (steps >= 0.0).all() &&
         static_cast<double>(near) > kClockShare * static_cast<double>(count);
}

/// The columns that may be the time: those whose name says so, else those that tick.
std::vector<const Column*> clocks_among(const Columns& columns) {
  std::vector<const Column*> named, ticking;
  for (const Column& column : columns.all) {
    if (column.is(Quantity::kTime) || has_time_unit(column))
      named.push_back(&column);
    else if (ticks(column))
      ticking.push_back(&column);
  }
  std::stable_sort(named.begin(), named.end(), [](const Column* a, const Column* b) {
    return has_time_unit(*a) && !has_time_unit(*b);
  });
  named.insert(named.end(), ticking.begin(), ticking.end());
  return named;
}

struct TimeUnit {
  std::string name = "s";
  bool assumed = false;
};

/// The unit in which the usual step makes a usual rate.
TimeUnit unit_of(const Column& time, Columns& columns) {
  if (has_time_unit(time)) return {time.said.unit};
  std::vector<double> steps;
  for (Eigen::Index row = 1; row < time.values.size(); ++row) {
    const double step = time.values[row] - time.values[row - 1];
    if (step > 0.0) steps.push_back(step);
  }
  if (steps.empty()) return {};
  const double step = core::upper_median(std::move(steps));
  std::string best = "s";
  double distance = std::numeric_limits<double>::infinity();
  for (const char* unit : {"s", "ms", "us", "ns"}) {
    const double rate_hz = 1.0 / (step * core::find_unit(unit)->to_si);
    const double off = std::abs(std::log(rate_hz / kUsualRateHz));
    if (off < distance) best = unit, distance = off;
  }
  const double begin_s = time.lowest * core::find_unit(best)->to_si;
  if (begin_s > kEarliestDateS && begin_s < kLatestDateS) return {best};
  columns.ask(fmt::format("{}: seconds, or which unit? Its steps are {:g}; taken as {}", time.name,
                          step, best));
  return {best, true};
}

/// Seconds that stand still while a second column counts their fraction.
std::optional<TimeReading> two_parts(const Columns& columns) {
  const auto is_time = [](const Column& c, const char* unit) {
    return c.is(Quantity::kTime) && c.said.unit == unit && c.whole_numbers && !c.constant();
  };
  for (const char* unit : {"ns", "us", "ms"}) {
    const double per_s = 1.0 / core::find_unit(unit)->to_si;
    for (const Column& fraction : columns.all) {
      if (!is_time(fraction, unit) || fraction.lowest < 0.0 || !(fraction.highest < per_s))
        continue;
      for (const Column& seconds : columns.all) {
        if (!seconds.is(Quantity::kTime) || !seconds.whole_numbers ||
            (seconds.said.unit != "s" && !seconds.said.unit.empty()))
          continue;
        record::Clock clock;
        clock.fraction_unit = unit;
        TimeReading reading = reading_of(seconds, clock, &fraction);
        if (reading.is_clock()) return reading;
      }
    }
  }
  return std::nullopt;
}

/// The column's times as they stand, as a counter that starts again, or as runs one behind the
/// other.
TimeReading best_reading(const Column& column, Columns& columns) {
  record::Clock clock;
  const TimeUnit unit = unit_of(column, columns);
  clock.unit = unit.name;
  TimeReading best = reading_of(column, clock);
  best.unit_assumed = unit.assumed;
  if (best.is_clock()) return best;
  for (const double width : kCounterWidths) {
    if (!column.whole_numbers || column.highest >= width) continue;
    clock.wraps_at = width;
    TimeReading counter = reading_of(column, clock);
    counter.unit_assumed = unit.assumed;
    // A counter comes near its end before it starts again.
    if (counter.is_clock() && 2.0 * column.highest > width) return counter;
  }
  std::size_t backwards = 0;
  for (std::size_t row = 1; row < best.stamps.size(); ++row)
    backwards +=
        best.stamps[row] && best.stamps[row - 1] && *best.stamps[row] < *best.stamps[row - 1];
  best.restarts =
      static_cast<double>(backwards) < kMostBadStamps * static_cast<double>(best.stamps.size()) &&
      best.moves() && !column.missing;
  return best;
}

/// The step to which the stamps are rounded, ns; 0: they are not, or rows stand twice.
double rounding_ns(const TimeReading& reading) {
  const std::vector<double> steps = reading.steps_ns();
  double least = std::numeric_limits<double>::infinity();
  std::size_t equal = 0;
  for (const double step : steps) {
    if (step == 0.0)
      ++equal;
    else
      least = std::min(least, step);
  }
  if (static_cast<double>(equal) < kLeastEqualStamps * static_cast<double>(steps.size()))
    return 0.0;
  const bool all = std::all_of(steps.begin(), steps.end(), [least](double step) {
    return std::abs(step / least - std::round(step / least)) < kRoundingError;
  });
  return all ? least : 0.0;
}

/// True where rows with the stamp of the row before are mostly that row again.
bool repeats_rows(const TimeReading& reading, const Columns& columns) {
  std::size_t equal = 0, same = 0;
  for (std::size_t row = 1; row < reading.stamps.size(); ++row) {
    if (reading.stamps[row] != reading.stamps[row - 1]) continue;
    ++equal;
    const auto here = static_cast<Eigen::Index>(row);
    same += std::all_of(columns.all.begin(), columns.all.end(), [here](const Column& column) {
      return column.values[here] == column.values[here - 1] || std::isnan(column.values[here]);
    });
  }
  return 2 * same > equal;
}

/// Keeps the rows that `rises` names, of times and values.
void keep_rows(const TimeReading& reading, Columns& columns) {
  std::vector<Eigen::Index> rows;
  for (std::size_t row = 0; row < reading.rises.size(); ++row)
    if (reading.rises[row]) rows.push_back(static_cast<Eigen::Index>(row));
  columns.t_s.resize(static_cast<Eigen::Index>(rows.size()));
  std::vector<std::int64_t> t_ns;
  for (const Eigen::Index row : rows)
    t_ns.push_back(*reading.stamps[static_cast<std::size_t>(row)]);
  if (reading.clock.rounded_to > 0.0) {
    const auto unit = core::find_unit(reading.clock.unit);
    record::spread_rounded(t_ns, std::llround(reading.clock.rounded_to *
                                              (unit ? unit->to_si : 1.0) * record::kNsPerS));
  }
  for (std::size_t i = 0; i < t_ns.size(); ++i)
    columns.t_s[static_cast<Eigen::Index>(i)] =
        static_cast<double>(t_ns[i] - t_ns.front()) / record::kNsPerS;
  if (rows.size() == reading.rises.size()) return;
  for (Column& column : columns.all) column.values = Eigen::VectorXd(column.values(rows));
}

void take_time(TimeReading reading, const record::Table& table, Columns& columns, Guess& guess) {
  const std::string& name = table.columns[reading.column].name;
  std::erase_if(columns.all, [&](const Column& column) {
    return column.index == reading.column || column.index == reading.fraction;
  });
  if (reading.bad > 0) {
    reading.clock.drops_bad = true;
    columns.ask(
        fmt::format("{}: {} of {} rows have no time or one that runs backwards; they are left out",
                    name, reading.bad, reading.stamps.size()));
  }
  if (reading.clock.wraps_at > 0.0)
    columns.ask(fmt::format("{}: a counter that starts again at {:.0f}; its turns are counted",
                            name, reading.clock.wraps_at));
  if (const double step_ns = rounding_ns(reading); step_ns > 0.0) {
    if (repeats_rows(reading, columns)) {
      columns.ask(
          fmt::format("{}: rows stand twice, with the same time and the same values", name));
    } else {
      const auto unit = core::find_unit(reading.clock.unit);
      reading.clock.rounded_to = step_ns / record::kNsPerS / (unit ? unit->to_si : 1.0);
    }
  }
  std::erase_if(guess.left_out,
                [&](const LeftColumn& left) { return left.column == reading.column; });
  keep_rows(reading, columns);
  const auto count = columns.t_s.size();
  const Eigen::VectorXd steps = columns.t_s.tail(count - 1) - columns.t_s.head(count - 1);
  guess.row_period_s = core::upper_median(std::vector<double>(steps.begin(), steps.end()));
  if (reading.clock.rounded_to > 0.0)
    columns.ask(fmt::format("{}: rounded to {:g} s; its rows are spread by their rate, {:.4g} Hz",
                            name, rounding_ns(reading) / record::kNsPerS,
                            1.0 / guess.row_period_s));
  guess.time_column = reading.column;
  guess.time_fraction = reading.fraction;
  guess.clock = reading.clock;
  guess.time_unit_assumed = reading.unit_assumed;
}

/// Runs one behind the other: each goes on a row after the last one's end.
void join_runs(TimeReading& reading) {
  std::vector<double> steps;
  for (std::size_t row = 1; row < reading.stamps.size(); ++row) {
    const auto step = static_cast<double>(*reading.stamps[row] - *reading.stamps[row - 1]);
    if (step >= 0.0) steps.push_back(step);
  }
  const auto period_ns = static_cast<std::int64_t>(core::upper_median(std::move(steps)));
  std::int64_t offset_ns = 0;
  for (std::size_t row = 1; row < reading.stamps.size(); ++row) {
    *reading.stamps[row] += offset_ns;
    const std::int64_t late_ns = *reading.stamps[row - 1] - *reading.stamps[row];
    if (late_ns <= 0) continue;
    offset_ns += late_ns + period_ns;
    *reading.stamps[row] += late_ns + period_ns;
  }
  reading.look();
}

void count_rows(Columns& columns, Guess& guess) {
  const auto rows = static_cast<Eigen::Index>(guess.rows);
  guess.row_period_s = record::Profile().row_period_s;
  columns.t_s =
      Eigen::VectorXd::LinSpaced(rows, 0.0, guess.row_period_s * static_cast<double>(rows - 1));
  columns.ask(fmt::format("no column is a time: how far are two rows apart? Taken as {:g} s",
                          guess.row_period_s));
}

}  // namespace

void find_time(const record::Table& table, Columns& columns, Guess& guess) {
  if (!table.t_ns.empty()) {
    TimeReading reading;
    reading.stamps.assign(table.t_ns.begin(), table.t_ns.end());
    reading.rises.assign(table.t_ns.size(), true);
    guess.row_period_s = core::upper_median(reading.steps_ns()) / record::kNsPerS;
    keep_rows(reading, columns);
    return;
  }
  if (auto reading = written_out(table, guess.rows))
    return take_time(std::move(*reading), table, columns, guess);
  if (auto reading = two_parts(columns))
    return take_time(std::move(*reading), table, columns, guess);
  for (const Column* column : clocks_among(columns)) {
    TimeReading reading = best_reading(*column, columns);
    if (reading.is_clock()) return take_time(std::move(reading), table, columns, guess);
    if (reading.restarts) {
      columns.ask(fmt::format("{}: the time starts again; the runs are episodes", column->name));
      join_runs(reading);
      guess.time_restarts = true;
      return take_time(std::move(reading), table, columns, guess);
    }
    columns.ask(fmt::format("{}: is it the time? It runs backwards or is missing in {} of {} rows",
                            column->name, reading.bad, reading.stamps.size()));
  }
  count_rows(columns, guess);
}

}  // namespace ravencal::guess
