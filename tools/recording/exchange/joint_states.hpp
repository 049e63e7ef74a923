// SPDX-License-Identifier: Apache-2.0
//
// sensor_msgs/msg/JointState of ROS 2, as MCAP and rosbag2 files hold it, as columns.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "record/table.hpp"

namespace ravencal::exchange {

/// One message, in SI units; a quantity is empty where the message leaves it out.
struct JointState {
  std::int64_t stamp_ns = 0;  ///< since 1970; 0: the publisher set none
  std::vector<std::string> names;
  std::vector<double> position;
  std::vector<double> velocity;
  std::vector<double> effort;
};

/// Takes a serialised message apart (CDR, OMG DDS-RTPS 2.2, 10; either byte order). Errors (kData)
/// say what of it is wrong, without the file.
core::Result<JointState> decode_joint_state(std::span<const std::uint8_t> bytes);

/// Collects the messages of a file, topic by topic, and makes a table of them.
class JointStateTopics {
 public:
  JointStateTopics(std::filesystem::path path, bool skip_bad)
      : path_(std::move(path)), skip_bad_(skip_bad) {}

  /// A topic of the file, of whatever type. `encoding` is that of its messages: "cdr".
  void add_topic(std::uint64_t id, std::string name, std::string type, std::string encoding);
  /// True if messages of that topic are wanted.
  [[nodiscard]] bool is_wanted(std::uint64_t id) const;
  /// Errors: the message cannot be read, or is before the last of its topic; with skip_bad an event
  /// of the table instead.
  core::Status add_message(std::uint64_t id, std::int64_t log_time_ns,
                           std::span<const std::uint8_t> bytes);
  /// What else of the file cannot be read: an error, or an event.
  core::Status bad_part(std::string why);

  /// Columns TOPIC/JOINT/position, velocity and effort at the stamps of the topic with most
  /// messages. Others are interpolated linearly between their stamps, and NaN before, behind and in
  /// gaps. Topics of other types are left out. Errors: there is no message of that type.
  core::Result<record::Table> table() &&;

 private:
  struct Column {
    std::string name;
    std::vector<double> values;  ///< as many as stamps, once finished
  };
  struct Topic {
    std::string name;
    std::string type;
    std::string encoding;
    std::vector<std::int64_t> t_ns;
    std::vector<Column> columns;  ///< in the order in which they appear
    std::map<std::string, std::size_t> index;
    std::size_t messages = 0;  ///< read or not
  };
  [[nodiscard]] static bool is_wanted(const Topic& topic);
  /// False: there are more columns than a recording has.
  static bool add_values(Topic& topic, const std::vector<std::string>& joints,
                         std::string_view quantity, const std::vector<double>& values);
  static std::vector<double> at(const Topic& topic, const Column& column,
                                const std::vector<std::int64_t>& t_ns);
  [[nodiscard]] core::Error no_messages() const;

  std::filesystem::path path_;
  bool skip_bad_;
  std::map<std::uint64_t, std::string> names_;  ///< of the topics; several ids may share one
  std::map<std::string, Topic> topics_;
  std::vector<record::Event> events_;
};

}  // namespace ravencal::exchange
