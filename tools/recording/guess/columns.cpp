// SPDX-License-Identifier: Apache-2.0
#include "guess/columns.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "core/units.hpp"
#include "record/relation.hpp"

namespace ravencal::guess {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

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
    const std::optional<record::Line> line = relation(*position);
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
      const auto line = record::derivative_line(columns.t_s, position.values, velocity.values);
      if (!line || line->correlation < record::kCopyCorrelation) continue;
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
    const Match copied =
        best_position(positions, is_told ? record::kSameMotion : record::kCopyCorrelation,
                      [&](const Column& position) {
                        return record::line_through(position.values, column.values);
                      });
    const Match derived =
        best_position(positions,
                      column.said.is_desired_or_derivative ? record::kDerivativeCorrelation
                                                           : record::kCopyCorrelation,
                      [&](const Column& position) {
                        return record::derivative_line(columns.t_s, position.values, column.values);
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
