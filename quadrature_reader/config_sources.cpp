// SPDX-License-Identifier: Apache-2.0
#include "quadrature_reader/config_sources.hpp"

#include <cmath>

#include "quadrature_reader/toml_table.hpp"

namespace ravencal::quadrature_reader {
namespace {

std::int64_t ns_of_ms(double ms) { return std::llround(1e6 * ms); }

std::optional<SourceKind> kind_from(std::string_view name) {
  for (const auto kind : {SourceKind::kGpio, SourceKind::kCan, SourceKind::kReplay}) {
    if (name_of(kind) == name) return kind;
  }
  return std::nullopt;
}

std::optional<LineRef> read_line(TomlTable& table, std::string_view key) {
  const toml::node* node = table.find(key);
  if (node == nullptr) return std::nullopt;
  if (const auto name = node->value<std::string>(); node->is_string() && !name->empty())
    return LineRef{*name, {}};
  if (const auto offset = table.integer(key, 0, 65535))
    return LineRef{{}, static_cast<unsigned>(*offset)};
  return LineRef{};
}

GpioEncoder read_gpio(TomlTable& table) {
  GpioEncoder encoder;
  const auto a = read_line(table, "line_a");
  const auto b = read_line(table, "line_b");
  table.require(a.has_value(), "line_a");
  table.require(b.has_value(), "line_b");
  encoder.a = a.value_or(LineRef{});
  encoder.b = b.value_or(LineRef{});
  encoder.z = read_line(table, "line_z");
  encoder.active_low = table.boolean("active_low").value_or(false);
  encoder.debounce_us =
      static_cast<std::uint32_t>(table.integer("debounce_us", 0, 1'000'000).value_or(0));
  const std::string bias = table.text("bias").value_or("as-is");
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
  const auto id = table.integer("can_id", 0, 0x1FFFFFFF);
  encoder.extended = table.boolean("can_extended").value_or(id.value_or(0) > 0x7FF);
  if (id) encoder.id = static_cast<std::uint32_t>(*id);
  if (!encoder.extended && encoder.id > 0x7FF) {
    table.fail("can_id", "can_id above 0x7FF needs can_extended = true");
  }
  encoder.byte_offset = static_cast<unsigned>(table.integer("byte_offset", 0, 63).value_or(0));
  encoder.byte_count = static_cast<unsigned>(table.integer("byte_count", 1, 8).value_or(4));
  encoder.big_endian = table.boolean("big_endian").value_or(false);
  encoder.is_signed = table.boolean("signed").value_or(false);
  encoder.counter_bits = static_cast<unsigned>(
      table.integer("counter_bits", 2, 8 * encoder.byte_count).value_or(8 * encoder.byte_count));
  if (encoder.byte_offset + encoder.byte_count > 64) {
    table.fail("byte_offset", "byte_offset + byte_count exceed the 64 bytes of a CAN FD frame");
  }
}

CanEncoder read_can(TomlTable& table) {
  CanEncoder encoder;
  const auto node = table.integer("canopen_node", 1, 127);
  if (node) {
    encoder.canopen_node = static_cast<unsigned>(*node);
    encoder.id = kTpdo1 + *encoder.canopen_node;
  } else {
    table.require(table.find("can_id") != nullptr, "canopen_node' or 'can_id");
  }
  read_can_layout(table, encoder);
  return encoder;
}

}  // namespace

SourceSettings read_source_settings(TomlTable& table) {
  SourceSettings source;
  const auto name = table.text("name");
  const auto kind = table.text("kind");
  table.require(name.has_value(), "name");
  table.require(kind.has_value(), "kind");
  source.name = name.value_or("");
  const auto known = kind_from(kind.value_or("gpio"));
  if (!known) table.fail("kind", fmt::format("kind is '{}', must be gpio, can or replay", *kind));
  source.kind = known.value_or(SourceKind::kGpio);
  const char* device_key = source.kind == SourceKind::kGpio  ? "chip"
                           : source.kind == SourceKind::kCan ? "interface"
                                                             : "recording";
  const auto device = table.text(device_key);
  table.require(device.has_value(), device_key);
  source.device = device.value_or("");
  if (source.kind == SourceKind::kGpio) {
    source.event_buffer_size =
        static_cast<std::uint32_t>(table.integer("event_buffer_size", 0, 1024).value_or(0));
    source.reorder_ns = ns_of_ms(table.number("reorder_ms", 0.0, 100.0).value_or(1.0));
  } else if (source.kind == SourceKind::kReplay) {
    source.replay_speed = table.number("speed", 0.0, 1e6).value_or(1.0);
  } else {
    source.position_timeout_ns =
        ns_of_ms(table.number("position_timeout_ms", 0.0, 1e6).value_or(0.0));
    source.heartbeat_timeout_ns =
        ns_of_ms(table.number("heartbeat_timeout_ms", 0.0, 1e6).value_or(0.0));
    source.sync_period_ns = ns_of_ms(table.number("sync_period_ms", 0.0, 1e4).value_or(0.0));
    source.start_nodes = table.boolean("start_nodes").value_or(false);
  }
  return source;
}

void read_wiring(TomlTable& table, std::uint8_t axis_number, SourceSettings& source,
                 AxisSettings& axis) {
  // A counting device's value stands until the next; without a limit of its own, for a second.
  constexpr std::int64_t kDefaultStaleNs = 1'000'000'000;
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
      break;
    case SourceKind::kReplay:
      source.replay_joints[axis.joint] = axis_number;
      break;
  }
  if (source.kind == SourceKind::kCan) {
    axis.stale_ns = source.position_timeout_ns > 0 ? source.position_timeout_ns : kDefaultStaleNs;
  }
}

}  // namespace ravencal::quadrature_reader
