// SPDX-License-Identifier: Apache-2.0
#include "record/time_range.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "record/wall_origin.hpp"

namespace ravencal::record {
namespace {

constexpr double kNoLimit = std::numeric_limits<double>::infinity();
constexpr const char* kFrom = "from_s";
constexpr const char* kTo = "to_s";

double length_s(const Recording& recording) {
  if (recording.t_ns.empty()) return 0.0;
  return 1e-9 * static_cast<double>(recording.t_ns.back() - recording.t_ns.front());
}

std::string words_of(const TimeRange& range) {
  std::string text;
  if (range.from_s) text += fmt::format(" from {} s", *range.from_s);
  if (range.to_s) text += fmt::format(" to {} s", *range.to_s);
  return text;
}

/// Where an earlier cut of the recording began.
double begin_s(const Recording& recording) { return seconds_in_meta(recording, kFrom); }

}  // namespace

core::Status cut_to(Recording& recording, const TimeRange& range) {
  if (!range.from_s && !range.to_s) return {};
  const double from_s = range.from_s.value_or(-kNoLimit);
  const double to_s = range.to_s.value_or(kNoLimit);
  if (!(from_s < to_s)) {
    return core::usage_error(
        fmt::format("{}: --from-s {} is not before --to-s {}", recording.source, from_s, to_s));
  }
  const std::int64_t origin_ns = recording.t_ns.empty() ? 0 : recording.t_ns.front();
  const auto since_s = [&](std::int64_t t_ns) {
    return 1e-9 * static_cast<double>(t_ns - origin_ns);
  };
  const auto row_at = [&](double time_s) {
    return std::partition_point(recording.t_ns.begin(), recording.t_ns.end(),
                                [&](std::int64_t t_ns) { return since_s(t_ns) < time_s; });
  };
  const auto first = row_at(from_s);
  const auto last = row_at(to_s);
  if (first == last) {
    return core::usage_error(fmt::format("{}: no row{}; the recording is {:.6g} s long",
                                         recording.source, words_of(range), length_s(recording)));
  }
  recording.samples =
      recording.samples.middleRows(first - recording.t_ns.begin(), last - first).eval();
  recording.t_ns = std::vector<std::int64_t>(first, last);
  std::erase_if(recording.events, [&](const Event& event) {
    return since_s(event.t_ns) < from_s || since_s(event.t_ns) >= to_s;
  });
  const double begin = begin_s(recording);
  if (range.from_s) recording.meta[kFrom] = fmt::format("{}", begin + from_s);
  if (range.to_s) recording.meta[kTo] = fmt::format("{}", begin + to_s);
  return {};
}

}  // namespace ravencal::record
