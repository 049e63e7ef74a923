// SPDX-License-Identifier: Apache-2.0
#include "report/report.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "core/whole_file.hpp"
#include "report/page.hpp"

namespace ravencal::report {
namespace {

core::Status check_series(const JointSeries& series) {
  const std::size_t samples = series.t_s.size();
  if (samples == 0) {
    return core::usage_error(
        fmt::format("report: joint '{}' has no samples; leave it out instead", series.joint));
  }
  const auto check = [&](const char* name, std::size_t length) -> core::Status {
    if (length == samples) return {};
    return core::usage_error(fmt::format("report: joint '{}' has {} times but {} values of {}",
                                         series.joint, samples, length, name));
  };
  RAVENCAL_RETURN_IF_ERROR(check("truth", series.truth.size()));
  RAVENCAL_RETURN_IF_ERROR(check("raw", series.raw.size()));
  RAVENCAL_RETURN_IF_ERROR(check("corrected", series.corrected.size()));
  if (!series.velocity_sign.empty()) {
    RAVENCAL_RETURN_IF_ERROR(check("velocity_sign", series.velocity_sign.size()));
  }
  const auto odd_time = std::find_if_not(series.t_s.begin(), series.t_s.end(),
                                         [](double t) { return std::isfinite(t); });
  if (odd_time != series.t_s.end()) {
    return core::usage_error(fmt::format("report: joint '{}' has no finite time at sample {}",
                                         series.joint, odd_time - series.t_s.begin()));
  }
  return {};
}

core::Status check_map(const CalibrationReport& report) {
  if (report.map_x_joint.empty() && report.map_y_joint.empty()) return {};
  for (const std::string& joint : {report.map_x_joint, report.map_y_joint}) {
    const bool known =
        std::any_of(report.series.begin(), report.series.end(),
                    [&joint](const JointSeries& series) { return series.joint == joint; });
    if (!known) {
      return core::usage_error(fmt::format(
          "report: the error maps need joint '{}', which is not among the series", joint));
    }
  }
  const std::size_t samples = report.series.front().t_s.size();
  for (const JointSeries& series : report.series) {
    if (series.t_s.size() != samples) {
      return core::usage_error(
          fmt::format("report: error maps need series of equal length, but '{}' has {} samples and "
                      "'{}' has {}",
                      report.series.front().joint, samples, series.joint, series.t_s.size()));
    }
  }
  return {};
}

core::Status check(const CalibrationReport& report) {
  for (const JointSeries& series : report.series) RAVENCAL_RETURN_IF_ERROR(check_series(series));
  RAVENCAL_RETURN_IF_ERROR(check_map(report));
  for (const LossCurve& run : report.losses) {
    if (!run.validation.empty() && run.validation.size() != run.train.size()) {
      return core::usage_error(
          fmt::format("report: run '{}' has {} training losses but {} validation losses", run.name,
                      run.train.size(), run.validation.size()));
    }
  }
  return {};
}

}  // namespace

core::Status write_html(const CalibrationReport& report, const std::filesystem::path& path) {
  RAVENCAL_RETURN_IF_ERROR(check(report));
  return core::write_whole_file(path, page_of(report));
}

}  // namespace ravencal::report
