// SPDX-License-Identifier: Apache-2.0
#include "record/plausibility.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <limits>

#include "core/units.hpp"
#include "record/name_list.hpp"
#include "record/plausible_parts.hpp"

namespace ravencal::record {
namespace {

constexpr std::int64_t kThinnedStepNs = 9'000'000;

bool is_known(const Recording& recording, std::string_view channel) {
  const auto known = recording.meta.find(std::string(kKnownImplausible));
  return known != recording.meta.end() && is_listed(known->second, channel);
}

}  // namespace

std::vector<Eigen::Index> thinned_rows(const Recording& recording) {
  std::vector<Eigen::Index> rows;
  for (Eigen::Index row = 0; row < recording.rows(); ++row) {
    const std::int64_t t_ns = recording.t_ns[static_cast<std::size_t>(row)];
    if (rows.empty() ||
        t_ns - recording.t_ns[static_cast<std::size_t>(rows.back())] >= kThinnedStepNs)
      rows.push_back(row);
  }
  return rows;
}

Eigen::VectorXd values_at(const Recording& recording, Eigen::Index column,
                          const std::vector<Eigen::Index>& rows) {
  Eigen::VectorXd values(static_cast<Eigen::Index>(rows.size()));
  for (std::size_t i = 0; i < rows.size(); ++i)
    values[static_cast<Eigen::Index>(i)] = recording.samples(rows[i], column);
  return values;
}

double travel_of(const Eigen::VectorXd& values) {
  double least = std::numeric_limits<double>::infinity(), most = -least;
  for (const double value : values) {
    if (!std::isfinite(value)) continue;
    least = std::min(least, value);
    most = std::max(most, value);
  }
  return std::max(most - least, 0.0);
}

double least_travel(const Channel& channel) {
  if (channel.unit == "rad") return kLeastTravel_rad;
  if (channel.unit == "m") return kLeastTravel_m;
  return std::numeric_limits<double>::infinity();
}

std::string moment_of(const Recording& recording, std::int64_t t_ns) {
  return fmt::format("{:.3f} s", 1e-9 * static_cast<double>(t_ns - recording.t_ns.front()));
}

std::string amount_of(double value, const Channel& channel) {
  const core::DisplayUnit unit = core::display_unit(channel.unit);
  return fmt::format("{:.4g} {}", value * unit.per_si, unit.name);
}

std::vector<Implausibility> implausibilities(const Recording& recording) {
  std::vector<Implausibility> all;
  for (const auto& part : {doubts_of_truth, doubts_of_signals, doubts_of_stamps}) {
    for (Implausibility& doubt : part(recording)) {
      doubt.is_error = doubt.is_error && !is_known(recording, doubt.channel);
      all.push_back(std::move(doubt));
    }
  }
  return all;
}

core::Result<std::vector<std::string>> plausibility_warnings(
    const std::vector<const Recording*>& recordings) {
  std::vector<std::string> warnings;
  for (const Recording* recording : recordings) {
    std::string errors;
    for (const Implausibility& doubt : implausibilities(*recording)) {
      if (doubt.is_error) errors += "\n  " + doubt.sentence;
      warnings.push_back(fmt::format(
          "{}: {}", std::filesystem::path(recording->source).filename().string(), doubt.sentence));
    }
    if (errors.empty()) continue;
    return core::data_error(fmt::format(
        "{}: no robot moves like that:{}\n  If it is right all the same, `plausible = false` says "
        "so: under that channel in the profile, or under that [[encoder]] in the encoders' file",
        recording->source, errors));
  }
  return warnings;
}

}  // namespace ravencal::record
