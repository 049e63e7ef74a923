// SPDX-License-Identifier: Apache-2.0
#include "diagnose/given.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <limits>
#include <optional>
#include <system_error>

#include "core/version.hpp"

namespace ravencal::diagnose {
namespace {

using GivenRecordings = std::vector<GivenRecording>;

bool overlap(const record::TimeRange& a, const record::TimeRange& b) {
  constexpr double kNoLimit = std::numeric_limits<double>::infinity();
  return a.from_s.value_or(-kNoLimit) < b.to_s.value_or(kNoLimit) &&
         b.from_s.value_or(-kNoLimit) < a.to_s.value_or(kNoLimit);
}

bool have_same_rows(const GivenRecording& a, const GivenRecording& b) {
  std::error_code unknown;
  return a.profile == b.profile && overlap(a.range, b.range) &&
         std::filesystem::equivalent(a.path, b.path, unknown);
}

/// A recording that is given twice would count as two that agree.
core::Status check_once(const GivenRecordings& recordings) {
  for (auto one = recordings.begin(); one != recordings.end(); ++one) {
    const bool again = std::any_of(recordings.begin(), one,
                                   [&](const auto& other) { return have_same_rows(*one, other); });
    if (again)
      return core::usage_error(fmt::format("{}: is given twice; it counts once", one->path));
  }
  return {};
}

std::string names_of(const GivenRecordings& recordings) {
  std::vector<std::string> names;
  for (const GivenRecording& recording : recordings)
    names.push_back(std::filesystem::path(recording.path).filename().string());
  return fmt::format("{}", fmt::join(names, ", "));
}

/// One limit of all, or that of each; nothing where none has it.
std::string limit_of(const Given& given, std::optional<double> record::TimeRange::*limit) {
  std::vector<std::string> texts;
  bool is_set = false;
  for (const GivenRecordings* list : {&given.training, &given.held_out, &given.simulated}) {
    for (const GivenRecording& recording : *list) {
      const std::optional<double>& value = recording.range.*limit;
      is_set = is_set || value.has_value();
      texts.push_back(value ? fmt::format("{}", *value) : "none");
    }
  }
  if (!is_set) return {};
  const bool same = std::count(texts.begin(), texts.end(), texts.front()) ==
                    static_cast<std::ptrdiff_t>(texts.size());
  return same ? texts.front() : fmt::format("{}", fmt::join(texts, ", "));
}

}  // namespace

core::Status check_given(const Given& given) {
  RAVENCAL_RETURN_IF_ERROR(check_once(given.training));
  RAVENCAL_RETURN_IF_ERROR(check_once(given.held_out));
  for (const GivenRecording& held_out : given.held_out) {
    const bool is_fitted =
        std::any_of(given.training.begin(), given.training.end(),
                    [&](const auto& other) { return have_same_rows(held_out, other); });
    if (is_fitted) {
      return core::usage_error(
          fmt::format("{}: is among the recordings to fit; hold another one out, or a part of each "
                      "with --held-out-from",
                      held_out.path));
    }
  }
  return {};
}

void add_provenance(const Given& given, const physics::Plant& plant, const Options& options,
                    Report& report) {
  const auto add = [&](const char* key, std::string value) {
    if (!value.empty()) report.provenance.emplace_back(key, std::move(value));
  };
  add("recordings", names_of(given.training));
  add("held_out", names_of(given.held_out));
  add("simulated", names_of(given.simulated));
  add("plant", fmt::format("{} ({:016x})", std::filesystem::path(plant.source).filename().string(),
                           plant.hash));
  add("from_s", limit_of(given, &record::TimeRange::from_s));
  add("to_s", limit_of(given, &record::TimeRange::to_s));
  add("seed", std::to_string(options.seed));
  add("alpha", fmt::format("{:g}", options.alpha));
  add("placebo_twins", std::to_string(options.placebos));
  add("ravencal", core::kVersion);
}

}  // namespace ravencal::diagnose
