// SPDX-License-Identifier: Apache-2.0
#include "record/raven_state_message.hpp"

#include <cmath>

#include "record/ros_bytes.hpp"

namespace ravencal::record {
namespace {

using core::RavenField;

constexpr std::size_t kArms = 2;

enum class Number { kInt32, kFloat32 };

struct MessageField {
  RavenField field;
  Number number;
};

// Fields between the header and the duration dt, and behind it, in the message's order.
constexpr std::array kBeforeDt = {
    MessageField{RavenField::kRunlevel, Number::kInt32},
    MessageField{RavenField::kSublevel, Number::kInt32},
    MessageField{RavenField::kLastSeq, Number::kInt32},
    MessageField{RavenField::kType, Number::kInt32},
    MessageField{RavenField::kPos, Number::kInt32},
    MessageField{RavenField::kOri, Number::kFloat32},
    MessageField{RavenField::kOriD, Number::kFloat32},
    MessageField{RavenField::kPosD, Number::kInt32},
};
constexpr std::array kAfterDt = {
    MessageField{RavenField::kEncVals, Number::kInt32},
    MessageField{RavenField::kDac, Number::kInt32},
    MessageField{RavenField::kTau, Number::kFloat32},
    MessageField{RavenField::kMpos, Number::kFloat32},
    MessageField{RavenField::kJpos, Number::kFloat32},
    MessageField{RavenField::kMvel, Number::kFloat32},
    MessageField{RavenField::kJvel, Number::kFloat32},
    MessageField{RavenField::kMposD, Number::kFloat32},
    MessageField{RavenField::kJposD, Number::kFloat32},
    MessageField{RavenField::kGraspD, Number::kFloat32},
    MessageField{RavenField::kEncOffsets, Number::kFloat32},
    MessageField{RavenField::kJacVel, Number::kFloat32},
    MessageField{RavenField::kJacF, Number::kFloat32},
};

constexpr std::string_view kSeparator =
    "================================================================================\n";

constexpr std::string_view kRavenStateFields =
    "Header      hdr\n"
    "int32       runlevel\n"
    "int32       sublevel\n"
    "int32       last_seq\n"
    "int32[2]    type\n"
    "int32[6]    pos\n"
    "float32[18] ori\n"
    "float32[18] ori_d\n"
    "int32[6]    pos_d\n"
    "duration    dt\n"
    "int32[16]   encVals\n"
    "int32[16]   dac_val\n"
    "float32[16] tau\n"
    "float32[16] mpos\n"
    "float32[16] jpos\n"
    "float32[16] mvel\n"
    "float32[16] jvel\n"
    "float32[16] mpos_d\n"
    "float32[16] jpos_d\n"
    "float32[2]  grasp_d\n"
    "float32[16] encoffsets\n"
    "float32[12] jac_vel\n"
    "float32[12] jac_f\n";

constexpr std::string_view kJointStateFields =
    "Header header\n"
    "string[] name\n"
    "float64[] position\n"
    "float64[] velocity\n"
    "float64[] effort\n";

constexpr std::string_view kHeaderFields =
    "MSG: std_msgs/Header\n"
    "uint32 seq\n"
    "time stamp\n"
    "string frame_id\n";

std::string with_header(std::string_view fields) {
  std::string text(fields);
  text += kSeparator;
  text += kHeaderFields;
  return text;
}

/// Catalogue index of element `element` of half `half` of a field.
std::size_t index_of(RavenField field, std::size_t half, std::size_t element, bool gold) {
  const bool other_arm = half != (gold ? 0U : 1U);
  return core::catalogue_index(field, element, other_arm);
}

/// Calls `each(number type, catalogue index)` for every number of the fields, in their order.
template <std::size_t N, typename Each>
void for_each_number(const std::array<MessageField, N>& fields, bool gold, Each&& each) {
  for (const MessageField& field : fields) {
    const core::RavenFieldInfo& info = core::info_of(field.field);
    for (std::size_t half = 0; half < (info.per_arm ? kArms : 1); ++half) {
      for (std::size_t element = 0; element < info.count; ++element)
        each(field.number, index_of(field.field, half, element, gold));
    }
  }
}

template <std::size_t N>
void read_fields(RosReader& reader, const std::array<MessageField, N>& fields, bool gold,
                 RavenStateMessage& message) {
  for_each_number(fields, gold, [&](Number number, std::size_t index) {
    message.values[index] = number == Number::kInt32
                                ? static_cast<double>(reader.number<std::int32_t>())
                                : static_cast<double>(reader.number<float>());
  });
}

std::int32_t whole_number(double value) {
  constexpr double kLargest = 2147483647.0;
  if (std::isnan(value)) return 0;
  return static_cast<std::int32_t>(std::lround(std::fmin(std::fmax(value, -kLargest), kLargest)));
}

template <std::size_t N>
void write_fields(const RavenStateMessage& message, const std::array<MessageField, N>& fields,
                  bool gold, RosWriter& writer) {
  for_each_number(fields, gold, [&](Number number, std::size_t index) {
    const double value = message.values[index];
    if (number == Number::kInt32) {
      writer.number(whole_number(value));
    } else {
      writer.number(static_cast<float>(value));
    }
  });
}

std::vector<double> read_numbers(RosReader& reader) {
  std::vector<double> values(reader.count(sizeof(double)));
  for (double& value : values) value = reader.number<double>();
  return values;
}

void write_numbers(const std::vector<double>& values, RosWriter& writer) {
  writer.number(static_cast<std::uint32_t>(values.size()));
  for (const double value : values) writer.number(value);
}

}  // namespace

const RosMessageType& raven_state_type() {
  static const std::string definition = with_header(kRavenStateFields);
  static const RosMessageType type{"raven_2/raven_state", "ce9e7f4969049d8bb365de3c98461a01",
                                   definition};
  return type;
}

const RosMessageType& joint_state_type() {
  static const std::string definition = with_header(kJointStateFields);
  static const RosMessageType type{"sensor_msgs/JointState", "3066dcd76a6cfaef579bd0f34173e9fd",
                                   definition};
  return type;
}

std::optional<RavenStateMessage> decode_raven_state(std::span<const std::uint8_t> bytes,
                                                    bool gold) {
  RosReader reader(bytes);
  RavenStateMessage message;
  message.stamp_ns = reader.header();
  read_fields(reader, kBeforeDt, gold, message);
  const auto dt_s = reader.number<std::int32_t>();
  const auto dt_ns = reader.number<std::int32_t>();
  message.dt_ns = std::int64_t{dt_s} * kRosSecondNs + dt_ns;
  read_fields(reader, kAfterDt, gold, message);
  message.values[core::catalogue_index(RavenField::kTime, 0)] =
      1e-9 * static_cast<double>(message.stamp_ns);
  if (!reader.whole()) return std::nullopt;
  return message;
}

std::vector<std::uint8_t> encode_raven_state(const RavenStateMessage& message, bool gold) {
  RosWriter writer;
  writer.header(message.stamp_ns);
  write_fields(message, kBeforeDt, gold, writer);
  writer.number(static_cast<std::int32_t>(message.dt_ns / kRosSecondNs));
  writer.number(static_cast<std::int32_t>(message.dt_ns % kRosSecondNs));
  write_fields(message, kAfterDt, gold, writer);
  return writer.take();
}

std::optional<JointStateMessage> decode_joint_state(std::span<const std::uint8_t> bytes) {
  RosReader reader(bytes);
  JointStateMessage message;
  message.stamp_ns = reader.header();
  message.names.resize(reader.count(sizeof(std::uint32_t)));
  for (std::string& name : message.names) name = reader.text();
  message.positions = read_numbers(reader);
  message.velocities = read_numbers(reader);
  (void)read_numbers(reader);
  if (!reader.whole()) return std::nullopt;
  return message;
}

std::vector<std::uint8_t> encode_joint_state(const JointStateMessage& message) {
  RosWriter writer;
  writer.header(message.stamp_ns);
  writer.number(static_cast<std::uint32_t>(message.names.size()));
  for (const std::string& name : message.names) writer.text(name);
  write_numbers(message.positions, writer);
  write_numbers(message.velocities, writer);
  write_numbers({}, writer);
  return writer.take();
}

}  // namespace ravencal::record
