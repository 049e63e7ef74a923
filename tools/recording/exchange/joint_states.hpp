// SPDX-License-Identifier: Apache-2.0
//
// Messages of joints (joint_message.hpp), as MCAP and rosbag2 files hold them, as columns.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "exchange/joint_message.hpp"
#include "exchange/joint_table.hpp"
#include "record/table.hpp"

namespace ravencal::exchange {

/// Collects the messages of a file, publisher by publisher, and makes a table of them.
class JointStateTopics {
 public:
  JointStateTopics(std::filesystem::path path, bool skip_bad)
      : path_(std::move(path)), skip_bad_(skip_bad) {}

  /// A topic of the file, of whatever type. `encoding` is that of its messages: "cdr".
  void add_topic(std::uint64_t id, std::string name, std::string type, std::string encoding);
  /// True if messages of that topic are wanted.
  [[nodiscard]] bool is_wanted(std::uint64_t id) const;
  /// Errors: the message cannot be read, or is before the last of the same joints; with skip_bad an
  /// event of the table instead. One whose stamp was there before repeats it and is counted.
  core::Status add_message(std::uint64_t id, std::int64_t log_time_ns,
                           std::span<const std::uint8_t> bytes);
  /// What else of the file cannot be read: an error, or an event.
  core::Status bad_part(std::string why);

  /// Columns TOPIC/JOINT/QUANTITY as fill_joint_table makes them. Topics of other types are left
  /// out. Errors: there is no message of joints.
  core::Result<record::Table> table() &&;

 private:
  struct Topic {
    std::string name;
    std::string type;
    std::string encoding;
    std::size_t messages = 0;  ///< read or not
    std::size_t columns = 0;   ///< of all its sets
  };
  [[nodiscard]] static std::optional<JointMessageType> wanted_type(const Topic& topic);
  JointSet& set_of(const Topic& topic, const std::vector<std::string>& joints);
  /// False: there are more columns than a recording has.
  static bool add_values(Topic& topic, JointSet& set, const JointMessage& message);
  [[nodiscard]] core::Error no_messages() const;

  std::filesystem::path path_;
  bool skip_bad_;
  std::map<std::uint64_t, std::string> names_;  ///< of the topics; several ids may share one
  std::map<std::string, Topic> topics_;
  std::vector<JointSet> sets_;
  std::map<std::pair<std::string, std::vector<std::string>>, std::size_t> set_index_;
  std::vector<record::Event> events_;
};

}  // namespace ravencal::exchange
