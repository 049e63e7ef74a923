// SPDX-License-Identifier: Apache-2.0
//
// Which joint of a plant the words of a file's columns mean, where they are not its name. Private
// to guess/.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

namespace ravencal::guess {

struct JointMatches {
  std::map<std::string, std::string> joint_of_key;
  std::set<std::string> guessed_keys;
  std::vector<std::string> guessed;      ///< "KEY = JOINT" of those that are to be checked
  std::vector<std::string> missing;      ///< keys without a joint
  std::vector<std::string> free_joints;  ///< joints without a key
};

/// Keys (ColumnName::joint) to joints, each once: equal words; then numbers, as they stand where
/// the joints have those numbers and else in order; then a word in common, if it tells one joint;
/// then the rest in order, if as many are left of both. The order is a guess that is to be checked;
/// what none of these decides is left open.
JointMatches match_joints(const std::vector<std::string>& keys,
                          const std::vector<std::string>& joints);

}  // namespace ravencal::guess
