// SPDX-License-Identifier: Apache-2.0
#include "quadrature_reader/encode.hpp"

#include <cassert>
#include <cmath>

namespace ravencal::quadrature_reader {
namespace {

bool level_a(std::int64_t count) {
  return ((count % 4) + 4) % 4 == 1 || ((count % 4) + 4) % 4 == 2;
}
bool level_b(std::int64_t count) { return ((count % 4) + 4) % 4 >= 2; }

}  // namespace

bool MotionEncoder::level_z(std::int64_t count) const {
  return settings_.index_counts > 0 && count % settings_.index_counts == 0;
}

void MotionEncoder::step_to(std::int64_t t_ns, std::int64_t count, std::vector<Reading>& out) {
  const auto put = [&](Line line, bool level) {
    out.push_back({t_ns, level ? 1 : 0, settings_.axis, ReadingKind::kEdge, line, Fault::kNone});
  };
  if (level_a(count) != level_a(count_)) put(Line::kA, level_a(count));
  if (level_b(count) != level_b(count_)) put(Line::kB, level_b(count));
  if (level_z(count) != level_z(count_)) put(Line::kZ, level_z(count));
  count_ = count;
}

void MotionEncoder::move_to(std::int64_t t_ns, double position, std::vector<Reading>& out) {
  const double to = position * settings_.counts_per_unit;
  const std::int64_t target = std::llround(to);
  if (!started_) {
    started_ = true;
    count_ = target;
    const int levels =
        (level_a(count_) ? 1 : 0) | (level_b(count_) ? 2 : 0) | (level_z(count_) ? 4 : 0);
    out.push_back({t_ns, levels, settings_.axis, ReadingKind::kLevels, Line::kA, Fault::kNone});
  }
  const double from = last_counts_;
  const auto span_ns = static_cast<double>(t_ns - last_t_ns_);
  while (count_ != target) {
    const std::int64_t next = count_ + (target > count_ ? 1 : -1);
    const double boundary = 0.5 * static_cast<double>(count_ + next);
    const double share =
        to == from ? 1.0 : std::fmin(1.0, std::fmax(0.0, (boundary - from) / (to - from)));
    step_to(last_t_ns_ + std::llround(share * span_ns), next, out);
  }
  last_t_ns_ = t_ns;
  last_counts_ = to;
}

std::vector<Reading> encode_motion(std::span<const std::int64_t> t_ns,
                                   std::span<const double> position,
                                   const EncodeSettings& settings) {
  assert(t_ns.size() == position.size());
  std::vector<Reading> out;
  MotionEncoder encoder(settings);
  for (std::size_t i = 0; i < t_ns.size(); ++i) encoder.move_to(t_ns[i], position[i], out);
  return out;
}

}  // namespace ravencal::quadrature_reader
