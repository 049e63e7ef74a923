// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>

#include "guess/columns.hpp"
#include "guess/joint_matching.hpp"
#include "guess/name_words.hpp"
#include "record/relation.hpp"

namespace ravencal::guess {
namespace {

/// A column without a word for its joint moves as one of its joint's positions does.
constexpr double kSameJointCorrelation = 0.9;

/// Positions whose name has no joint: the joint as whose position they move.
void join_nameless_positions(Columns& columns) {
  for (Column& column : columns.all) {
    if (!column.is(Quantity::kPosition) || !column.said.joint.empty()) continue;
    double best = kSameJointCorrelation;
    const Column* found = nullptr;
    for (const Column& other : columns.all) {
      if (!other.is(Quantity::kPosition) || other.said.joint.empty()) continue;
      const auto line = record::line_through(other.values, column.values);
      if (!line || std::abs(line->correlation) <= best) continue;
      best = std::abs(line->correlation);
      found = &other;
    }
    if (found == nullptr) continue;
    column.said.joint = found->said.joint;
    column.because = fmt::format("moves as {}", found->name);
    columns.ask(fmt::format("{}: of which joint? It moves as {} does", column.name, found->name));
  }
}

/// Joint whose motion explains the effort best.
void find_joint_of_effort(Columns& columns, Column& effort) {
  const Column* best = nullptr;
  double share = record::kLeastExplained;
  for (const Column& position : columns.all) {
    if (!position.is_usable_position() || position.said.side == Side::kCommand) continue;
    const auto fit = record::effort_of_motion(columns.t_s, position.si(), effort.values);
    if (!fit || fit->share <= share) continue;
    share = fit->share;
    best = &position;
  }
  if (best == nullptr) return;
  effort.said.joint = best->said.joint;
  effort.assumed = true;
  effort.because = fmt::format("{} explains {:.0f} % of it", best->name, 100.0 * share);
  columns.ask(fmt::format("{}: of which joint? Taken as that of {}", effort.name, best->name));
}

std::string plain_name(const std::string& key) {
  if (key.empty()) return "joint";
  return is_number(key) ? "joint" + key : key;
}

/// The plant's joints by the keys of the columns that do not hold a joint's whole name.
std::map<std::string, std::string> names_of(Columns& columns, const std::vector<std::string>& keys,
                                            const std::vector<std::string>& joints) {
  std::vector<std::string> open_keys, free_joints;
  const auto is_bound = [&](const std::string& joint) {
    return std::any_of(columns.all.begin(), columns.all.end(), [&](const Column& column) {
      return column.said.names_joint && column.said.joint == joint;
    });
  };
  for (const std::string& key : keys)
    if (!is_bound(key)) open_keys.push_back(key);
  for (const std::string& joint : joints)
    if (!is_bound(joint)) free_joints.push_back(joint);
  const JointMatches matches = match_joints(open_keys, free_joints);
  if (!matches.guessed.empty()) {
    columns.ask(fmt::format("joints of the plant, by likeness and order: {}",
                            fmt::join(matches.guessed, ", ")));
  }
  if (!matches.missing.empty()) {
    columns.ask(
        fmt::format("the plant has no joint for: {}; {}", fmt::join(matches.missing, ", "),
                    matches.free_joints.empty()
                        ? "each of its joints has columns already"
                        : fmt::format("free are: {}", fmt::join(matches.free_joints, ", "))));
  }
  for (Column& column : columns.all) {
    column.assumed = column.assumed ||
                     (!column.said.names_joint && matches.guessed_keys.contains(column.said.joint));
  }
  return matches.joint_of_key;
}

}  // namespace

void find_joints(Columns& columns, const std::vector<std::string>& joints) {
  join_nameless_positions(columns);
  const std::vector<std::string> keys = joints_of(columns);
  const auto is_joint = [&](const std::string& key) {
    return std::find(keys.begin(), keys.end(), key) != keys.end();
  };
  for (Column& column : columns.all) {
    if (column.is(Quantity::kPosition) || is_joint(column.said.joint)) continue;
    if (keys.size() == 1 && column.said.joint.empty())
      column.said.joint = keys.front();
    else if (column.drives() && !column.constant())
      find_joint_of_effort(columns, column);
  }
  std::map<std::string, std::string> names;
  if (!joints.empty()) names = names_of(columns, keys, joints);
  for (Column& column : columns.all) {
    if (column.said.names_joint) continue;
    const auto named = names.find(column.said.joint);
    if (named != names.end())
      column.said.joint = named->second;
    else if (is_joint(column.said.joint))
      column.said.joint = plain_name(column.said.joint);
  }
}

}  // namespace ravencal::guess
