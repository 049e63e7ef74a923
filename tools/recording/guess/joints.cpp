// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <map>
#include <sstream>

#include "guess/columns.hpp"
#include "guess/relation.hpp"

namespace ravencal::guess {
namespace {

/// A column without a word for its joint moves as one of its joint's positions does.
constexpr double kSameJointCorrelation = 0.9;

std::vector<std::string> words_of(const std::string& key) {
  std::vector<std::string> words;
  std::istringstream text(key);
  for (std::string word; std::getline(text, word, '_');) {
    for (char& c : word) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    words.push_back(word);
  }
  return words;
}

/// 1: the same words; 0: none in common.
double likeness(const std::string& key, const std::string& joint) {
  const std::vector<std::string> a = words_of(key), b = words_of(joint);
  const auto common = std::count_if(a.begin(), a.end(), [&](const std::string& word) {
    return std::find(b.begin(), b.end(), word) != b.end();
  });
  const std::size_t all = std::max(a.size(), b.size());
  return all == 0 ? 0.0 : static_cast<double>(common) / static_cast<double>(all);
}

/// Keys to the plant's joints: the most alike first, the others in order behind their predecessor.
class Matching {
 public:
  Matching(const std::vector<std::string>& keys, const std::vector<std::string>& joints)
      : keys_(keys), joints_(joints), taken_(joints.size(), false), of_(keys.size()) {
    take_alike();
    take_in_order();
  }

  [[nodiscard]] std::map<std::string, std::string> names(Columns& columns) const {
    std::map<std::string, std::string> names;
    std::vector<std::string> guessed, missing;
    for (std::size_t k = 0; k < keys_.size(); ++k) {
      const std::string word = keys_[k].empty() ? "no word" : keys_[k];
      if (!of_[k]) {
        missing.push_back(word);
        continue;
      }
      names[keys_[k]] = joints_[*of_[k]];
      if (likeness(keys_[k], joints_[*of_[k]]) < 1.0)
        guessed.push_back(fmt::format("{} = {}", word, joints_[*of_[k]]));
    }
    if (!guessed.empty())
      columns.ask(
          fmt::format("joints of the plant, by likeness and order: {}", fmt::join(guessed, ", ")));
    if (!missing.empty())
      columns.ask(fmt::format("the plant has no joint for: {}", fmt::join(missing, ", ")));
    return names;
  }

 private:
  void take_alike() {
    while (true) {
      double best = 0.0;
      std::size_t key = 0, joint = 0;
      for (std::size_t k = 0; k < keys_.size(); ++k) {
        for (std::size_t j = 0; j < joints_.size(); ++j) {
          if (of_[k] || taken_[j] || likeness(keys_[k], joints_[j]) <= best) continue;
          best = likeness(keys_[k], joints_[j]);
          key = k;
          joint = j;
        }
      }
      if (!(best > 0.0)) return;
      of_[key] = joint;
      taken_[joint] = true;
    }
  }
  void take_in_order() {
    std::size_t next = 0;
    for (std::size_t k = 0; k < keys_.size(); ++k) {
      if (!of_[k]) {
        while (next < joints_.size() && taken_[next]) ++next;
        if (next == joints_.size()) continue;
        of_[k] = next;
        taken_[next] = true;
      }
      next = *of_[k] + 1;
    }
  }

  const std::vector<std::string>& keys_;
  const std::vector<std::string>& joints_;
  std::vector<bool> taken_;
  std::vector<std::optional<std::size_t>> of_;
};

/// Positions whose name has no joint: the joint as whose position they move.
void join_nameless_positions(Columns& columns) {
  for (Column& column : columns.all) {
    if (!column.is(Quantity::kPosition) || !column.said.joint.empty()) continue;
    double best = kSameJointCorrelation;
    const Column* found = nullptr;
    for (const Column& other : columns.all) {
      if (!other.is(Quantity::kPosition) || other.said.joint.empty()) continue;
      const auto line = line_through(other.values, column.values);
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
  double share = kLeastExplained;
  for (const Column& position : columns.all) {
    if (!position.is_usable_position() || position.said.side == Side::kCommand) continue;
    const auto fit = effort_of_motion(columns.t_s, position.si(), effort.values);
    if (!fit || fit->share <= share) continue;
    share = fit->share;
    best = &position;
  }
  if (best == nullptr) return;
  effort.said.joint = best->said.joint;
  effort.because = fmt::format("{} explains {:.0f} % of it", best->name, 100.0 * share);
  columns.ask(fmt::format("{}: of which joint? Taken as that of {}", effort.name, best->name));
}

std::string plain_name(const std::string& key) {
  if (key.empty()) return "joint";
  const bool digits =
      std::all_of(key.begin(), key.end(), [](char c) { return c >= '0' && c <= '9'; });
  return digits ? "joint" + key : key;
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
  if (!joints.empty()) names = Matching(keys, joints).names(columns);
  for (Column& column : columns.all) {
    const auto named = names.find(column.said.joint);
    if (named != names.end())
      column.said.joint = named->second;
    else if (is_joint(column.said.joint))
      column.said.joint = plain_name(column.said.joint);
  }
}

}  // namespace ravencal::guess
