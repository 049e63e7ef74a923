// SPDX-License-Identifier: Apache-2.0
#include "exchange/joint_states.hpp"

#include <fastcdr/Cdr.h>
#include <fastcdr/FastBuffer.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/median.hpp"
#include "exchange/named_array.hpp"

namespace ravencal::exchange {
namespace {

constexpr double kLost = std::numeric_limits<double>::quiet_NaN();
constexpr std::string_view kCdr = "cdr";
/// A topic is not interpolated across more of its median periods: fewer lost messages are usual on
/// a network, more are an outage. No source: a choice.
constexpr std::int64_t kMostLostPeriods = 5;
/// Nor across more than this where its periods are shorter: what `ravencal merge` allows a truth.
constexpr std::int64_t kLongestGapNs = 50'000'000;
constexpr std::int64_t kLatestNs = std::int64_t{1} << 62U;  // 146 years; differences fit 64 bits

bool is_joint_state(const std::string& type) {
  return type == "sensor_msgs/msg/JointState" || type == "sensor_msgs/JointState";
}

/// Reads CDR and trusts no length in it: what a list claims must be there.
class CdrReader {
 public:
  explicit CdrReader(std::span<const std::uint8_t> bytes)
      : size_(bytes.size()),
        // The buffer is read only, but its owner takes a pointer to mutable bytes.
        buffer_(reinterpret_cast<char*>(const_cast<std::uint8_t*>(bytes.data())), bytes.size()),
        cdr_(buffer_, eprosima::fastcdr::Cdr::DEFAULT_ENDIAN, eprosima::fastcdr::Cdr::DDS_CDR) {
    cdr_.read_encapsulation();
  }

  template <typename T>
  T number() {
    T value{};
    cdr_ >> value;
    return value;
  }
  std::string text() {
    std::string value;
    cdr_ >> value;
    return value;
  }
  std::vector<std::string> texts() {
    const std::size_t count = length(sizeof(std::uint32_t));
    std::vector<std::string> values;
    for (std::size_t i = 0; i < count; ++i) values.push_back(text());
    return values;
  }
  std::vector<double> numbers() {
    std::vector<double> values(length(sizeof(double)));
    if (!values.empty()) cdr_.deserializeArray(values.data(), values.size());
    return values;
  }

 private:
  std::size_t length(std::size_t least_bytes_each) {
    const auto count = number<std::uint32_t>();
    const std::size_t left = size_ - std::min(size_, cdr_.getSerializedDataLength());
    if (count > left / least_bytes_each)
      throw eprosima::fastcdr::exception::NotEnoughMemoryException(
          "a list is longer than the message");
    return count;
  }

  std::size_t size_;
  eprosima::fastcdr::FastBuffer buffer_;
  eprosima::fastcdr::Cdr cdr_;
};

}  // namespace

core::Result<JointState> decode_joint_state(std::span<const std::uint8_t> bytes) {
  constexpr std::size_t kEncapsulation = 4;
  if (bytes.size() < kEncapsulation || bytes[0] != 0 || bytes[1] > 1)
    return core::data_error("it does not begin as CDR does");
  JointState state;
  try {
    CdrReader reader(bytes);
    const auto seconds = reader.number<std::int32_t>();
    const auto nanoseconds = reader.number<std::uint32_t>();
    state.stamp_ns = std::int64_t{seconds} * 1'000'000'000 + nanoseconds;
    (void)reader.text();  // frame_id
    state.names = reader.texts();
    state.position = reader.numbers();
    state.velocity = reader.numbers();
    state.effort = reader.numbers();
  } catch (const eprosima::fastcdr::exception::Exception&) {
    return core::data_error(fmt::format("its {} bytes are no JointState", bytes.size()));
  }
  for (const auto* values : {&state.position, &state.velocity, &state.effort}) {
    if (values->empty() || values->size() == state.names.size()) continue;
    return core::data_error(
        fmt::format("it has {} names and {} values", state.names.size(), values->size()));
  }
  return state;
}

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
  return name != names_.end() && is_wanted(topics_.at(name->second));
}

core::Status JointStateTopics::bad_part(std::string why) {
  if (!skip_bad_)
    return core::data_error(fmt::format("{}: {}; --skip-bad leaves it out", path_.string(), why));
  events_.push_back({0, "drop", std::move(why)});
  return {};
}

bool JointStateTopics::is_wanted(const Topic& topic) {
  return is_joint_state(topic.type) && topic.encoding == kCdr;
}

bool JointStateTopics::add_values(Topic& topic, const std::vector<std::string>& joints,
                                  std::string_view quantity, const std::vector<double>& values) {
  for (std::size_t i = 0; i < values.size(); ++i) {
    std::string name = fmt::format("{}/{}/{}", topic.name, joints[i], quantity);
    const auto [it, is_new] = topic.index.emplace(name, topic.columns.size());
    if (it->second >= record::kMostChannels) return false;
    if (is_new) topic.columns.push_back({std::move(name), {}});
    std::vector<double>& column = topic.columns[it->second].values;
    column.resize(topic.t_ns.size(), kLost);
    column.back() = values[i];
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
  const auto state = decode_joint_state(bytes);
  if (!state.ok()) return bad(state.error().message);
  const std::int64_t t_ns = state->stamp_ns != 0 ? state->stamp_ns : log_time_ns;
  if (!topic.t_ns.empty() && t_ns < topic.t_ns.back())
    return bad(fmt::format("its stamp is {:.3f} ms before the last one's",
                           1e-6 * static_cast<double>(topic.t_ns.back() - t_ns)));
  if (std::abs(t_ns) > kLatestNs) return bad("its stamp is out of range");
  topic.t_ns.push_back(t_ns);
  const bool has_room = add_values(topic, state->names, "position", state->position) &&
                        add_values(topic, state->names, "velocity", state->velocity) &&
                        add_values(topic, state->names, "effort", state->effort);
  if (!has_room)
    return bad(fmt::format("with it the topic has more than {} columns", record::kMostChannels));
  return {};
}

/// Both rise.
std::vector<double> JointStateTopics::at(const Topic& topic, const Column& column,
                                         const std::vector<std::int64_t>& t_ns) {
  std::vector<std::int64_t> steps;
  for (std::size_t i = 1; i < topic.t_ns.size(); ++i)
    steps.push_back(topic.t_ns[i] - topic.t_ns[i - 1]);
  const std::int64_t median_ns = steps.empty() ? 0 : core::upper_median(steps);
  const std::int64_t longest_ns =
      std::max(kMostLostPeriods * std::min(median_ns, kLatestNs / kMostLostPeriods), kLongestGapNs);
  std::vector<double> values;
  std::size_t next = 0;
  for (const std::int64_t now_ns : t_ns) {
    while (next < topic.t_ns.size() && topic.t_ns[next] < now_ns) ++next;
    if (next == topic.t_ns.size() || (next == 0 && topic.t_ns[0] != now_ns)) {
      values.push_back(kLost);
    } else if (topic.t_ns[next] == now_ns) {
      values.push_back(column.values[next]);
    } else {
      const std::int64_t before_ns = topic.t_ns[next - 1];
      const std::int64_t gap_ns = topic.t_ns[next] - before_ns;
      const double share = static_cast<double>(now_ns - before_ns) / static_cast<double>(gap_ns);
      const double before = column.values[next - 1];
      values.push_back(gap_ns > longest_ns ? kLost
                                           : before + share * (column.values[next] - before));
    }
  }
  return values;
}

core::Error JointStateTopics::no_messages() const {
  std::string names;
  for (const auto& [name, topic] : topics_) {
    names += fmt::format("{} {} ({}{})", names.empty() ? "" : ",", topic.name, topic.type,
                         topic.encoding == kCdr ? "" : ", encoded as " + topic.encoding);
  }
  return core::data_error(
      fmt::format("{}: holds no message of sensor_msgs/msg/JointState in CDR; its topics:{}",
                  path_.string(), names.empty() ? " none" : names));
}

core::Result<record::Table> JointStateTopics::table() && {
  const Topic* most = nullptr;
  for (auto& [name, topic] : topics_) {
    for (Column& column : topic.columns) column.values.resize(topic.t_ns.size(), kLost);
    if (!topic.columns.empty() && (most == nullptr || topic.t_ns.size() > most->t_ns.size()))
      most = &topic;
  }
  if (most == nullptr) return no_messages();
  record::Table table;
  table.path = path_;
  table.t_ns = most->t_ns;
  table.events = std::move(events_);
  for (record::Event& event : table.events) event.t_ns = table.t_ns.front();
  for (auto& [name, topic] : topics_) {
    if (!is_wanted(topic))
      table.left_out[topic.name] =
          fmt::format("it is a topic of {}; joints are read from sensor_msgs/msg/JointState in CDR",
                      topic.type);
    for (Column& column : topic.columns) {
      table.columns.push_back(
          {column.name,
           &topic == most ? std::move(column.values) : at(topic, column, table.t_ns),
           {}});
    }
  }
  return table;
}

}  // namespace ravencal::exchange
