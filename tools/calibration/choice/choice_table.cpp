// SPDX-License-Identifier: Apache-2.0
#include "choice/choice_table.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "core/students_t.hpp"
#include "core/units.hpp"

namespace ravencal::choice {
namespace {

/// Candidates shown beside the chosen ones.
constexpr std::size_t kShown = 5;

std::vector<const TriedModel*> best_first(const JointChoice& joint) {
  std::vector<const TriedModel*> order;
  for (const TriedModel& tried : joint.tried) order.push_back(&tried);
  std::stable_sort(order.begin(), order.end(),
                   [](const auto* a, const auto* b) { return a->inside_rmse < b->inside_rmse; });
  return order;
}

std::string sentence(const JointChoice& joint) {
  std::vector<std::string> names;
  for (const TriedModel& tried : joint.tried) {
    if (tried.weight > 0.0) names.push_back(tried.name);
  }
  const char* why = names.size() > 1
                        ? "their weighted mean is better than any of them alone"
                        : "the simplest that the data cannot tell from the best, and no weighted "
                          "mean is better beyond chance";
  return fmt::format("  {}: {}; {}\n", joint.joint, fmt::join(names, " + "), why);
}

std::string joint_table(const JointChoice& joint) {
  const core::DisplayUnit unit = core::display_unit(joint.unit);
  std::string text = fmt::format("  {:<42} {:>8} {:>10} {:>17} {:>10} {:>7}\n",
                                 joint.joint + ", RMSE in " + unit.name, "penalty", "inside",
                                 "95 % interval", "outside", "weight");
  std::size_t shown = 0;
  for (const TriedModel* tried : best_first(joint)) {
    const bool is_bias = tried->ridge == 0.0;
    if (shown >= kShown && tried->weight == 0.0 && !is_bias) continue;
    ++shown;
    const double half =
        joint.parts > 1
            ? core::students_t_975(static_cast<double>(joint.parts) - 1.0) * tried->inside_error
            : 0.0;
    text += fmt::format(
        "  {:<42} {:>8} {:>10.4f} {:>8.4f} {:>8.4f} {:>10.4f} {:>7}\n", tried->name,
        is_bias ? "-" : fmt::format("{:g}", tried->ridge), tried->inside_rmse * unit.per_si,
        std::max(0.0, tried->inside_rmse - half) * unit.per_si,
        (tried->inside_rmse + half) * unit.per_si, tried->outside_rmse * unit.per_si,
        tried->weight > 0.0 ? fmt::format("{:.2f}", tried->weight) : "");
  }
  return text + sentence(joint);
}

}  // namespace

std::string choice_table(const Choice& choice) {
  const JointChoice& first = choice.joints.front();
  std::string text = fmt::format(
      "candidates on rows of the training that they were not fitted to; inside: {} parts, {}; "
      "outside: the halves of the motion that are farthest from its middle, faster, or under "
      "larger "
      "effort, fitted to the other halves\n",
      first.parts, first.parts_are_recordings ? "whole recordings" : "stretches of time");
  for (const JointChoice& joint : choice.joints) text += joint_table(joint);
  return text;
}

}  // namespace ravencal::choice
