// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <map>

#include "diagnose/channel/channel.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// Below this share of its own energy a column is only a mixture of what the model has.
constexpr double kLeastUniqueShare = 1e-4;

/// Gain in squared error at which all gates open nine times in ten: the chance gate with a margin
/// of 1.28 deviations (a squared normal's median is 0.455 of its variance), the size and share
/// gates.
double gain_needed(const TestedCandidate& t, const ScreenResult& result, const ChannelModel& model,
                   const Gates& gates) {
  const double deviation = std::sqrt(t.median_null / 0.455);
  const double chance = std::pow(std::sqrt(t.critical_gain) + 1.28 * deviation, 2);
  const auto rows = static_cast<double>(model.target.size());
  const double size = rows * std::pow(gates.size_per_floor * model.floor, 2);
  return std::max({chance, size, gates.least_share * result.errors.sum()});
}

NotFound limit_of(const TestedCandidate& t, const ScreenResult& result, const ChannelModel& model,
                  const Gates& gates) {
  const EffectForm& form = *model.candidates[t.candidate]->form;
  NotFound entry;
  entry.id = form.id();
  entry.joint = model.series->joint;
  if (t.unique_share < kLeastUniqueShare || t.unique_energy <= 0.0) {
    entry.not_testable_because =
        "in this motion it looks like what the plant's tolerances or the effects already named "
        "allow";
    return entry;
  }
  const double gain = gain_needed(t, result, model, gates);
  if (t.best.columns.cols() == 1) {
    const VectorXd least = VectorXd::Constant(1, std::sqrt(gain / t.unique_energy));
    const auto parameters = form.parameters(*model.series, t.best.shape, least);
    entry.detection_limit = std::abs(parameters.front().value);
    entry.unit = parameters.front().unit;
  } else {
    entry.detection_limit = std::sqrt(gain / static_cast<double>(model.target.size()));
    entry.unit = model.series->unit;
  }
  return entry;
}

/// Why a candidate was not tested; empty if it was.
std::string not_tested_because(const Candidate& candidate, const ChannelModel& model) {
  if (!candidate.untestable.empty() || model.permits(*candidate.form)) return candidate.untestable;
  return "it changes " + candidate.form->prerequisite() +
         ", which neither the plant nor this recording shows";
}

/// What a step is found by does not tell a slip from lost counts.
void add_step_limits(const ChannelFit& fit, std::map<std::string, NotFound>& entries) {
  const ChannelModel& model = fit.model;
  const auto least = least_step(*model.series, model.blocks, model.noise, model.correlation_rows);
  for (const char* id : {"slip", "lost_counts"}) {
    NotFound entry{id, model.series->joint, std::nullopt, model.series->unit, ""};
    if (least)
      entry.detection_limit = std::max(*least, model.floor);
    else
      entry.not_testable_because = "too little was recorded in one go";
    entries.emplace(id, entry);
  }
}

}  // namespace

void add_limits(const ChannelFit& fit, const ChannelOptions& options, ChannelFindings& findings) {
  const ScreenResult result = screen(fit.model, options.gates, options.seed + 500);
  const auto named = [&](const std::string& id) {
    return std::any_of(findings.effects.begin(), findings.effects.end(),
                       [&](const NamedEffect& effect) { return effect.id == id; });
  };
  // One line per id: of several sources (couplings), the one that is seen least well.
  std::map<std::string, NotFound> worst;
  for (const TestedCandidate& t : result.tested) {
    NotFound entry = limit_of(t, result, fit.model, options.gates);
    if (named(entry.id)) continue;
    auto [it, inserted] = worst.try_emplace(entry.id, entry);
    if (!inserted && entry.detection_limit && it->second.detection_limit &&
        *entry.detection_limit > *it->second.detection_limit) {
      it->second = entry;
    }
  }
  for (const auto& candidate : fit.model.candidates) {
    const std::string& id = candidate->form->id();
    const std::string why = not_tested_because(*candidate, fit.model);
    if (why.empty() || named(id) || worst.contains(id)) continue;
    worst.emplace(id, NotFound{id, findings.joint, std::nullopt, "", why});
  }
  const VectorXd deviation = nominal_deviation(fit, options.seed + 550);
  for (std::size_t i = 0; i < fit.nominal.terms.size(); ++i) {
    const NominalTerm& term = fit.nominal.terms[i];
    if (term.form_only || named(term.id) || worst.contains(term.id)) continue;
    const double least =
        (term.tolerance + 1.96 * deviation[static_cast<Index>(i)]) * std::abs(term.value);
    worst.emplace(term.id, NotFound{term.id, findings.joint, least, term.unit, ""});
  }
  if (findings.stage == Stage::kTransmission) add_step_limits(fit, worst);
  for (auto& [id, entry] : worst) {
    if (!named(id)) findings.not_found.push_back(std::move(entry));
  }
  const bool spoken = std::any_of(findings.not_found.begin(), findings.not_found.end(),
                                  [](const NotFound& n) { return n.id == "homing_offset"; });
  if (findings.stage == Stage::kTransmission && !spoken && !named("homing_offset")) {
    findings.not_found.push_back({"homing_offset", findings.joint,
                                  options.gates.size_per_floor * fit.model.floor, findings.unit,
                                  ""});
  }
}

}  // namespace ravencal::diagnose
