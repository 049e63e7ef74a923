// SPDX-License-Identifier: Apache-2.0
#include "guess/columns.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "core/median.hpp"
#include "core/units.hpp"
#include "guess/relation.hpp"

namespace ravencal::guess {
namespace {

/// Sampling rates of robots' recordings, Hz. Times without a unit are taken so that the rate lies
/// nearest to the middle of them.
constexpr double kUsualRateHz = 200.0;
/// A clock's steps: so many of them within so much of the middle step.
constexpr double kClockShare = 0.8;
constexpr double kClockJitter = 0.5;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

double median_step(const Eigen::VectorXd& t) {
  std::vector<double> steps;
  for (Eigen::Index row = 1; row < t.size(); ++row) steps.push_back(t[row] - t[row - 1]);
  return core::upper_median(std::move(steps));
}

bool rises(const Column& column) {
  for (Eigen::Index row = 1; row < column.values.size(); ++row) {
    if (!(column.values[row] >= column.values[row - 1])) return false;
  }
  return !column.constant();
}

/// Steps of a clock: most lie near the middle one. A counter of rows has steps of exactly one.
bool ticks(const Column& column) {
  const Eigen::Index count = column.values.size() - 1;
  const Eigen::ArrayXd steps = column.values.tail(count) - column.values.head(count);
  const double middle = median_step(column.values);
  const auto near = ((steps - middle).abs() < kClockJitter * middle).count();
  return middle > 0.0 && !(steps == 1.0).all() &&
         static_cast<double>(near) > kClockShare * static_cast<double>(count);
}

/// The column of time: the rising one whose name says so, else one with a unit of time, else one
/// that ticks.
Column* time_among(std::vector<Column>& columns) {
  Column* found = nullptr;
  for (Column& column : columns) {
    const auto unit = core::find_unit(column.said.unit);
    const bool in_time = unit && unit->si_name == "s";
    if (!(column.is(Quantity::kTime) || in_time) || !rises(column)) continue;
    if (found == nullptr || (in_time && found->said.unit.empty())) found = &column;
  }
  if (found != nullptr) return found;
  const auto clock = std::find_if(columns.begin(), columns.end(),
                                  [](const Column& c) { return rises(c) && ticks(c); });
  return clock == columns.end() ? nullptr : &*clock;
}

std::string time_unit_of(const Column& time, double step, Columns& columns) {
  const auto said = core::find_unit(time.said.unit);
  if (said && said->si_name == "s") return time.said.unit;
  std::string best = "s";
  double distance = kInfinity;
  for (const char* unit : {"s", "ms", "us", "ns"}) {
    const double rate_hz = 1.0 / (step * core::find_unit(unit)->to_si);
    const double off = std::abs(std::log(rate_hz / kUsualRateHz));
    if (off < distance) best = unit, distance = off;
  }
  columns.ask(fmt::format("{}: seconds, or which unit? Its steps are {:g}; taken as {}", time.name,
                          step, best));
  return best;
}

/// The position that explains a column best.
struct Match {
  const Column* position = nullptr;
  double correlation = 0.0;  ///< 0 to 1
};
template <typename Relation>
Match best_position(const std::vector<const Column*>& positions, double least,
                    Relation&& relation) {
  Match best;
  for (const Column* position : positions) {
    const std::optional<Line> line = relation(*position);
    const double correlation = line ? std::abs(line->correlation) : 0.0;
    if (correlation >= least && correlation > best.correlation) best = {position, correlation};
  }
  return best;
}

/// Positions that a column may belong to: those of its joint, where its name tells one, else all.
std::vector<const Column*> positions_for(const Columns& columns, const Column& column) {
  std::vector<const Column*> all, own;
  for (const Column& position : columns.all) {
    if (!position.is(Quantity::kPosition) || &position == &column || position.constant()) continue;
    all.push_back(&position);
    if (position.said.joint == column.said.joint) own.push_back(&position);
  }
  return column.said.joint.empty() || own.empty() ? all : own;
}

void decide(Column& column, const Column& position, Quantity quantity, std::string_view relation) {
  column.said.quantity = quantity;
  if (column.said.is_desired_or_derivative && quantity == Quantity::kPosition)
    column.said.side = Side::kCommand;
  column.said.joint = position.said.joint;
  column.because = fmt::format("{} {}", relation, position.name);
}

/// Tables whose names tell nothing: a column that is the integral of another is a position.
void find_first_positions(Columns& columns) {
  for (Column& position : columns.all) {
    if (position.said.quantity || position.constant()) continue;
    for (Column& velocity : columns.all) {
      if (&velocity == &position || velocity.said.quantity || velocity.constant()) continue;
      const auto line = derivative_line(columns.t_s, position.values, velocity.values);
      if (!line || line->correlation < kCopyCorrelation) continue;
      position.said.quantity = Quantity::kPosition;
      position.said.joint = fmt::format("joint_{}", position.name);
      position.because = fmt::format("its derivative is {}", velocity.name);
      break;
    }
  }
}

}  // namespace

Eigen::VectorXd Column::si() const {
  return values * (said.scale * core::find_unit(said.unit)->to_si);
}

bool Column::is_usable_position() const {
  const auto unit = core::find_unit(said.unit);
  return is(Quantity::kPosition) && !constant() && unit &&
         (unit->si_name == "rad" || unit->si_name == "m");
}

void Columns::ask(const std::string& question) {
  if (std::find(questions.begin(), questions.end(), question) == questions.end())
    questions.push_back(question);
}

std::vector<std::string> joints_of(const Columns& columns) {
  std::vector<std::string> joints;
  for (const Column& column : columns.all) {
    const bool is_new = std::find(joints.begin(), joints.end(), column.said.joint) == joints.end();
    if (column.is_usable_position() && is_new) joints.push_back(column.said.joint);
  }
  return joints;
}

Columns columns_of(const record::Table& table, const std::vector<std::string>& joints,
                   Guess& guess) {
  std::map<std::size_t, std::size_t> count_of_length;
  for (const record::TableColumn& column : table.columns) ++count_of_length[column.values.size()];
  std::size_t most = 0;
  for (const auto& [length, count] : count_of_length) {
    if (count < most) continue;
    most = count;
    guess.rows = length;
  }
  Columns columns;
  for (std::size_t i = 0; i < table.columns.size(); ++i) {
    const record::TableColumn& given = table.columns[i];
    if (given.values.size() != guess.rows) {
      guess.left_out.push_back(
          {i, fmt::format("{} values, where the others have {}", given.values.size(), guess.rows)});
      continue;
    }
    Column column;
    column.index = i;
    column.name = given.name;
    column.said = read_column_name(column.name, joints);
    column.values = Eigen::Map<const Eigen::VectorXd>(given.values.data(),
                                                      static_cast<Eigen::Index>(guess.rows));
    const auto finite = column.values.array().isFinite();
    column.missing = !finite.all();
    if (!finite.any()) {
      guess.left_out.push_back({i, "no numbers"});
      continue;
    }
    column.lowest = finite.select(column.values.array(), kInfinity).minCoeff();
    column.highest = finite.select(column.values.array(), -kInfinity).maxCoeff();
    column.whole_numbers =
        (!finite || column.values.array() == column.values.array().round()).all();
    columns.all.push_back(std::move(column));
  }
  return columns;
}

void find_time(const record::Table& table, Columns& columns, Guess& guess) {
  const auto rows = static_cast<Eigen::Index>(guess.rows);
  if (!table.t_ns.empty()) {
    columns.t_s.resize(rows);
    for (Eigen::Index row = 0; row < rows; ++row)
      columns.t_s[row] = 1e-9 * static_cast<double>(table.t_ns[static_cast<std::size_t>(row)] -
                                                    table.t_ns.front());
    guess.row_period_s = median_step(columns.t_s);
    return;
  }
  Column* time = time_among(columns.all);
  if (time == nullptr) {
    guess.row_period_s = record::Profile().row_period_s;
    columns.t_s =
        Eigen::VectorXd::LinSpaced(rows, 0.0, guess.row_period_s * static_cast<double>(rows - 1));
    columns.ask(fmt::format("no column is a time: how far are two rows apart? Taken as {:g} s",
                            guess.row_period_s));
    return;
  }
  const double step = median_step(time->values);
  guess.time_unit = time_unit_of(*time, step, columns);
  guess.time_column = time->index;
  const double to_s = core::find_unit(guess.time_unit)->to_si;
  guess.row_period_s = step * to_s;
  columns.t_s = (time->values.array() - time->values[0]) * to_s;
  columns.all.erase(columns.all.begin() + (time - columns.all.data()));
}

void find_quantities(Columns& columns) {
  const bool any = std::any_of(columns.all.begin(), columns.all.end(),
                               [](const Column& c) { return c.is(Quantity::kPosition); });
  if (!any) find_first_positions(columns);
  std::vector<std::string> decided;
  for (Column& column : columns.all) {
    if (column.said.quantity || column.constant()) continue;
    const auto positions = positions_for(columns, column);
    // A name that leaves two meanings needs less of the values than one that leaves all.
    const bool is_told = column.said.is_desired_or_derivative || column.said.side == Side::kCommand;
    const Match copied = best_position(
        positions, is_told ? kSameMotion : kCopyCorrelation,
        [&](const Column& position) { return line_through(position.values, column.values); });
    const Match derived = best_position(
        positions, column.said.is_desired_or_derivative ? kDerivativeCorrelation : kCopyCorrelation,
        [&](const Column& position) {
          return derivative_line(columns.t_s, position.values, column.values);
        });
    if (derived.position != nullptr && derived.correlation > copied.correlation)
      decide(column, *derived.position, Quantity::kVelocity, "derivative of");
    else if (copied.position != nullptr)
      decide(column, *copied.position, Quantity::kPosition, "moves as");
    if (column.said.quantity && !column.said.is_desired_or_derivative)
      decided.push_back(fmt::format("{} ({})", column.name, column.because));
  }
  if (!decided.empty())
    columns.ask(
        fmt::format("names that tell nothing; by the values: {}", fmt::join(decided, ", ")));
}

}  // namespace ravencal::guess
