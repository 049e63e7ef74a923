// SPDX-License-Identifier: Apache-2.0
//
// What the user says about the encoders, from a .toml file: which devices, which lines or frames
// are which joint, scale, sign, zero, hard stops. Unknown keys and missing ones are errors.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"
#include "quadrature_reader/axis.hpp"

namespace ravencal::quadrature_reader {

enum class SourceKind : std::uint8_t { kGpio, kCan, kCounter, kReplay };
std::string_view name_of(SourceKind kind);

/// A GPIO line by name or by offset on its chip.
struct LineRef {
  std::string name;
  std::optional<unsigned> offset;
};

enum class Bias : std::uint8_t { kAsIs, kDisabled, kPullUp, kPullDown };

struct GpioEncoder {
  std::uint8_t axis = 0;
  LineRef a;
  LineRef b;
  std::optional<LineRef> z;
  bool active_low = false;
  Bias bias = Bias::kAsIs;
  std::uint32_t debounce_us = 0;  ///< needs libgpiod 2
};

/// Where in a CAN frame the count is.
struct CanEncoder {
  std::uint8_t axis = 0;
  std::uint32_t id = 0;  ///< 11- or 29-bit identifier
  bool extended = false;
  unsigned byte_offset = 0;
  unsigned byte_count = 4;  ///< 1 to 8
  bool big_endian = false;
  bool is_signed = false;                ///< as sent; the count is widened to 64 bits either way
  unsigned counter_bits = 32;            ///< where the counter wraps, <= 8 * byte_count
  std::optional<unsigned> canopen_node;  ///< 1 to 127: supervise heartbeat, start by NMT
  double max_counts_per_s = 0.0;         ///< faster than the joint can be; 0: no limit
};

/// One count of a counter chip (/dev/counterN).
struct CounterEncoder {
  std::uint8_t axis = 0;
  unsigned number = 0;            ///< countM of the chip
  unsigned channel = 0;           ///< event channel that the driver reports it on
  unsigned counter_bits = 0;      ///< where it wraps; 0: as its ceiling says, else 32
  double max_counts_per_s = 0.0;  ///< faster than the joint can be; 0: no limit
};

enum class CounterMode : std::uint8_t {
  kAuto,    ///< events where the driver has them, else polling
  kEvents,  ///< events or an error
  kPoll,
};

struct SourceSettings {
  std::string name;
  SourceKind kind = SourceKind::kGpio;
  std::string device;  ///< chip, CAN interface, counter or recording
  std::vector<GpioEncoder> gpio;
  std::vector<CanEncoder> can;
  std::vector<CounterEncoder> counters;
  std::map<std::string, std::uint8_t> replay_joints;
  std::map<std::uint8_t, CountLimit> replay_limits;  ///< by axis; none: every count is believed
  std::uint32_t event_buffer_size = 0;               ///< gpio, libgpiod 2; 0: largest
  std::int64_t reorder_ns = 1'000'000;    ///< gpio: how late an edge may arrive behind others
  std::int64_t heartbeat_timeout_ns = 0;  ///< can; 0: not supervised
  std::int64_t position_timeout_ns = 0;   ///< can
  std::int64_t sync_period_ns = 0;        ///< can: send SYNC; 0: do not
  bool start_nodes = false;               ///< can: send NMT start to the nodes
  CounterMode counter_mode = CounterMode::kAuto;
  std::int64_t poll_period_ns = 1'000'000;  ///< counter, where it is polled
  double replay_speed = 1.0;                ///< 0: as fast as possible
};

/// The hard stop by which a joint is homed.
struct StopSettings {
  bool at_maximum = true;    ///< of the joint position (after sign)
  double position_si = 0.0;  ///< rad or m
};

struct EncoderSettings {
  AxisSettings axis;
  std::size_t source = 0;  ///< index into Config::sources
  std::optional<StopSettings> stop;
};

struct Config {
  std::filesystem::path path;
  std::map<std::string, std::string> meta;  ///< robot, arm, serial
  double rate_hz = 1000.0;
  std::size_t ring_capacity = 1U << 16U;
  std::vector<SourceSettings> sources;
  std::vector<EncoderSettings> encoders;  ///< index = Reading::axis
};

/// Reads and checks a configuration. Errors name file, line and key.
core::Result<Config> load_config(const std::filesystem::path& path);
core::Result<Config> parse_config(std::string_view text, const std::filesystem::path& path);

/// Puts a replay of `recording` in the place of all devices; `speed` as SourceSettings says.
void replay_instead(Config& config, const std::filesystem::path& recording, double speed);

}  // namespace ravencal::quadrature_reader
