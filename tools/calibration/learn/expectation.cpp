// SPDX-License-Identifier: Apache-2.0
#include "learn/expectation.hpp"

#include <fmt/format.h>

#include <cmath>

#include "core/units.hpp"

namespace ravencal::learn {
namespace {

std::string came_text(const JointEvaluation& joint, double per_si) {
  const double came = joint.calibrated.rmse;
  const model::ExpectedRmse& expected = joint.expected->any();
  const bool is_inside = expected.low <= came && came <= expected.high;
  const std::string rank =
      std::isfinite(joint.distance_rank) ? fmt::format("{:.2f}", joint.distance_rank) : "-";
  return fmt::format("{:>11.4f}{:>12.4f}{:>7.2f}{:>6}  {}", came * per_si,
                     joint.rmse_about_mean * per_si, joint.confidence, rank,
                     is_inside ? "inside" : "outside");
}

std::string expected_cell(const model::ExpectedRmse& expected, double per_si) {
  return fmt::format("{:.4f} ({:.4f} to {:.4f})", expected.rmse * per_si, expected.low * per_si,
                     expected.high * per_si);
}

}  // namespace

std::string expectation_table(const Evaluation& evaluation, bool came) {
  std::string lines;
  for (const JointEvaluation& joint : evaluation.joints) {
    if (!joint.expected) continue;
    const auto& [same, other, about_mean] = *joint.expected;
    const core::DisplayUnit unit = core::display_unit(joint.unit);
    lines += fmt::format("{:<12}{:<5}{:>28}{:>28}{:>12.4f}{}\n", joint.joint, unit.name,
                         expected_cell(same, unit.per_si),
                         other ? expected_cell(*other, unit.per_si) : "unknown",
                         about_mean * unit.per_si, came ? came_text(joint, unit.per_si) : "");
  }
  if (lines.empty()) return {};
  return fmt::format(
      "RMSE that training expects on another recording, with its 95 % interval (\"another homing\" "
      "is unknown where the training shows one); \"about mean\" with the recording's mean error "
      "taken off{}\n{:<12}{:<5}{:>28}{:>28}{:>12}{}\n{}",
      came ? "; conf.: mean confidence of the plugin; rank: correlation of the error with the "
             "inputs' distance from the training"
           : "",
      "joint", "unit", "same homing", "another homing", "about mean",
      came ? fmt::format("{:>11}{:>12}{:>7}{:>6}", "came", "about mean", "conf.", "rank") : "",
      lines);
}

}  // namespace ravencal::learn
