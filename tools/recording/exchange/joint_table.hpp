// SPDX-License-Identifier: Apache-2.0
//
// One table of what several publishers say of their joints. Private to exchange/.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "exchange/joint_message.hpp"
#include "record/table.hpp"

namespace ravencal::exchange {

struct JointColumn {
  std::string joint;
  std::string quantity;
  std::vector<double> values;  ///< as many as stamps, once finished; NaN: not said
};

/// The messages of a topic that have the same joints, in whatever order: those of one publisher.
struct JointSet {
  std::string topic;
  JointMessageType type = JointMessageType::kJointState;
  std::vector<std::string> joints{};
  std::vector<std::int64_t> t_ns{};
  std::vector<JointColumn> columns{};  ///< in the order of appearance
  std::map<std::pair<std::string, std::string>, std::size_t> index{};  ///< by joint and quantity
  std::size_t repeated = 0;  ///< messages left out, because an earlier one has their stamp
};

/// Fills stamps, columns, left_out and note. The rows are the stamps of one set: of two sets that
/// share a joint, a JointState before other types, then the one with more messages; else that with
/// more joints, those that come in one sweep counted as one set, then with more quantities, then
/// with more messages. A set with less than a twentieth of the most messages is never it. Sets of
/// the same sweep keep their values, others are interpolated (joint_axis.hpp). Left out are sets
/// that share a joint with one of the same topic, and what another type of message repeats. `sets`
/// is not empty and each has a column.
void fill_joint_table(std::vector<JointSet> sets, record::Table& table);

}  // namespace ravencal::exchange
