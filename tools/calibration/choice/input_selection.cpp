// SPDX-License-Identifier: Apache-2.0
#include "choice/input_selection.hpp"

#include <algorithm>
#include <iterator>
#include <optional>

namespace ravencal::choice {
namespace {

using Columns = std::vector<Eigen::Index>;

constexpr Eigen::Index kProbeUnits = 60;
constexpr double kProbeSteepness = 0.3;

Columns with(const Columns& columns, const Columns& block) {
  Columns all;
  std::set_union(columns.begin(), columns.end(), block.begin(), block.end(),
                 std::back_inserter(all));
  return all;
}

Columns without(const Columns& columns, const Columns& block) {
  Columns rest;
  std::set_difference(columns.begin(), columns.end(), block.begin(), block.end(),
                      std::back_inserter(rest));
  return rest;
}

/// Columns and what a probe of them leaves.
struct Probed {
  Columns columns;
  std::vector<double> squares;
};

Probed probed(Columns columns, const JointRows& rows) {
  std::vector<double> squares = probe(columns, rows);
  return {std::move(columns), std::move(squares)};
}

Probed best_own_set(const OutputInputs& inputs, const JointRows& rows) {
  std::vector<Probed> own;
  std::vector<std::vector<double>> squares;
  for (const InputSet& set : inputs.own) {
    own.push_back(probed(set.columns, rows));
    squares.push_back(own.back().squares);
  }
  return own[simplest_of_best(squares)];
}

/// The block whose addition is best, if it counts.
std::optional<Probed> one_more(const Probed& from, const OutputInputs& inputs,
                               const JointRows& rows) {
  std::optional<Probed> best;
  for (const InputSet& block : inputs.others) {
    Columns columns = with(from.columns, block.columns);
    if (columns == from.columns) continue;
    Probed more = probed(std::move(columns), rows);
    if (simplest_of_best({from.squares, more.squares}) == 0) continue;
    if (best && simplest_of_best({best->squares, more.squares}) == 0) continue;
    best = std::move(more);
  }
  return best;
}

/// The block whose loss costs least, if it does not count.
std::optional<Probed> one_less(const Probed& from, const OutputInputs& inputs,
                               const JointRows& rows) {
  std::optional<Probed> best;
  for (const InputSet& block : inputs.others) {
    Columns columns = without(from.columns, block.columns);
    if (columns == from.columns || columns.empty()) continue;
    Probed less = probed(std::move(columns), rows);
    if (simplest_of_best({less.squares, from.squares}) != 0) continue;
    if (best && mean_of(best->squares) <= mean_of(less.squares)) continue;
    best = std::move(less);
  }
  return best;
}

}  // namespace

std::vector<double> probe(const Columns& columns, const JointRows& rows, UnseenConstant unseen) {
  const Eigen::Index units = std::min(kProbeUnits, rows.errors.size() / 8);
  return mean_squares(try_basis({}, {columns, units, kProbeSteepness, 1}, rows, unseen).left);
}

std::vector<InputSet> selected_inputs(const OutputInputs& inputs, const JointRows& rows) {
  Probed forward = best_own_set(inputs, rows);
  while (auto more = one_more(forward, inputs, rows)) forward = std::move(*more);
  Columns all = inputs.own.back().columns;
  for (const InputSet& block : inputs.others) all = with(all, block.columns);
  Probed backward = probed(std::move(all), rows);
  while (auto less = one_less(backward, inputs, rows)) backward = std::move(*less);
  std::vector<InputSet> selected = {{"selected inputs", std::move(forward.columns)}};
  if (backward.columns != selected.front().columns)
    selected.push_back({"all inputs but those that do not count", std::move(backward.columns)});
  return selected;
}

}  // namespace ravencal::choice
