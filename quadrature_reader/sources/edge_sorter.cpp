// SPDX-License-Identifier: Apache-2.0
#include "quadrature_reader/sources/edge_sorter.hpp"

#include <algorithm>
#include <cstdlib>

namespace ravencal::quadrature_reader {

void EdgeSorter::add_edge(const Reading& edge, std::optional<std::uint32_t> sequence) {
  AxisState& axis = axes_[edge.axis];
  axis.last_edge_t_ns = std::max(axis.last_edge_t_ns, edge.t_ns);
  if (axis.levels && std::abs(edge.t_ns - axis.levels->t_ns) < horizon_ns_) axis.levels.reset();
  waiting_.push_back({edge, sequence});
}

void EdgeSorter::add_loss(std::uint8_t axis, std::int64_t t_ns) {
  axes_[axis].wants_levels = true;
  axes_[axis].levels.reset();
  waiting_.push_back({{t_ns, 0, axis, ReadingKind::kLost, Line::kA, Fault::kQueueOverflow}, {}});
}

void EdgeSorter::add_levels(std::uint8_t axis, std::int64_t t_ns, std::int64_t levels) {
  AxisState& state = axes_[axis];
  if (state.levels || t_ns - state.last_edge_t_ns < horizon_ns_) return;
  state.levels = Reading{t_ns, levels, axis, ReadingKind::kLevels, Line::kA, Fault::kNone};
}

std::int64_t EdgeSorter::release(std::int64_t now_ns, std::vector<Reading>& out) {
  const std::int64_t until_ns = now_ns - horizon_ns_;
  for (auto& [number, axis] : axes_) {
    if (!axis.levels || axis.levels->t_ns + horizon_ns_ > until_ns) continue;
    waiting_.push_back({*axis.levels, {}});
    axis.levels.reset();
    axis.wants_levels = false;
  }
  // Stable: a loss comes after the edge with its time, in the order of adding.
  std::stable_sort(waiting_.begin(), waiting_.end(), [](const Waiting& x, const Waiting& y) {
    if (x.reading.t_ns != y.reading.t_ns) return x.reading.t_ns < y.reading.t_ns;
    return x.sequence && y.sequence && static_cast<std::int32_t>(*x.sequence - *y.sequence) < 0;
  });
  std::size_t released = 0;
  for (; released < waiting_.size() && waiting_[released].reading.t_ns <= until_ns; ++released) {
    const auto& [reading, sequence] = waiting_[released];
    if (sequence) {
      AxisState& axis = axes_[reading.axis];
      const auto missing = static_cast<std::int32_t>(*sequence - axis.last_sequence - 1);
      if (missing > 0) {
        out.push_back({reading.t_ns, missing, reading.axis, ReadingKind::kLost, Line::kA,
                       Fault::kQueueOverflow});
        axis.wants_levels = true;
      }
      if (missing >= 0) axis.last_sequence = *sequence;
    }
    out.push_back(reading);
  }
  waiting_.erase(waiting_.begin(), waiting_.begin() + static_cast<std::ptrdiff_t>(released));
  out.push_back({until_ns, 0, kEveryAxis, ReadingKind::kAlive, Line::kA, Fault::kNone});
  return until_ns;
}

bool EdgeSorter::wants_levels(std::uint8_t axis) const {
  const auto state = axes_.find(axis);
  return state == axes_.end() || (state->second.wants_levels && !state->second.levels);
}

void EdgeSorter::reset() {
  waiting_.clear();
  axes_.clear();
}

}  // namespace ravencal::quadrature_reader
