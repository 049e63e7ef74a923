// SPDX-License-Identifier: Apache-2.0
//
// The columns of a table with what their names and values say. Private to guess/.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "guess/column_name.hpp"
#include "guess/guess.hpp"

namespace ravencal::guess {

struct Column {
  std::size_t index = 0;
  std::string name;
  ColumnName said;  ///< by the name, completed by the values
  Eigen::VectorXd values;
  double lowest = 0.0, highest = 0.0;
  bool whole_numbers = true;
  bool missing = false;         ///< some values are NaN
  double wraps_at = 0.0;        ///< the file's values start again after so much; 0: they do not
  bool wrap_estimated = false;  ///< from the values: no counter is known to have that width
  std::size_t wraps = 0;        ///< how often they did; `values` go on
  Eigen::VectorXd as_read;      ///< the file's values, where they wrap
  bool assumed = false;  ///< its unit, joint or sign is a guess that the file does not confirm
  std::string because;

  [[nodiscard]] bool constant() const { return !(highest > lowest); }
  [[nodiscard]] bool is(Quantity quantity) const { return said.quantity == quantity; }
  /// A position that moves, in a unit of length or angle.
  [[nodiscard]] bool is_usable_position() const;
  [[nodiscard]] bool drives() const { return is(Quantity::kEffort) || is(Quantity::kDriveSignal); }
  /// Values in SI; needs a unit.
  [[nodiscard]] Eigen::VectorXd si() const;
};

/// Columns, and the doubts that were met, each once.
struct Columns {
  std::vector<Column> all;
  Eigen::VectorXd t_s;  ///< of each row
  std::vector<std::string> questions;

  void ask(const std::string& question);
};

/// Joints in the order of their first usable position.
std::vector<std::string> joints_of(const Columns& columns);

/// The columns of numbers that have as many rows as most; the others are left out.
Columns columns_of(const record::Table& table, const std::vector<std::string>& joints,
                   Guess& guess);

/// Times by the table's stamps, by columns, which are taken out, or by counting rows. The reading
/// that keeps most rows counts; the others leave.
void find_time(const record::Table& table, Columns& columns, Guess& guess);

/// Columns that may be positions and start again after a turn are counted on. Needs the time.
void find_wraps(Columns& columns);

/// What turned out to be no position stands as it was read; other positions of a counter that wraps
/// count as it does. Needs the quantities.
void settle_wraps(Columns& columns);

/// Quantities that no name tells: a copy of a position is a position, what adds up to one is a
/// velocity.
void find_quantities(Columns& columns);

/// Units of positions that no name tells: by their velocities or their size.
void find_position_units(Columns& columns);

/// Joints by the plant's names, where it is given, and of columns whose name tells none. Needs the
/// units of positions.
void find_joints(Columns& columns, const std::vector<std::string>& joints);

/// The other units, a velocity's by its position. Needs the joints.
void find_other_units(Columns& columns);

/// Channels out of columns.
void find_roles(Columns& columns, Guess& guess);

}  // namespace ravencal::guess
