// SPDX-License-Identifier: Apache-2.0
//
// The first byte chooses: CAN frames, configuration text, readings of an axis, a recording to
// replay, a message about a CAN link.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>

#include "fuzz/inputs.hpp"
#include "quadrature_reader/axis.hpp"
#include "quadrature_reader/config.hpp"
#include "quadrature_reader/sources/can_decoder.hpp"
#include "quadrature_reader/sources/can_link.hpp"
#include "quadrature_reader/sources/replay.hpp"
#include "record/recording.hpp"

namespace ravencal::fuzz {
namespace {

using namespace quadrature_reader;

/// Takes numbers off the front of the input; zeros once it is used up.
class Numbers {
 public:
  explicit Numbers(Bytes bytes) : left_(bytes) {}
  [[nodiscard]] bool empty() const { return left_.empty(); }
  template <typename T>
  T take() {
    T value{};
    const std::size_t size = std::min(sizeof(T), left_.size());
    std::memcpy(&value, left_.data(), size);
    left_ = left_.subspan(size);
    return value;
  }

 private:
  Bytes left_;
};

void try_can(Numbers bytes) {
  SourceSettings settings;
  settings.kind = SourceKind::kCan;
  settings.position_timeout_ns = 50'000'000;
  settings.heartbeat_timeout_ns = 100'000'000;
  settings.start_nodes = true;
  for (std::uint8_t axis = 0; axis < 2; ++axis) {
    CanEncoder encoder;
    encoder.axis = axis;
    encoder.id = 0x180U + axis;
    encoder.canopen_node = axis;
    const auto layout = bytes.take<std::uint32_t>();
    encoder.byte_count = 1 + layout % 8;
    encoder.byte_offset = (layout >> 8U) % (65 - encoder.byte_count);
    encoder.counter_bits = 2 + (layout >> 16U) % (8 * encoder.byte_count - 1);
    encoder.big_endian = ((layout >> 24U) & 1U) != 0;
    encoder.is_signed = ((layout >> 25U) & 1U) != 0;
    encoder.max_counts_per_s = ((layout >> 26U) & 1U) != 0 ? 1e5 : 0.0;
    settings.can.push_back(encoder);
  }
  CanDecoder decoder(settings);
  std::vector<Reading> out;
  std::int64_t t_ns = 0;
  std::int64_t last_count[2] = {0, 0};
  std::int64_t last_count_ns[2] = {0, 0};
  bool counted[2] = {false, false};
  while (!bytes.empty()) {
    CanFrame frame;
    t_ns += bytes.take<std::uint16_t>() * std::int64_t{1000};
    frame.t_ns = t_ns;
    frame.id = bytes.take<std::uint32_t>() & 0xE0000783U;  // often one of ours
    frame.length = bytes.take<std::uint8_t>();             // longer than 64 too
    for (auto& byte : frame.data) {
      if (!bytes.empty()) byte = bytes.take<std::uint8_t>();
    }
    out.clear();
    decoder.take(frame, out);
    decoder.watch(t_ns, out);
    promise(decoder.take_nodes_to_start().size() <= 2, "at most our nodes are started");
    for (const auto& reading : out) {
      promise(reading.axis == kEveryAxis || reading.axis < 2, "readings belong to an encoder");
      if (reading.kind != ReadingKind::kCount) continue;
      const unsigned bits = settings.can[reading.axis].counter_bits;
      const auto moved =
          static_cast<std::int64_t>(static_cast<std::uint64_t>(reading.value) -
                                    static_cast<std::uint64_t>(last_count[reading.axis]));
      promise(!counted[reading.axis] || bits == 64 ||
                  (moved >= -(std::int64_t{1} << (bits - 1)) &&
                   moved < (std::int64_t{1} << (bits - 1))),
              "a count moves by less than half of the counter's range");
      // 2 ms: frames are stamped on arrival, see count_follower.cpp.
      const double reach = settings.can[reading.axis].max_counts_per_s * 1e-9 *
                           static_cast<double>(t_ns - last_count_ns[reading.axis] + 2'000'000);
      promise(
          !counted[reading.axis] || reach <= 0.0 || std::abs(static_cast<double>(moved)) <= reach,
          "a count moves no faster than the joint can");
      last_count_ns[reading.axis] = t_ns;
      last_count[reading.axis] = reading.value;
      counted[reading.axis] = true;
    }
  }
}

void try_config(Bytes bytes) {
  const std::string text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const auto config = parse_config(text, "fuzz.toml");
  if (!config.ok()) {
    promise(config.error().message.rfind("fuzz.toml", 0) == 0, "errors name the file");
    return;
  }
  promise(!config->encoders.empty() && !config->sources.empty(), "a configuration has encoders");
  for (const auto& encoder : config->encoders) {
    promise(encoder.source < config->sources.size(), "an encoder has a source");
    promise(std::isfinite(encoder.axis.si_per_count) && encoder.axis.si_per_count > 0.0,
            "a scale is positive");
    promise(encoder.axis.sign == 1 || encoder.axis.sign == -1, "a sign is 1 or -1");
  }
}

void try_readings(Numbers bytes) {
  AxisSettings settings;
  settings.si_per_count = 1e-4;
  settings.zero_counts = 0;
  settings.index = IndexSettings{100, 1};
  const auto options = bytes.take<std::uint8_t>();
  settings.shortest_pulse_ns = (options & 1U) != 0 ? 10'000 : 0;
  settings.stale_ns = (options & 2U) != 0 ? 50'000'000 : 0;
  Axis axis(settings);
  AxisUpdate update;
  std::int64_t t_ns = 0;
  std::int64_t sampled_ns = 0;
  while (!bytes.empty()) {
    Reading reading;
    t_ns += bytes.take<std::int16_t>() * std::int64_t{1000};
    reading.t_ns = t_ns;
    reading.kind = static_cast<ReadingKind>(bytes.take<std::uint8_t>() % 11);
    reading.line = static_cast<Line>(bytes.take<std::uint8_t>() % 3);
    // As the sources give it: a level, levels, or a number of lost edges.
    reading.value = reading.kind == ReadingKind::kEdge ? bytes.take<std::uint8_t>() % 2
                                                       : bytes.take<std::uint8_t>();
    axis.push(reading);
    while (axis.pop(update)) {
    }
    axis.clear_events();
    sampled_ns = std::max(sampled_ns, t_ns - settings.latency_ns);
    const AxisSample sample = axis.sample(sampled_ns);
    promise(!sample.position_valid || (sample.counts_valid && std::isfinite(sample.position_si)),
            "a valid position is a number");
    promise(
        !sample.counts_valid || (std::isfinite(sample.counts) && std::isfinite(sample.velocity_si)),
        "valid counts are numbers");
  }
}

void try_replay(Numbers bytes) {
  record::Recording recording;
  recording.channels = {{"shoulder.lines", "1", record::Role::kStatus, "shoulder"},
                        {"elbow.counts", "counts", record::Role::kFeature, "elbow"}};
  std::vector<double> values;
  std::int64_t t_ns = 0;
  while (!bytes.empty()) {
    recording.t_ns.push_back(t_ns += bytes.take<std::uint16_t>());
    values.push_back(bytes.take<double>());
    values.push_back(bytes.take<double>());
  }
  recording.samples.resize(static_cast<Eigen::Index>(recording.t_ns.size()), 2);
  for (std::size_t i = 0; i < values.size(); ++i) {
    recording.samples(static_cast<Eigen::Index>(i / 2), static_cast<Eigen::Index>(i % 2)) =
        values[i];
  }
  const auto readings = readings_of(recording, {{"shoulder", 0}, {"elbow", 1}},
                                    {{std::uint8_t{1}, CountLimit{1e6, false}}});
  promise(readings.ok(), "both joints can be replayed");
  std::int64_t last_ns = INT64_MIN;
  for (const auto& reading : *readings) {
    promise(reading.t_ns >= last_ns, "a replay keeps the order of time");
    promise(reading.kind != ReadingKind::kEdge || reading.value == 0 || reading.value == 1,
            "an edge has a level");
    last_ns = reading.t_ns;
  }
}

void try_can_link(Bytes bytes) {
  const auto link = parse_can_link(std::as_bytes(bytes));
  promise(!link.ok() || link->kind.size() <= bytes.size(), "a name comes from the message");
}

}  // namespace

void try_encoder(Bytes bytes) {
  if (bytes.empty()) return;
  const auto rest = bytes.subspan(1);
  switch (bytes[0] % 5) {
    case 0:
      return try_can(Numbers(rest));
    case 1:
      return try_config(rest);
    case 2:
      return try_readings(Numbers(rest));
    case 3:
      return try_replay(Numbers(rest));
    default:
      return try_can_link(rest);
  }
}

}  // namespace ravencal::fuzz
