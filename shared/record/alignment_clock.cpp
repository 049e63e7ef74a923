// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "record/alignment.hpp"

namespace ravencal::record {
namespace {

constexpr double kLargestResidualNs = 1e6;

}  // namespace

std::int64_t ClockRelation::realtime_of(std::int64_t monotonic_ns) const {
  const double since_ns = static_cast<double>(monotonic_ns - reference_ns);
  return monotonic_ns + offset_ns + std::llround(1e-6 * drift_ppm * since_ns);
}

core::Result<ClockRelation> clock_relation(const Recording& recording) {
  std::vector<std::pair<std::int64_t, std::int64_t>> points;
  for (const auto& event : recording.events) {
    if (event.kind != "clock_offset") continue;
    const auto detail = nlohmann::json::parse(event.detail, nullptr, false);
    if (!detail.is_object() || !detail.contains("minus_monotonic_ns") ||
        !detail["minus_monotonic_ns"].is_number_integer()) {
      continue;
    }
    points.emplace_back(event.t_ns, detail["minus_monotonic_ns"].get<std::int64_t>());
  }
  if (points.empty()) {
    return core::Error{
        core::ErrorCode::kData,
        fmt::format("{}: has no clock_offset events; was it written by ravencal-encoders?",
                    recording.source)};
  }
  ClockRelation relation;
  relation.reference_ns = points.front().first;
  relation.offset_ns = points.front().second;
  // Least squares line, relative to the first point so that doubles suffice.
  double n = 0.0, sx = 0.0, sy = 0.0, sxx = 0.0, sxy = 0.0;
  for (const auto& [t, offset] : points) {
    const auto x = static_cast<double>(t - relation.reference_ns);
    const auto y = static_cast<double>(offset - relation.offset_ns);
    n += 1.0, sx += x, sy += y, sxx += x * x, sxy += x * y;
  }
  const double spread = n * sxx - sx * sx;
  const double slope = spread > 0.0 ? (n * sxy - sx * sy) / spread : 0.0;
  relation.drift_ppm = 1e6 * slope;
  relation.offset_ns += std::llround((sy - slope * sx) / n);
  for (const auto& [t, offset] : points) {
    const auto error = static_cast<double>(t + offset - relation.realtime_of(t));
    relation.residual_ns = std::max(relation.residual_ns, std::abs(error));
  }
  if (relation.residual_ns <= kLargestResidualNs) return relation;
  return core::Error{
      core::ErrorCode::kData,
      fmt::format(
          "{}: the wall clock was stepped by about {:.1f} ms during the recording; its relation "
          "to the robot's stamps is unknown",
          recording.source, 1e-6 * relation.residual_ns)};
}

}  // namespace ravencal::record
