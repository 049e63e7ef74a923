// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <iterator>
#include <string>
#include <system_error>

#include "core/whole_file.hpp"
#include "trajectory/trajectory.hpp"

namespace ravencal::trajectory {
namespace {

constexpr std::string_view kHeader = "t_s,shoulder_rad,elbow_rad,insertion_m";
constexpr std::array<std::string_view, 4> kColumns = {"t_s", "shoulder_rad", "elbow_rad",
                                                      "insertion_m"};

core::Error data_error(const std::filesystem::path& path, std::size_t line,
                       const std::string& what) {
  return {core::ErrorCode::kData, fmt::format("{}:{}: {}", path.string(), line, what)};
}

core::Result<std::array<double, 4>> parse_row(std::string_view text,
                                              const std::filesystem::path& path, std::size_t line) {
  std::array<double, 4> values{};
  for (std::size_t column = 0; column < values.size(); ++column) {
    const std::size_t comma = text.find(',');
    if ((comma == std::string_view::npos) != (column + 1 == values.size())) {
      return data_error(path, line,
                        fmt::format("a row has {} columns: {}", values.size(), kHeader));
    }
    const std::string_view field = text.substr(0, comma);
    const auto [end, error] =
        std::from_chars(field.data(), field.data() + field.size(), values[column]);
    if (error != std::errc{} || end != field.data() + field.size() ||
        !std::isfinite(values[column])) {
      return data_error(
          path, line,
          fmt::format("column {} ({}): '{}' is not a number", column + 1, kColumns[column], field));
    }
    text = comma == std::string_view::npos ? std::string_view{} : text.substr(comma + 1);
  }
  return values;
}

}  // namespace

Eigen::Vector3d Trajectory::at(double t) const {
  if (t <= t_s.front()) return joints_ji.front();
  if (t >= t_s.back()) return joints_ji.back();
  const auto after =
      static_cast<std::size_t>(std::upper_bound(t_s.begin(), t_s.end(), t) - t_s.begin());
  const double share = (t - t_s[after - 1]) / (t_s[after] - t_s[after - 1]);
  return joints_ji[after - 1] + share * (joints_ji[after] - joints_ji[after - 1]);
}

core::Status write_csv(const Trajectory& trajectory, const std::filesystem::path& path,
                       bool overwrite) {
  if (!overwrite && std::filesystem::exists(path)) {
    return core::Error{core::ErrorCode::kUsage,
                       fmt::format("{}: exists already; use --force to replace it", path.string())};
  }
  std::string text = fmt::format("{}\n", kHeader);
  for (std::size_t i = 0; i < trajectory.t_s.size(); ++i) {
    const Eigen::Vector3d& joints = trajectory.joints_ji[i];
    fmt::format_to(std::back_inserter(text), "{:.3f},{:.9g},{:.9g},{:.9g}\n", trajectory.t_s[i],
                   joints[0], joints[1], joints[2]);
  }
  return core::write_whole_file(path, text);
}

core::Result<Trajectory> read_csv(const std::filesystem::path& path) {
  std::ifstream file(path);
  if (!file) {
    return core::Error{core::ErrorCode::kIo,
                       fmt::format("{}: cannot be opened for reading", path.string())};
  }
  Trajectory trajectory;
  std::string text;
  for (std::size_t line = 1; std::getline(file, text); ++line) {
    if (!text.empty() && text.back() == '\r') text.pop_back();
    if (line == 1) {
      if (text != kHeader)
        return data_error(path, line, fmt::format("the header must be '{}'", kHeader));
      continue;
    }
    RAVENCAL_ASSIGN_OR_RETURN(const auto row, parse_row(text, path, line));
    if (!trajectory.t_s.empty() && row[0] <= trajectory.t_s.back()) {
      return data_error(path, line, fmt::format("time {} s does not rise", row[0]));
    }
    trajectory.t_s.push_back(row[0]);
    trajectory.joints_ji.emplace_back(row[1], row[2], row[3]);
  }
  if (file.bad()) {
    return core::Error{core::ErrorCode::kIo, fmt::format("{}: reading failed", path.string())};
  }
  if (trajectory.t_s.size() < 2) {
    return core::Error{
        core::ErrorCode::kData,
        fmt::format("{}: a trajectory needs a header and at least two rows", path.string())};
  }
  return trajectory;
}

}  // namespace ravencal::trajectory
