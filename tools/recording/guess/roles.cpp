// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/units.hpp"
#include "guess/columns.hpp"
#include "record/relation.hpp"

namespace ravencal::guess {
namespace {

/// Estimate and truth of one joint differ by less; a shaft before a gearbox turns further.
constexpr double kLargestRatioError = 2.0;
/// An effort that never changes its sign and often is exactly zero has lost its sign.
constexpr double kShareOfZeros = 0.01;

bool has_sign(const Column& column) {
  if (column.lowest < 0.0 && column.highest > 0.0) return true;
  const auto zeros = (column.values.array() == 0.0).count();
  return static_cast<double>(zeros) < kShareOfZeros * static_cast<double>(column.values.size());
}

bool counts_rows(const Column& column) {
  const Eigen::Index last = column.values.size() - 1;
  return ((column.values.tail(last) - column.values.head(last)).array() == 1.0).all();
}

class Roles {
 public:
  Roles(Columns& columns, Guess& guess) : columns_(columns), guess_(guess) {}

  void find() {
    const std::vector<std::string> joints = joints_of(columns_);
    find_commands(joints);
    for (const std::string& joint : joints) joint_roles(joint);
    for (Column& column : columns_.all)
      if (!is_done(column)) others(column);
    std::stable_sort(guess_.channels.begin(), guess_.channels.end(),
                     [](const auto& a, const auto& b) { return a.column < b.column; });
  }

 private:
  [[nodiscard]] bool is_done(const Column& column) const {
    return std::find(done_.begin(), done_.end(), &column) != done_.end();
  }

  Column* first(const std::string& joint, Quantity quantity, auto&& accepts) {
    for (Column& column : columns_.all) {
      if (column.said.joint == joint && column.is(quantity) && !column.constant() &&
          !is_done(column) && accepts(column))
        return &column;
    }
    return nullptr;
  }
  Column* position(const std::string& joint, std::optional<Side> side) {
    return first(joint, Quantity::kPosition,
                 [&](const Column& c) { return c.is_usable_position() && c.said.side == side; });
  }

  void put(Column& column, std::string_view role, std::string joint, std::string name) {
    GuessedChannel channel;
    channel.column = column.index;
    channel.joint = std::move(joint);
    channel.name = std::move(name);
    channel.role = role;
    channel.unit = column.said.unit;
    channel.scale = column.said.scale;
    channel.may_be_missing = column.missing;
    channel.assumed = column.assumed && role != "feature";
    channel.because = column.because;
    channel.wraps_at = column.wraps_at;
    if (column.wraps > 0) {
      channel.because +=
          fmt::format("{}wraps at {:.10g}, {} time{}", channel.because.empty() ? "" : "; ",
                      column.wraps_at, column.wraps, column.wraps == 1 ? "" : "s");
    }
    guess_.channels.push_back(std::move(channel));
    done_.push_back(&column);
  }
  void add(Column& column, std::string_view role, std::string_view what) {
    const std::string& joint = column.said.joint;
    put(column, role, joint, joint.empty() ? column.name : fmt::format("{}.{}", joint, what));
  }
  void feature(Column& column, std::string why) {
    column.because = std::move(why);
    put(column, column.is(Quantity::kTemperature) ? "temperature" : "feature", "", column.name);
  }

  void joint_roles(const std::string& joint);
  void drive_roles(const std::string& joint);
  void turn_efforts(const std::string& joint);
  void to_truth(Column& estimate, const Column& truth);
  void others(Column& column);
  struct Positions;
  std::vector<Column*> plain_positions(const std::string& joint);
  void find_commands(const std::vector<std::string>& joints);
  Positions positions(const std::string& joint);
  [[nodiscard]] bool computed(const Column& position) const;
  void velocity_roles(const std::string& joint);
  [[nodiscard]] bool driven(const std::string& joint) const;

  Columns& columns_;
  Guess& guess_;
  std::vector<const Column*> done_;
};

/// Sign and ratio of what the robot believes, so that it counts as the truth does. A ratio near 1
/// is the error that is looked for, and one of columns that only move alike is that of a late
/// answer.
void Roles::to_truth(Column& estimate, const Column& truth) {
  const auto line = record::line_through(estimate.si(), truth.si());
  if (!line || std::abs(line->correlation) < record::kSameMotion) {
    columns_.ask(fmt::format("{} and {} hardly move alike: are they of one joint?", estimate.name,
                             truth.name));
    return;
  }
  const bool geared = std::abs(line->correlation) > record::kCopyCorrelation &&
                      std::abs(std::log(std::abs(line->slope))) > std::log(kLargestRatioError);
  if (!geared && line->slope > 0.0) return;
  const double scale = geared ? line->slope : -1.0;
  estimate.said.scale *= scale;
  estimate.because = fmt::format("{:.6g} times it is {}", scale, truth.name);
  columns_.ask(fmt::format("{} moves {:.6g} times as {} does: its scale is set to {:.6g}",
                           estimate.name, 1.0 / line->slope, truth.name, scale));
}

/// Signs of efforts that drive the joint against its friction and its inertia.
void Roles::turn_efforts(const std::string& joint) {
  const Column* moved = first(joint, Quantity::kPosition, [](const Column& column) {
    return column.is_usable_position() && column.said.side != Side::kCommand;
  });
  if (moved == nullptr) return;
  for (Column& column : columns_.all) {
    if (!column.drives() || column.said.joint != joint || !has_sign(column)) continue;
    const auto fit = record::effort_of_motion(columns_.t_s, moved->si(), column.values);
    if (!fit || !fit->reversed || fit->share < record::kLeastExplained) continue;
    column.said.scale *= -1.0;
    column.assumed = true;
    columns_.ask(fmt::format("{} acts against the motion of {}: its sign is reversed", column.name,
                             moved->name));
  }
}

void Roles::drive_roles(const std::string& joint) {
  const auto any = [](const Column&) { return true; };
  const auto signed_one = [&](Quantity quantity, bool command) {
    return first(joint, quantity, [&](const Column& column) {
      return has_sign(column) && (column.said.side == Side::kCommand) == command;
    });
  };
  turn_efforts(joint);
  if (Column* effort = signed_one(Quantity::kEffort, false)) add(*effort, "drive_torque", "torque");
  Column* input = signed_one(Quantity::kEffort, true);
  for (const bool command : {false, true})
    if (input == nullptr) input = signed_one(Quantity::kDriveSignal, command);
  if (input != nullptr) add(*input, "drive_input", "drive_input");
  for (const Quantity quantity : {Quantity::kEffort, Quantity::kDriveSignal}) {
    while (Column* left = first(joint, quantity, any)) {
      if (!has_sign(*left))
        columns_.ask(
            "efforts that are never negative and often zero are kept as features: a size "
            "without a sign moves no joint");
      feature(*left, has_sign(*left) ? "another effort of this joint" : "an effort without a sign");
    }
  }
}

bool Roles::driven(const std::string& joint) const {
  return std::any_of(guess_.channels.begin(), guess_.channels.end(), [&](const auto& c) {
    return c.joint == joint && c.role.starts_with("drive_");
  });
}

/// The columns of a joint's positions by what they say of it.
struct Roles::Positions {
  Column* command = nullptr;
  Column* motor = nullptr;
  Column* measured = nullptr;
  Column* truth = nullptr;
};

std::vector<Column*> Roles::plain_positions(const std::string& joint) {
  std::vector<Column*> plain;
  for (Column& column : columns_.all) {
    if (column.said.joint == joint && column.is_usable_position() && !column.said.side)
      plain.push_back(&column);
  }
  return plain;
}

/// Of two positions of a joint that no word tells apart, the one that leads is the command: in all
/// joints the first column or in all the second.
void Roles::find_commands(const std::vector<std::string>& joints) {
  int first_leads = 0;
  std::vector<std::vector<Column*>> pairs;
  for (const std::string& joint : joints) {
    const std::vector<Column*> plain = plain_positions(joint);
    if (plain.size() != 2 || position(joint, Side::kCommand) != nullptr) continue;
    first_leads += record::leads(plain[0]->si(), plain[1]->si()) ? 1 : -1;
    pairs.push_back(plain);
  }
  std::vector<std::string> commands;
  for (const std::vector<Column*>& pair : pairs) {
    Column& command = *pair[first_leads > 0 ? 0 : 1];
    command.said.side = Side::kCommand;
    command.because = "it leads";
    commands.push_back(command.name);
  }
  if (!commands.empty()) {
    columns_.ask(fmt::format("taken for commands, because they lead the other position: {}",
                             fmt::join(commands, ", ")));
  }
}

Roles::Positions Roles::positions(const std::string& joint) {
  Positions found;
  found.command = position(joint, Side::kCommand);
  found.motor = position(joint, Side::kMotor);
  found.truth = position(joint, Side::kJoint);
  found.measured = position(joint, Side::kMeasured);
  if (found.measured == nullptr) found.measured = position(joint, std::nullopt);
  return found;
}

/// A joint's position that the motors' positions give exactly is no second encoder.
bool Roles::computed(const Column& position) const {
  std::vector<const Column*> motors;
  for (const Column& column : columns_.all) {
    if (column.is_usable_position() && column.said.side == Side::kMotor) motors.push_back(&column);
  }
  Eigen::MatrixXd values(position.values.size(), static_cast<Eigen::Index>(motors.size()));
  for (std::size_t m = 0; m < motors.size(); ++m)
    values.col(static_cast<Eigen::Index>(m)) = motors[m]->values;
  return record::computed_from(position.values, values);
}

void Roles::joint_roles(const std::string& joint) {
  Positions p = positions(joint);
  drive_roles(joint);
  Column* believed = p.measured;
  Column* truth = p.truth;
  if (p.motor != nullptr && truth == nullptr && p.measured != nullptr && !computed(*p.measured)) {
    truth = p.measured;
    believed = nullptr;
  }
  if (p.motor != nullptr && (truth == nullptr || believed != nullptr)) {
    add(*p.motor, "motor_position", "motor_position");
  } else if (p.motor != nullptr) {
    believed = p.motor;
  }
  if (truth == nullptr && believed != nullptr && !driven(joint) && p.command != nullptr) {
    truth = std::exchange(believed, std::exchange(p.command, nullptr));
    columns_.ask(
        "joints with one encoder and no effort: the command is taken for what the robot believes, "
        "the encoder for the truth");
  }
  if (truth != nullptr && believed == nullptr) std::swap(believed, p.command);
  if (truth != nullptr && believed != nullptr) {
    to_truth(*believed, *truth);
    add(*believed, "joint_estimate", "estimate");
    // Beside a second encoder, the drive's own position is that of the motor's side, too.
    if (p.motor == nullptr && driven(joint) && believed->said.side != Side::kCommand)
      add(*believed, "motor_position", "position");
    add(*truth, "joint_truth", "truth");
  } else if (believed != nullptr && p.motor != nullptr) {
    add(*believed, "joint_estimate", "estimate");
  } else if (Column* alone = believed != nullptr ? believed : truth; alone != nullptr) {
    const bool moves_alone =
        first(joint, Quantity::kVelocity, [](const Column&) { return true; }) == nullptr;
    if (driven(joint) || p.command != nullptr || !moves_alone)
      add(*alone, "motor_position", "position");
  }
  if (p.command != nullptr) add(*p.command, "desired_position", "desired_position");
  velocity_roles(joint);
}

void Roles::velocity_roles(const std::string& joint) {
  for (const bool wanted : {false, true}) {
    Column* velocity = first(joint, Quantity::kVelocity, [&](const Column& column) {
      return (column.said.side == Side::kCommand) == wanted && column.said.side != Side::kJoint;
    });
    if (velocity == nullptr) continue;
    add(*velocity, wanted ? "desired_velocity" : "motor_velocity",
        wanted ? "desired_velocity" : "velocity");
  }
}

void Roles::others(Column& column) {
  if (counts_rows(column)) {
    guess_.left_out.push_back({column.index, "it counts the rows"});
  } else if (column.constant() && !column.is(Quantity::kTemperature)) {
    guess_.left_out.push_back({column.index, fmt::format("constant at {:g}", column.lowest)});
  } else if (column.is(Quantity::kPosition) && !column.is_usable_position()) {
    guess_.left_out.push_back(
        {column.index,
         fmt::format("a position in the unit '{}', not a length or an angle", column.said.unit)});
  } else {
    feature(column, column.said.quantity ? "no joint or another channel has that part"
                                         : "neither the name nor the values tell what it is");
  }
}

}  // namespace

void find_roles(Columns& columns, Guess& guess) { Roles(columns, guess).find(); }

}  // namespace ravencal::guess
