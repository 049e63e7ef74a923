// SPDX-License-Identifier: Apache-2.0
#include "quadrature_reader/config_sources.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "core/toml_table.hpp"

namespace ravencal::quadrature_reader {
namespace {

using core::TomlTable;

std::int64_t ns_of_ms(double ms) { return std::llround(1e6 * ms); }

std::optional<SourceKind> kind_from(std::string_view name) {
  for (const auto kind :
       {SourceKind::kGpio, SourceKind::kCan, SourceKind::kCounter, SourceKind::kReplay}) {
    if (name_of(kind) == name) return kind;
  }
  return std::nullopt;
}

/// A GPIO line by name or by number.
std::optional<LineRef> read_line(TomlTable& table, std::string_view key) {
  if (!table.has(key)) return std::nullopt;
  if (!table.holds_text(key)) {
    return LineRef{{}, static_cast<unsigned>(table.integer_or(key, 0, {0, 65535}))};
  }
  LineRef line{table.text(key), {}};
  if (line.name.empty()) table.fail(key, fmt::format("{} is empty", key));
  return line;
}

LineRef read_required_line(TomlTable& table, std::string_view key) {
  if (!table.has(key)) table.fail_missing(key);
  return read_line(table, key).value_or(LineRef{});
}

GpioEncoder read_gpio(TomlTable& table) {
  GpioEncoder encoder;
  encoder.a = read_required_line(table, "line_a");
  encoder.b = read_required_line(table, "line_b");
  encoder.z = read_line(table, "line_z");
  encoder.active_low = table.boolean_or("active_low", false);
  encoder.debounce_us =
      static_cast<std::uint32_t>(table.integer_or("debounce_us", 0, {0, 1'000'000}));
  const std::string bias = table.text_or("bias", "as-is");
  if (bias == "as-is") {
    encoder.bias = Bias::kAsIs;
  } else if (bias == "disabled") {
    encoder.bias = Bias::kDisabled;
  } else if (bias == "pull-up") {
    encoder.bias = Bias::kPullUp;
  } else if (bias == "pull-down") {
    encoder.bias = Bias::kPullDown;
  } else {
    table.fail("bias", "bias must be \"as-is\", \"disabled\", \"pull-up\" or \"pull-down\"");
  }
  return encoder;
}

// CiA 301 default identifier of TPDO1, CiA 406 default mapping: position value 6004h, 32 bits.
constexpr std::uint32_t kTpdo1 = 0x180;

void read_can_layout(TomlTable& table, CanEncoder& encoder) {
  const auto id = table.find_integer("can_id", {0, 0x1FFFFFFF});
  encoder.extended = table.boolean_or("can_extended", id.value_or(0) > 0x7FF);
  if (id) encoder.id = static_cast<std::uint32_t>(*id);
  if (!encoder.extended && encoder.id > 0x7FF) {
    table.fail("can_id", "can_id above 0x7FF needs can_extended = true");
  }
  encoder.byte_offset = static_cast<unsigned>(table.integer_or("byte_offset", 0, {0, 63}));
  encoder.byte_count = static_cast<unsigned>(table.integer_or("byte_count", 4, {1, 8}));
  encoder.big_endian = table.boolean_or("big_endian", false);
  encoder.is_signed = table.boolean_or("signed", false);
  const std::int64_t bits = std::int64_t{8} * encoder.byte_count;
  encoder.counter_bits = static_cast<unsigned>(table.integer_or("counter_bits", bits, {2, bits}));
  if (encoder.byte_offset + encoder.byte_count > 64) {
    table.fail("byte_offset", "byte_offset + byte_count exceed the 64 bytes of a CAN FD frame");
  }
}

// A joint of a surgical robot is far slower; a faster count is an error.
constexpr double kLargestRadPerS = 4.0 * std::numbers::pi;
constexpr double kLargestMPerS = 1.0;

CountLimit read_limit(TomlTable& table, const AxisSettings& axis, SourceKind kind) {
  const double speed = axis.unit == "rad" ? kLargestRadPerS : kLargestMPerS;
  const double usual = std::round(speed / axis.si_per_count);
  // GPIO lines count every edge: no count of theirs is refused.
  if (kind == SourceKind::kGpio || !table.has("max_counts_per_s")) return {usual, false};
  return {table.number_or("max_counts_per_s", usual, {0.0, 1e12}), true};
}

CanEncoder read_can(TomlTable& table) {
  CanEncoder encoder;
  const auto node = table.find_integer("canopen_node", {1, 127});
  if (node) {
    encoder.canopen_node = static_cast<unsigned>(*node);
    encoder.id = kTpdo1 + *encoder.canopen_node;
  } else if (!table.has("can_id")) {
    table.fail_missing("canopen_node or can_id");
  }
  read_can_layout(table, encoder);
  return encoder;
}

CounterEncoder read_counter(TomlTable& table, const AxisSettings& axis) {
  CounterEncoder encoder;
  encoder.number = static_cast<unsigned>(table.integer_or("count", 0, {0, 255}));
  encoder.channel = static_cast<unsigned>(table.integer_or("event_channel", 0, {0, 255}));
  if (const auto bits = table.find_integer("counter_bits", {2, 64})) {
    encoder.counter_bits = static_cast<unsigned>(*bits);
  }
  encoder.max_counts_per_s = axis.limit.counts_per_s;
  return encoder;
}

std::string_view device_key_of(SourceKind kind) {
  switch (kind) {
    case SourceKind::kGpio:
      return "chip";
    case SourceKind::kCan:
      return "interface";
    case SourceKind::kCounter:
      return "counter";
    case SourceKind::kReplay:
      return "recording";
  }
  return "";
}

void read_can_source(TomlTable& table, SourceSettings& source) {
  source.position_timeout_ns = ns_of_ms(table.number_or("position_timeout_ms", 0.0, {0.0, 1e6}));
  source.heartbeat_timeout_ns = ns_of_ms(table.number_or("heartbeat_timeout_ms", 0.0, {0.0, 1e6}));
  source.sync_period_ns = ns_of_ms(table.number_or("sync_period_ms", 0.0, {0.0, 1e4}));
  source.start_nodes = table.boolean_or("start_nodes", false);
}

void read_counter_source(TomlTable& table, SourceSettings& source) {
  const std::string mode = table.text_or("mode", "auto");
  if (mode == "auto") {
    source.counter_mode = CounterMode::kAuto;
  } else if (mode == "events") {
    source.counter_mode = CounterMode::kEvents;
  } else if (mode == "poll") {
    source.counter_mode = CounterMode::kPoll;
  } else {
    table.fail("mode", "mode must be \"auto\", \"events\" or \"poll\"");
  }
  source.poll_period_ns = std::llround(1e9 / table.number_or("poll_hz", 1000.0, {1.0, 20'000.0}));
}

}  // namespace

SourceSettings read_source_settings(TomlTable& table) {
  SourceSettings source;
  source.name = table.text("name");
  const std::string kind = table.text("kind");
  const auto known = kind_from(kind);
  if (!known) {
    table.fail("kind", fmt::format("kind is '{}', must be gpio, can, counter or replay", kind));
  }
  source.kind = known.value_or(SourceKind::kGpio);
  source.device = table.text(device_key_of(source.kind));
  switch (source.kind) {
    case SourceKind::kGpio:
      source.event_buffer_size =
          static_cast<std::uint32_t>(table.integer_or("event_buffer_size", 0, {0, 1024}));
      source.reorder_ns = ns_of_ms(table.number_or("reorder_ms", 1.0, {0.0, 100.0}));
      break;
    case SourceKind::kCan:
      read_can_source(table, source);
      break;
    case SourceKind::kCounter:
      read_counter_source(table, source);
      break;
    case SourceKind::kReplay:
      source.replay_speed = table.number_or("speed", 1.0, {0.0, 1e6});
      break;
  }
  return source;
}

void read_wiring(TomlTable& table, std::uint8_t axis_number, SourceSettings& source,
                 AxisSettings& axis) {
  // A counting device's value stands until the next; without a limit of its own, for a second.
  constexpr std::int64_t kDefaultStaleNs = 1'000'000'000;
  if (axis.index && source.kind != SourceKind::kGpio) {
    table.fail("index_counts", "index_counts needs a source of kind gpio with line_z");
  }
  axis.limit = read_limit(table, axis, source.kind);
  switch (source.kind) {
    case SourceKind::kGpio:
      source.gpio.push_back(read_gpio(table));
      source.gpio.back().axis = axis_number;
      if (axis.index && !source.gpio.back().z)
        table.fail("index_counts", "index_counts needs line_z");
      break;
    case SourceKind::kCan:
      source.can.push_back(read_can(table));
      source.can.back().axis = axis_number;
      source.can.back().max_counts_per_s = axis.limit.counts_per_s;
      break;
    case SourceKind::kCounter:
      source.counters.push_back(read_counter(table, axis));
      source.counters.back().axis = axis_number;
      break;
    case SourceKind::kReplay:
      source.replay_joints[axis.joint] = axis_number;
      source.replay_limits[axis_number] = axis.limit;
      break;
  }
  if (source.kind == SourceKind::kCan) {
    axis.stale_ns = source.position_timeout_ns > 0 ? source.position_timeout_ns : kDefaultStaleNs;
  }
}

}  // namespace ravencal::quadrature_reader
