// SPDX-License-Identifier: Apache-2.0
//
// What the name of a column says: quantity, who says it, unit and joint. "vel_wrist_roll_deg_s" is
// a velocity of the joint "wrist_roll" in deg/s, "qcmd1_rad" a commanded position of "1" in rad.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace ravencal::guess {

enum class Quantity { kTime, kPosition, kVelocity, kEffort, kDriveSignal, kTemperature, kOther };

/// Whose value it is.
enum class Side { kCommand, kMeasured, kMotor, kJoint };

struct ColumnName {
  std::optional<Quantity> quantity;
  std::optional<Side> side;
  std::string unit;          ///< of core/units.hpp; empty: the name has none
  double scale = 1.0;        ///< `unit` per unit of the file: 0.001 for mA
  std::string joint;         ///< the words that are left, joined by '_'; may be empty
  bool names_joint = false;  ///< `joint` is one of the given names
  /// "qd" and "q_d" are a command in one interface and a velocity in another: the values tell.
  bool is_desired_or_derivative = false;
};

/// Reads any name. A name that holds the whole name of one of `joints` is that joint's.
ColumnName read_column_name(std::string_view name, const std::vector<std::string>& joints = {});

}  // namespace ravencal::guess
