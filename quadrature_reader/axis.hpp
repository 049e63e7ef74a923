// SPDX-License-Identifier: Apache-2.0
//
// One encoder from readings to joint position: glitch filter, decoder, index check, track, scale.
// Owned by one thread.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "quadrature_reader/count_track.hpp"
#include "quadrature_reader/decoder.hpp"
#include "quadrature_reader/glitch_filter.hpp"
#include "quadrature_reader/index_check.hpp"
#include "quadrature_reader/reading.hpp"

namespace ravencal::quadrature_reader {

struct IndexSettings {
  std::int64_t counts_per_rev = 0;
  std::int64_t tolerance_counts = 2;
};

/// The fastest that a joint can be.
struct CountLimit {
  double counts_per_s = 0.0;  ///< 0: no limit
  bool said = true;           ///< by the user; else what a surgical robot's joint stays below
};

struct AxisSettings {
  std::string joint;
  std::string unit = "rad";                 ///< "rad" or "m"
  double si_per_count = 0.0;                ///< rad or m per count after x4, > 0
  int sign = 1;                             ///< 1 or -1: joint direction per count
  std::optional<std::int64_t> zero_counts;  ///< count at zero_position; unknown until homed
  double zero_position_si = 0.0;            ///< joint position at zero_counts, rad or m
  std::int64_t shortest_pulse_ns = 0;
  std::int64_t latency_ns = 20'000'000;
  std::int64_t stale_ns = 0;                ///< > 0 for devices that count by themselves
  std::int64_t max_uncertainty_counts = 8;  ///< above it the position is not given out
  std::optional<IndexSettings> index;
  CountLimit limit;
};

enum class AxisEventKind : std::uint8_t {
  kEdgesLost,       ///< amount: how many, 0 if unknown
  kLevelMismatch,   ///< the lines read differently from what the edges said
  kRepeatedEdge,    ///< same polarity twice: doubled, or its partner lost
  kEdgeRepaired,    ///< one edge lost in steady motion, count corrected
  kLateEdge,        ///< older than one before it; left out
  kIndexFound,      ///< first index pulse; amount: count
  kIndexSlip,       ///< amount: slipped counts
  kRestarted,       ///< the counting device began again; amount: by how many counts it jumped
  kCounterWrapped,  ///< a raw counter wrapped and was unwrapped by `amount` counts, as its speed
                    ///< says
  kOutage,          ///< delivers nothing; fault says why
  kRecovered,
  kNotice,  ///< fault says what, amount how much
  kGlitchRemoved,
};

std::string_view name_of(AxisEventKind kind);
/// True if the kind means that data is missing or the device failed.
bool is_loss(AxisEventKind kind);

struct AxisEvent {
  AxisEventKind kind = AxisEventKind::kNotice;
  Fault fault = Fault::kNone;
  std::int64_t from_ns = 0;  ///< the cause lies between these instants
  std::int64_t to_ns = 0;
  std::int64_t amount = 0;
};

/// State of an axis at one instant.
struct AxisSample {
  bool counts_valid = false;    ///< nothing missing at this instant
  bool position_valid = false;  ///< and the zero is known and the count trusted
  double counts = 0.0;
  double position_si = 0.0;  ///< rad or m
  double velocity_si = 0.0;  ///< rad/s or m/s, from the timing of edges; valid with counts_valid
};

/// What one reading did, for recording every edge.
struct AxisUpdate {
  std::int64_t t_ns = 0;
  std::int64_t count = 0;
  std::uint8_t levels = 0;  ///< A | B << 1 | Z << 2
  bool recordable = false;  ///< an edge, levels or a count, as opposed to housekeeping
};

class Axis {
 public:
  explicit Axis(const AxisSettings& settings);

  void push(const Reading& reading);
  /// Processes the next reading that has passed the glitch filter; false if there is none.
  bool pop(AxisUpdate& update);

  /// State at `t_ns`; call with increasing times, `latency_ns` or more behind the readings.
  AxisSample sample(std::int64_t t_ns);

  /// Sets the zero. Affects positions of later samples only.
  void set_zero(std::int64_t zero_counts, double zero_position_si);
  [[nodiscard]] std::optional<std::int64_t> zero_counts() const { return settings_.zero_counts; }
  /// Where the index pulse was last seen, if it was.
  [[nodiscard]] std::optional<std::int64_t> index_counts() const;
  [[nodiscard]] const AxisSettings& settings() const { return settings_; }

  /// Events since the last call to clear_events().
  [[nodiscard]] const std::vector<AxisEvent>& events() const { return events_; }
  void clear_events() { events_.clear(); }

  [[nodiscard]] std::int64_t count() const { return count_; }
  [[nodiscard]] std::int64_t uncertainty_counts() const;
  [[nodiscard]] std::int64_t edges() const { return edges_; }
  [[nodiscard]] std::int64_t losses() const { return losses_; }
  [[nodiscard]] bool delivering() const { return delivering_; }

 private:
  void take_edge(const Reading& reading);
  void take_motion(const Reading& reading, const DecoderStep& step, std::int64_t known_until_ns);
  void take_index_edge(const Reading& reading);
  void take_levels(const Reading& reading);
  void take_count(const Reading& reading);
  void take_state(const Reading& reading);
  void take_unseen(const Reading& reading);
  void report(AxisEventKind kind, std::int64_t from_ns, std::int64_t to_ns, std::int64_t amount,
              Fault fault = Fault::kNone);

  AxisSettings settings_;
  GlitchFilter filter_;
  QuadratureDecoder decoder_;
  CountTrack track_;
  std::optional<IndexCheck> index_;
  std::vector<AxisEvent> events_;
  std::int64_t count_ = 0;
  std::int64_t edges_ = 0;
  std::int64_t losses_ = 0;
  std::int64_t last_t_ns_ = INT64_MIN;
  std::array<std::int64_t, 2> last_line_t_ns_{};
  std::int64_t gap_from_ns_ = 0;
  std::int64_t reported_glitches_ = 0;
  std::uint8_t levels_ = 0;
  bool counting_device_ = false;
  bool device_restarted_ = false;
  bool delivering_ = false;
};

}  // namespace ravencal::quadrature_reader
