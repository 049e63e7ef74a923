// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

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

using physics::JointKind;

constexpr std::string_view kTime = "t_s", kAngle = "_rad", kLength = "_m";

std::string column_of(const MovedJoint& joint) {
  return joint.name + std::string(joint.kind == JointKind::kRevolute ? kAngle : kLength);
}

std::string header_of(const std::vector<MovedJoint>& joints) {
  std::string header(kTime);
  for (const MovedJoint& joint : joints) header += "," + column_of(joint);
  return header;
}

core::Error error_in_line(const std::filesystem::path& path, std::size_t line,
                          const std::string& what) {
  return core::data_error(fmt::format("{}:{}: {}", path.string(), line, what));
}

std::vector<std::string_view> fields_of(std::string_view text) {
  std::vector<std::string_view> fields;
  for (std::size_t from = 0;;) {
    const std::size_t comma = text.find(',', from);
    fields.push_back(text.substr(from, comma - from));
    if (comma == std::string_view::npos) return fields;
    from = comma + 1;
  }
}

core::Result<std::vector<MovedJoint>> parse_header(std::string_view text,
                                                   const std::filesystem::path& path) {
  const auto refuse = [&](const std::string& what) {
    return error_in_line(path, 1,
                         fmt::format("{}; the header of a trajectory is {} and NAME{} or NAME{} of "
                                     "each joint, as '{}'",
                                     what, kTime, kAngle, kLength, header_of(raven_joints())));
  };
  const std::vector<std::string_view> fields = fields_of(text);
  if (fields.front() != kTime) return refuse(fmt::format("column 1 is '{}'", fields.front()));
  if (fields.size() < 2) return refuse("the header names no joint");
  std::vector<MovedJoint> joints;
  for (std::size_t k = 1; k < fields.size(); ++k) {
    const std::string_view field = fields[k];
    const bool turns = field.ends_with(kAngle);
    if (!turns && !field.ends_with(kLength))
      return refuse(fmt::format("column {} '{}' has no unit", k + 1, field));
    const std::size_t unit = (turns ? kAngle : kLength).size();
    MovedJoint joint{std::string(field.substr(0, field.size() - unit)),
                     turns ? JointKind::kRevolute : JointKind::kPrismatic};
    if (joint.name.empty()) return refuse(fmt::format("column {} '{}' has no name", k + 1, field));
    const bool twice = std::any_of(joints.begin(), joints.end(), [&](const MovedJoint& other) {
      return other.name == joint.name;
    });
    if (twice) return refuse(fmt::format("column {}: joint '{}' stands twice", k + 1, joint.name));
    joints.push_back(std::move(joint));
  }
  return joints;
}

/// The time, then the joints.
core::Result<std::vector<double>> parse_row(std::string_view text,
                                            const std::vector<MovedJoint>& joints,
                                            const std::filesystem::path& path, std::size_t line) {
  const std::vector<std::string_view> fields = fields_of(text);
  if (fields.size() != joints.size() + 1)
    return error_in_line(path, line,
                         fmt::format("a row has {} columns and not {}: {}", joints.size() + 1,
                                     fields.size(), header_of(joints)));
  std::vector<double> values(fields.size());
  for (std::size_t column = 0; column < fields.size(); ++column) {
    const std::string_view field = fields[column];
    const auto [end, error] =
        std::from_chars(field.data(), field.data() + field.size(), values[column]);
    if (error == std::errc{} && end == field.data() + field.size() && std::isfinite(values[column]))
      continue;
    return error_in_line(
        path, line,
        fmt::format("column {} ({}): '{}' is not a number", column + 1,
                    column == 0 ? std::string(kTime) : column_of(joints[column - 1]), field));
  }
  return values;
}

}  // namespace

Eigen::VectorXd Trajectory::at(double t) const {
  if (t <= t_s.front()) return joints_ji.front();
  if (t >= t_s.back()) return joints_ji.back();
  const auto after =
      static_cast<std::size_t>(std::upper_bound(t_s.begin(), t_s.end(), t) - t_s.begin());
  const double share = (t - t_s[after - 1]) / (t_s[after] - t_s[after - 1]);
  return joints_ji[after - 1] + share * (joints_ji[after] - joints_ji[after - 1]);
}

core::Status write_csv(const Trajectory& trajectory, const std::filesystem::path& path) {
  for (const MovedJoint& joint : trajectory.joints) {
    if (joint.name.find_first_of(",\r\n") != std::string::npos)
      return core::data_error(
          fmt::format("{}: joint '{}' has a comma or a line's end in its name, which the header of "
                      "a trajectory cannot hold: rename it in the plant",
                      path.string(), joint.name));
  }
  std::string text = header_of(trajectory.joints) + "\n";
  for (std::size_t i = 0; i < trajectory.t_s.size(); ++i) {
    fmt::format_to(std::back_inserter(text), "{:.3f}", trajectory.t_s[i]);
    for (const double joint : trajectory.joints_ji[i])
      fmt::format_to(std::back_inserter(text), ",{:.9g}", joint);
    text += '\n';
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
      RAVENCAL_ASSIGN_OR_RETURN(trajectory.joints, parse_header(text, path));
      continue;
    }
    RAVENCAL_ASSIGN_OR_RETURN(const auto row, parse_row(text, trajectory.joints, path, line));
    if (!trajectory.t_s.empty() && row[0] <= trajectory.t_s.back()) {
      return error_in_line(path, line, fmt::format("time {} s does not rise", row[0]));
    }
    trajectory.t_s.push_back(row[0]);
    trajectory.joints_ji.emplace_back(Eigen::Map<const Eigen::VectorXd>(
        row.data() + 1, static_cast<Eigen::Index>(trajectory.joints.size())));
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
