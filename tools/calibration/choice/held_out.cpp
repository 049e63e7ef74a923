// SPDX-License-Identifier: Apache-2.0
#include "choice/held_out.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include "core/median.hpp"

namespace ravencal::choice {
namespace {

using Eigen::Index;
using List = std::vector<Index>;

constexpr std::size_t kFewestRecordings = 2;
constexpr std::size_t kMostParts = 8;
constexpr std::size_t kTimeParts = 5;
/// Of the means of both halves. Below it the speed or the effort hardly varies, and halves say no
/// more than the parts do.
constexpr double kLeastRatio = 1.5;

/// The half of the rows with the larger values.
List upper_half(const Eigen::VectorXd& values) {
  const double middle = core::upper_median(std::vector<double>(values.begin(), values.end()));
  List upper;
  for (Index row = 0; row < values.size(); ++row) {
    if (values[row] > middle) upper.push_back(row);
  }
  return upper;
}

/// How far each row is from the middle of the positions' ranges, in half ranges.
Eigen::VectorXd from_middle(const Eigen::MatrixXd& positions) {
  Eigen::VectorXd distance = Eigen::VectorXd::Zero(positions.rows());
  for (const auto& values : positions.colwise()) {
    const double low = values.minCoeff();
    const double high = values.maxCoeff();
    if (!(high > low)) continue;
    const auto of_joint = (values.array() - 0.5 * (low + high)).abs() / (0.5 * (high - low));
    distance = distance.cwiseMax(of_joint.matrix());
  }
  return distance;
}

/// The largest of a row's values, each over its column's mean; 0 where unknown.
Eigen::VectorXd relative_size(const Eigen::MatrixXd& values) {
  Eigen::VectorXd size = Eigen::VectorXd::Zero(values.rows());
  for (const auto& column : values.colwise()) {
    const Eigen::VectorXd known = column.array().isFinite().select(column, 0.0);
    if (known.mean() > 0.0) size = size.cwiseMax(known / known.mean());
  }
  return size;
}

/// Empty where the sizes hardly vary.
List larger_half(const Eigen::MatrixXd& values) {
  const Eigen::VectorXd size = relative_size(values);
  List upper = upper_half(size);
  const auto count = static_cast<double>(upper.size());
  const double larger = size(upper).sum();
  const double smaller = size.sum() - larger;
  const double of_larger = larger / std::max(count, 1.0);
  const double of_smaller = smaller / std::max(static_cast<double>(size.size()) - count, 1.0);
  if (!(of_larger > kLeastRatio * of_smaller)) upper.clear();
  return upper;
}

std::vector<List> parts_of(std::span<const int> recording, const std::set<int>& recordings) {
  const bool by_recording = recordings.size() >= kFewestRecordings;
  std::vector<List> parts(by_recording ? std::min(recordings.size(), kMostParts) : kTimeParts);
  const auto part_count = static_cast<Index>(parts.size());
  const auto rows = static_cast<Index>(recording.size());
  for (Index row = 0; row < rows; ++row) {
    const auto place = std::distance(recordings.begin(),
                                     recordings.find(recording[static_cast<std::size_t>(row)]));
    const Index part = by_recording ? place % part_count : row * part_count / rows;
    parts[static_cast<std::size_t>(part)].push_back(row);
  }
  return parts;
}

}  // namespace

HeldOut held_out_parts(std::span<const int> recording, const Motion& motion) {
  const std::set<int> recordings(recording.begin(), recording.end());
  HeldOut held_out;
  held_out.by_recording = recordings.size() >= kFewestRecordings;
  held_out.lists = parts_of(recording, recordings);
  held_out.parts = held_out.lists.size();
  for (List beyond : {upper_half(from_middle(motion.positions)), larger_half(motion.speeds),
                      larger_half(motion.efforts)}) {
    if (!beyond.empty()) held_out.lists.push_back(std::move(beyond));
  }
  return held_out;
}

}  // namespace ravencal::choice
