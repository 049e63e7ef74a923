// SPDX-License-Identifier: Apache-2.0
//
// An MCAP file where the bytes begin like one; otherwise one message of joints, so that the
// reader of messages is reached. The number of bytes chooses whether bad parts are skipped.
#include "exchange/mcap.hpp"

#include "exchange/joint_message.hpp"
#include "fuzz/inputs.hpp"

namespace ravencal::fuzz {

void try_mcap(Bytes bytes) {
  if (!text_of(bytes).starts_with("\x89MCAP")) {
    using enum exchange::JointMessageType;
    for (const auto type : {kJointState, kDynamicJointState, kControllerState}) {
      const auto message = exchange::decode_joint_message(type, bytes);
      if (!message.ok()) continue;
      for (const exchange::JointValue& value : message->values)
        promise(value.joint < message->names.size(), "a name for each value");
      promise(message->values.size() * sizeof(double) <= bytes.size(), "no value is invented");
    }
    return;
  }
  const auto path = scratch_file("fuzz.mcap", bytes);
  record::LoadOptions options;
  options.skip_bad = bytes.size() % 2 == 1;
  const auto table = exchange::read_mcap(path, options);
  if (!read_or_words(table, path.string())) return;
  promise(!table->t_ns.empty() && !table->columns.empty(), "a table has rows and columns");
  for (std::size_t i = 1; i < table->t_ns.size(); ++i)
    promise(table->t_ns[i - 1] <= table->t_ns[i], "time never decreases");
  for (const record::TableColumn& column : table->columns)
    promise(column.values.size() == table->t_ns.size(), "as many values as stamps");
}

}  // namespace ravencal::fuzz
