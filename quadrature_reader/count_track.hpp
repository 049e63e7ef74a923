// SPDX-License-Identifier: Apache-2.0
//
// Position of one encoder as a function of time, from its recent edges or counts, for samples at
// any instant. An edge says exactly where the encoder was: on the boundary between the counts
// before and after it, in both directions. Between edges the position is interpolated; where the
// next edge is more than `latency` away the encoder rests at the count itself, half a count off at
// most. Not thread-safe; queries go forward in time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>

namespace ravencal::quadrature_reader {

struct TrackSample {
  bool valid = false;  ///< false: a loss or an outage covers this instant
  double position_counts = 0.0;
  double velocity_counts_per_s = 0.0;
  std::int64_t uncertainty_counts = 0;  ///< as set when the count was taken
};

class CountTrack {
 public:
  /// `latency_ns`: how much later than an instant its sample is asked for; nothing later than
  /// t + latency is used, so that a sample does not depend on when it is computed.
  /// `stale_ns`: for devices that count by themselves, how long a count stands for the position;
  /// 0 for edges, where silence means rest.
  CountTrack(std::int64_t latency_ns, std::int64_t stale_ns)
      : latency_ns_(latency_ns), stale_ns_(stale_ns) {}

  /// An edge took the count from `before` to `after`.
  void add_edge(std::int64_t t_ns, std::int64_t before, std::int64_t after);
  /// The device counted `count` at `t_ns`.
  void add_count(std::int64_t t_ns, std::int64_t count);
  /// Nothing is known of (`from_ns`, `to_ns`); at its end the count is `count`.
  void add_gap(std::int64_t from_ns, std::int64_t to_ns, std::int64_t count);
  /// Nothing is known from `t_ns` on, until the next add_gap or begin.
  void interrupt(std::int64_t t_ns);
  /// Known again from `t_ns` on, at `count`.
  void begin(std::int64_t t_ns, std::int64_t count);

  /// Bound of the count's error, for what is added from here on.
  void set_uncertainty(std::int64_t counts) { uncertainty_counts_ = counts; }
  /// The same for everything kept so far too.
  void set_uncertainty_of_all(std::int64_t counts);

  /// State at `t_ns`, which must not decrease from call to call.
  TrackSample sample(std::int64_t t_ns);

 private:
  struct Knot {
    std::int64_t t_ns;
    double position_counts;  // at t_ns
    double rest_counts;      // afterwards, if nothing follows for long
    std::int8_t step;        // -1, 1: an edge; 0: a count or a start
    bool broken_before;      // nothing is known between the knot before and this one
    bool broken_after;       // nothing is known after this one
    std::int64_t uncertainty_counts;
  };

  [[nodiscard]] double position_at(std::size_t k, bool next_known, std::int64_t t_ns) const;
  [[nodiscard]] double excursion(std::size_t k, double share) const;
  [[nodiscard]] double velocity_at(std::size_t k, std::int64_t t_ns) const;

  std::int64_t latency_ns_;
  std::int64_t stale_ns_;
  std::int64_t uncertainty_counts_ = 0;
  std::deque<Knot> knots_;
};

}  // namespace ravencal::quadrature_reader
