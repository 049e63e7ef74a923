// SPDX-License-Identifier: Apache-2.0
#include "exchange/joint_states.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "exchange/joint_axis.hpp"
#include "exchange/named_array.hpp"

namespace ravencal::exchange {
namespace {

constexpr std::string_view kCdr = "cdr";
constexpr std::int64_t kLatestNs = std::int64_t{1} << 62U;  // 146 years; differences fit 64 bits

}  // namespace

void JointStateTopics::add_topic(std::uint64_t id, std::string name, std::string type,
                                 std::string encoding) {
  names_[id] = name;
  Topic& topic = topics_[name];
  topic.name = std::move(name);
  topic.type = std::move(type);
  topic.encoding = std::move(encoding);
}

bool JointStateTopics::is_wanted(std::uint64_t id) const {
  const auto name = names_.find(id);
  return name != names_.end() && wanted_type(topics_.at(name->second));
}

core::Status JointStateTopics::bad_part(std::string why) {
  if (!skip_bad_)
    return core::data_error(fmt::format("{}: {}; --skip-bad leaves it out", path_.string(), why));
  events_.push_back({0, "drop", std::move(why)});
  return {};
}

std::optional<JointMessageType> JointStateTopics::wanted_type(const Topic& topic) {
  if (topic.encoding != kCdr) return std::nullopt;
  return joint_message_type(topic.type);
}

JointSet& JointStateTopics::set_of(const Topic& topic, const std::vector<std::string>& joints) {
  std::vector<std::string> sorted = joints;
  std::sort(sorted.begin(), sorted.end());
  const auto [it, is_new] = set_index_.try_emplace({topic.name, std::move(sorted)}, sets_.size());
  if (is_new) sets_.push_back({topic.name, *wanted_type(topic), joints});
  return sets_[it->second];
}

bool JointStateTopics::add_values(Topic& topic, JointSet& set, const JointMessage& message) {
  for (const JointValue& value : message.values) {
    const std::string& joint = message.names[value.joint];
    const auto [it, is_new] = set.index.try_emplace({joint, value.quantity}, set.columns.size());
    if (is_new && topic.columns++ >= record::kMostChannels) return false;
    if (is_new) set.columns.push_back({joint, value.quantity, {}});
    std::vector<double>& column = set.columns[it->second].values;
    column.resize(set.t_ns.size(), kLost);
    column.back() = value.value;
  }
  return true;
}

core::Status JointStateTopics::add_message(std::uint64_t id, std::int64_t log_time_ns,
                                           std::span<const std::uint8_t> bytes) {
  Topic& topic = topics_.at(names_.at(id));
  const std::size_t number = ++topic.messages;
  const auto bad = [&](std::string_view why) {
    return bad_part(fmt::format("{}, message {}: {}", topic.name, number, why));
  };
  const auto message = decode_joint_message(*wanted_type(topic), bytes);
  if (!message.ok()) return bad(message.error().message);
  if (message->values.empty()) return {};
  const std::int64_t t_ns = message->stamp_ns != 0 ? message->stamp_ns : log_time_ns;
  if (t_ns > kLatestNs || t_ns < -kLatestNs) return bad("its stamp is out of range");
  JointSet& set = set_of(topic, message->names);
  if (std::binary_search(set.t_ns.begin(), set.t_ns.end(), t_ns)) {
    ++set.repeated;
    return {};
  }
  if (!set.t_ns.empty() && t_ns < set.t_ns.back())
    return bad(fmt::format("its stamp is {:.3f} ms before the last one's",
                           1e-6 * static_cast<double>(set.t_ns.back() - t_ns)));
  set.t_ns.push_back(t_ns);
  if (!add_values(topic, set, *message))
    return bad(fmt::format("with it the topic has more than {} columns", record::kMostChannels));
  return {};
}

core::Error JointStateTopics::no_messages() const {
  std::string names;
  for (const auto& [name, topic] : topics_) {
    names += fmt::format("{} {} ({}{})", names.empty() ? "" : ",", topic.name, topic.type,
                         topic.encoding == kCdr ? "" : ", encoded as " + topic.encoding);
  }
  return core::data_error(fmt::format("{}: holds no message of {} in CDR; its topics:{}",
                                      path_.string(), kJointMessageTypes,
                                      names.empty() ? " none" : names));
}

core::Result<record::Table> JointStateTopics::table() && {
  std::erase_if(sets_, [](const JointSet& set) { return set.columns.empty(); });
  if (sets_.empty()) return no_messages();
  for (JointSet& set : sets_) {
    for (JointColumn& column : set.columns) column.values.resize(set.t_ns.size(), kLost);
  }
  record::Table table;
  table.path = path_;
  fill_joint_table(std::move(sets_), table);
  table.events = std::move(events_);
  for (record::Event& event : table.events) event.t_ns = table.t_ns.front();
  for (const auto& [name, topic] : topics_) {
    if (wanted_type(topic)) continue;
    table.left_out[name] = fmt::format("it is a topic of {}; joints are read from {} in CDR",
                                       topic.type, kJointMessageTypes);
  }
  return table;
}

}  // namespace ravencal::exchange
