// SPDX-License-Identifier: Apache-2.0
//
// Brings GPIO edges into the order of their time stamps. The kernel queues edges per line (uAPI v1)
// or from one interrupt thread per line (v2), so they arrive slightly out of order: an edge is
// passed on when everything up to `horizon` after it must have arrived. Also turns gaps of the
// sequence number into losses, and lets a reading of the levels through only where no edge was
// near.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "quadrature_reader/reading.hpp"

namespace ravencal::quadrature_reader {

class EdgeSorter {
 public:
  explicit EdgeSorter(std::int64_t horizon_ns) : horizon_ns_(horizon_ns) {}

  /// An edge; `sequence` counts the edges of its axis from 1 (modulo 2^32), where the kernel
  /// counts.
  void add_edge(const Reading& edge, std::optional<std::uint32_t> sequence = std::nullopt);
  /// An unknown number of edges of `axis` is missing after `t_ns`.
  void add_loss(std::uint8_t axis, std::int64_t t_ns);
  /// All lines of `axis` were read at `t_ns` (A | B << 1 | Z << 2) with no edge waiting.
  void add_levels(std::uint8_t axis, std::int64_t t_ns, std::int64_t levels);

  /// Appends to `out`, in order, what can be passed on when all edges before `now_ns` that are
  /// visible have been added; ends with kAlive. Returns the instant up to which all is out.
  std::int64_t release(std::int64_t now_ns, std::vector<Reading>& out);

  /// True if edges of `axis` were lost and its levels have not been confirmed since.
  [[nodiscard]] bool wants_levels(std::uint8_t axis) const;
  void reset();

 private:
  struct Waiting {
    Reading reading;
    std::optional<std::uint32_t> sequence;
  };
  struct AxisState {
    std::uint32_t last_sequence = 0;
    std::int64_t last_edge_t_ns = INT64_MIN / 2;
    bool wants_levels = true;
    std::optional<Reading> levels;
  };

  std::int64_t horizon_ns_;
  std::vector<Waiting> waiting_;
  std::map<std::uint8_t, AxisState> axes_;
};

}  // namespace ravencal::quadrature_reader
