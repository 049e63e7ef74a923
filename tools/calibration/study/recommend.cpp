// SPDX-License-Identifier: Apache-2.0
#include "study/recommend.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

namespace ravencal::study {
namespace {

/// Errors closer than this are not worth a slower step.
constexpr double kAsGood = 1.02;

struct Candidate {
  const MethodResult* method;
  const CurvePoint* point;  ///< the longest training that the user affords
  [[nodiscard]] double error() const { return overall(point->rmse); }
};

/// The longest training within `minutes`, or the shortest there is.
const CurvePoint* affordable(const MethodResult& m, const std::optional<double>& minutes) {
  const CurvePoint* best = &m.curve.front();
  for (const CurvePoint& point : m.curve) {
    if (!minutes || point.minutes <= 1.001 * *minutes) best = &point;
  }
  return best;
}

std::string names(const std::vector<std::string>& list) {
  return list.empty() ? "none" : fmt::format("{}", fmt::join(list, ", "));
}

}  // namespace

core::Result<Recommendation> recommend(const Comparison& comparison,
                                       const Constraints& constraints) {
  std::vector<Candidate> candidates;
  std::vector<std::string> slow, unloadable;
  const MethodResult* best_of_all = nullptr;
  for (const MethodResult& m : comparison.methods) {
    if (m.status != CompareStatus::kDone || m.curve.empty()) continue;
    if (best_of_all == nullptr || overall(affordable(m, constraints.minutes)->rmse) <
                                      overall(affordable(*best_of_all, constraints.minutes)->rmse))
      best_of_all = &m;
    if (!m.loop.loadable)
      unloadable.push_back(m.id);
    else if (!(m.loop.step.p999_us <= constraints.step_budget_us))
      slow.push_back(fmt::format("{} ({:.1f} µs)", m.id, m.loop.step.p999_us));
    else
      candidates.push_back({&m, affordable(m, constraints.minutes)});
  }
  if (candidates.empty()) {
    return core::Error{
        core::ErrorCode::kData,
        fmt::format("no method qualifies: slower than {:g} µs at p99.9: {}; cannot be loaded: {}",
                    constraints.step_budget_us, names(slow), names(unloadable))};
  }
  const auto least = std::min_element(
      candidates.begin(), candidates.end(),
      [](const Candidate& a, const Candidate& b) { return a.error() < b.error(); });
  const Candidate* chosen = &*least;
  for (const Candidate& c : candidates) {
    if (c.error() <= kAsGood * least->error() &&
        c.method->loop.step.p999_us < chosen->method->loop.step.p999_us)
      chosen = &c;
  }
  const MethodResult& m = *chosen->method;
  Recommendation r{m.id,
                   m.title,
                   m.model_file,
                   m.loop.step.p999_us,
                   m.loop.measured,
                   chosen->point->minutes,
                   chosen->point->rmse,
                   {},
                   {},
                   {}};
  for (const CompareJoint& joint : m.joints) {
    r.joints.push_back(joint.joint);
    r.units.push_back(joint.unit);
  }
  r.reasons.push_back(fmt::format(
      "Of {} method(s) that can be loaded and keep {:g} µs it leaves the "
      "least error{}.",
      candidates.size(), constraints.step_budget_us,
      chosen == &*least ? "" : fmt::format(" (within 2 % of {}, and faster)", least->method->id)));
  r.reasons.push_back(fmt::format(
      "Its step takes {:.1f} µs at p99.9, {}.", r.step_p999_us,
      r.measured_in_loop ? "measured in the 1 kHz loop" : "measured by itself, not in the loop"));
  const double whole = m.curve.back().minutes;
  if (constraints.minutes && *constraints.minutes < m.curve.front().minutes) {
    r.reasons.push_back(fmt::format(
        "The comparison knows no training as short as {:g} min; these figures are of {:.1f} min.",
        *constraints.minutes, r.minutes));
  } else if (r.minutes < whole) {
    r.reasons.push_back(fmt::format(
        "The figures are of {:.1f} min of training; {:.1f} min would leave {:.0f} % of that error.",
        r.minutes, whole, 100.0 * overall(m.curve.back().rmse) / chosen->error()));
  }
  if (best_of_all != &m) {
    r.reasons.push_back(fmt::format(
        "{} leaves {:.0f} % of its error, but {}.", best_of_all->title,
        100.0 * overall(affordable(*best_of_all, constraints.minutes)->rmse) / chosen->error(),
        best_of_all->loop.loadable ? fmt::format("takes {:.1f} µs", best_of_all->loop.step.p999_us)
                                   : "cannot be loaded: " + best_of_all->loop.why_not));
  }
  if (!slow.empty()) r.reasons.push_back("Too slow: " + names(slow) + ".");
  return r;
}

std::string recommendation_text(const Recommendation& r, const std::string& folder) {
  std::string text = fmt::format("{} ({})\n", r.title, r.method);
  for (std::size_t k = 0; k < r.joints.size(); ++k)
    text += fmt::format("  {:<12}{:>10.4g} {} RMSE\n", r.joints[k], r.rmse[k], r.units[k]);
  for (const std::string& reason : r.reasons) text += reason + "\n";
  if (r.model_file.ends_with(".onnx"))
    text += fmt::format("next: ravencal convert {}/{} --out arm.blob\n", folder, r.model_file);
  else
    text += fmt::format("next: load {}/{}\n", folder, r.model_file);
  return text;
}

std::string recommendation_json(const Recommendation& r) {
  nlohmann::ordered_json joints = nlohmann::ordered_json::array();
  for (std::size_t k = 0; k < r.joints.size(); ++k)
    joints.push_back({{"joint", r.joints[k]}, {"unit", r.units[k]}, {"rmse", r.rmse[k]}});
  return nlohmann::ordered_json{{"method", r.method},
                                {"model", r.model_file},
                                {"step_p999_us", r.step_p999_us},
                                {"measured_in_loop", r.measured_in_loop},
                                {"minutes", r.minutes},
                                {"joints", joints},
                                {"reasons", r.reasons}}
             .dump(2) +
         "\n";
}

}  // namespace ravencal::study
