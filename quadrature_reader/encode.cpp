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

class EdgeWriter {
 public:
  EdgeWriter(const EncodeSettings& settings, std::int64_t count, std::vector<Reading>& out)
      : settings_(settings), count_(count), out_(out) {}

  void start(std::int64_t t_ns) {
    const int levels =
        (level_a(count_) ? 1 : 0) | (level_b(count_) ? 2 : 0) | (level_z(count_) ? 4 : 0);
    out_.push_back({t_ns, levels, settings_.axis, ReadingKind::kLevels, Line::kA, Fault::kNone});
  }

  void move_to(std::int64_t t_ns, std::int64_t count) {
    if (level_a(count) != level_a(count_)) put(t_ns, Line::kA, level_a(count));
    if (level_b(count) != level_b(count_)) put(t_ns, Line::kB, level_b(count));
    if (level_z(count) != level_z(count_)) put(t_ns, Line::kZ, level_z(count));
    count_ = count;
  }

  [[nodiscard]] std::int64_t count() const { return count_; }

 private:
  [[nodiscard]] bool level_z(std::int64_t count) const {
    return settings_.index_counts > 0 && count % settings_.index_counts == 0;
  }
  void put(std::int64_t t_ns, Line line, bool level) {
    out_.push_back({t_ns, level ? 1 : 0, settings_.axis, ReadingKind::kEdge, line, Fault::kNone});
  }

  const EncodeSettings& settings_;
  std::int64_t count_;
  std::vector<Reading>& out_;
};

}  // namespace

std::vector<Reading> encode_motion(std::span<const std::int64_t> t_ns,
                                   std::span<const double> position,
                                   const EncodeSettings& settings) {
  assert(t_ns.size() == position.size());
  std::vector<Reading> out;
  if (t_ns.empty()) return out;
  EdgeWriter writer(settings, std::llround(position[0] * settings.counts_per_unit), out);
  writer.start(t_ns[0]);
  for (std::size_t i = 1; i < t_ns.size(); ++i) {
    const double from = position[i - 1] * settings.counts_per_unit;
    const double to = position[i] * settings.counts_per_unit;
    const std::int64_t target = std::llround(to);
    const auto span_ns = static_cast<double>(t_ns[i] - t_ns[i - 1]);
    while (writer.count() != target) {
      const std::int64_t next = writer.count() + (target > writer.count() ? 1 : -1);
      const double boundary = 0.5 * static_cast<double>(writer.count() + next);
      const double share =
          to == from ? 1.0 : std::fmin(1.0, std::fmax(0.0, (boundary - from) / (to - from)));
      writer.move_to(t_ns[i - 1] + std::llround(share * span_ns), next);
    }
  }
  return out;
}

}  // namespace ravencal::quadrature_reader
