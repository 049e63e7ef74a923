// SPDX-License-Identifier: Apache-2.0
#include "diagnose/findings/figures.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "diagnose/findings/words.hpp"

namespace ravencal::diagnose {
namespace {

using Words = std::pair<std::string_view, std::string_view>;

/// Metrics with words of their own; the first three stand for a joint, the first that there is.
constexpr std::array<Words, 6> kMetrics = {{{"position_rmse", "position error"},
                                            {"tracking_rmse", "tracking error"},
                                            {"effort_rmse", "effort error"},
                                            {"free_run_1s_rmse", "error of a free run over 1 s"},
                                            {"closed_loop_rmse", "error in closed loop"},
                                            {"closed_loop_mae", "mean error in closed loop"}}};
constexpr std::size_t kOfJoint = 3;

}  // namespace

const HeldOut* figure_of(const Report& report, const std::string& joint, std::string_view metric) {
  const auto it =
      std::find_if(report.held_out.begin(), report.held_out.end(),
                   [&](const HeldOut& h) { return h.joint == joint && h.metric == metric; });
  return it == report.held_out.end() ? nullptr : &*it;
}

const HeldOut* figure_of_stage(const Report& report, const std::string& joint,
                               std::string_view stage) {
  constexpr std::array<Words, 5> kShown = {{{"transmission", "position_rmse"},
                                            {"drive", "effort_rmse"},
                                            {"drive", "tracking_rmse"},
                                            {"transmission", "tracking_rmse"},
                                            {"joint", "free_run_1s_rmse"}}};
  for (const auto& [of_stage, metric] : kShown) {
    const HeldOut* figure = of_stage == stage ? figure_of(report, joint, metric) : nullptr;
    if (figure != nullptr) return figure;
  }
  return nullptr;
}

const HeldOut* figure_of_joint(const Report& report, const std::string& joint) {
  for (std::size_t m = 0; m < kOfJoint; ++m)
    if (const HeldOut* figure = figure_of(report, joint, kMetrics[m].first)) return figure;
  return nullptr;
}

std::string metric_words(std::string_view metric) {
  const auto it = std::find_if(kMetrics.begin(), kMetrics.end(),
                               [metric](const Words& w) { return w.first == metric; });
  return it != kMetrics.end() ? std::string(it->second) : words_of(std::string(metric));
}

std::string_view rows_words(bool fitted) {
  return fitted ? "on the rows that were fitted" : "on motion that no fit saw";
}

bool are_of_fitted_rows(const Report& report) {
  return std::none_of(report.looked_at.begin(), report.looked_at.end(),
                      [](const LookedAt& l) { return l.held_out_rows > 0; });
}

}  // namespace ravencal::diagnose
