// SPDX-License-Identifier: Apache-2.0
#include "choice/variety.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>

#include "core/median.hpp"

namespace ravencal::choice {
namespace {

using Eigen::Index;

/// Of a joint's speeds while it moves: the 90 % quantile over the 10 % quantile.
constexpr double kSpeedsVary = 2.0;
/// A joint that is slower than this share of its 95 % quantile rests or turns round.
constexpr double kMoves = 0.1;
/// Of a joint's mean effort or load in one recording over that in another.
constexpr double kLoadsVary = 1.2;

bool speed_varies(const Eigen::VectorXd& speeds) {
  std::vector<double> known;
  std::copy_if(speeds.begin(), speeds.end(), std::back_inserter(known),
               [](double value) { return std::isfinite(value); });
  if (known.empty()) return false;
  const double moves = kMoves * core::upper_quantile(known, 0.95);
  std::erase_if(known, [&](double value) { return !(value > moves); });
  return !known.empty() &&
         core::upper_quantile(known, 0.9) > kSpeedsVary * core::upper_quantile(known, 0.1);
}

bool load_varies(const Eigen::VectorXd& loads, const std::vector<int>& recording) {
  std::map<int, std::pair<double, double>> sums;  // load and rows of each recording
  for (Index row = 0; row < loads.size(); ++row) {
    if (!std::isfinite(loads[row])) continue;
    auto& [load, rows] = sums[recording[static_cast<std::size_t>(row)]];
    load += loads[row];
    rows += 1.0;
  }
  std::vector<double> means;
  for (const auto& [index, sum] : sums) means.push_back(sum.first / sum.second);
  if (means.empty()) return false;
  const auto [least, largest] = std::minmax_element(means.begin(), means.end());
  return *largest > kLoadsVary * *least;
}

template <typename Varies>
bool any_joint(const Eigen::MatrixXd& values, const Varies& varies) {
  for (Index joint = 0; joint < values.cols(); ++joint) {
    if (varies(values.col(joint))) return true;
  }
  return false;
}

}  // namespace

std::vector<std::string> variety_warnings(const Rows& rows, std::size_t homings) {
  std::vector<std::string> one;
  std::vector<std::string> remedies;
  if (homings < 2) {
    one.emplace_back("one homing");
    remedies.emplace_back("homed anew");
  }
  if (!any_joint(rows.speeds, speed_varies)) {
    one.emplace_back("one speed");
    remedies.emplace_back("at other speeds");
  }
  // A brake behind the cables may hardly show in an effort that friction rules.
  const bool knows_loads =
      rows.efforts.array().isFinite().any() || rows.loads.array().isFinite().any();
  const auto varies = [&](const Eigen::VectorXd& values) {
    return load_varies(values, rows.recording);
  };
  if (knows_loads && !any_joint(rows.efforts, varies) && !any_joint(rows.loads, varies)) {
    one.emplace_back("one load");
    remedies.emplace_back("under another load");
  }
  if (one.empty()) return {};
  return {fmt::format("the training has {}: the expected error holds for no other; also record {}",
                      fmt::join(one, " and "), fmt::join(remedies, " and "))};
}

}  // namespace ravencal::choice
