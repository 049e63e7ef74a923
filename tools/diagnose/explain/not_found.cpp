// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>

#include "diagnose/explain/models.hpp"
#include "diagnose/explain/parts.hpp"
#include "diagnose/findings/effect_words.hpp"
#include "diagnose/findings/policy.hpp"
#include "diagnose/search/search.hpp"
#include "diagnose/vocabulary/scales.hpp"

namespace ravencal::diagnose {
namespace {

/// The limit that is hardest to reach of all candidates of that id and joint; null without any.
const Limit* worst_of(const std::vector<Limit>& limits, const Vocabulary& vocabulary,
                      std::size_t joint, std::string_view id) {
  const Limit* worst = nullptr;
  for (const Limit& limit : limits) {
    const Candidate& candidate = vocabulary.candidates[limit.candidate];
    if (candidate.joint != joint || candidate.id != id) continue;
    const bool harder = worst == nullptr || (worst->apart && !limit.apart) ||
                        (worst->apart == limit.apart && limit.size > worst->size);
    if (harder) worst = &limit;
  }
  return worst;
}

const Parameter& first_of(const Candidate& candidate, const Vocabulary& vocabulary) {
  return candidate.opens ? vocabulary.numbers[*candidate.opens] : candidate.sizes.front();
}

NotFound silent(const Models& models, const std::vector<Limit>& limits, std::size_t joint,
                const EffectWords& words) {
  NotFound out{std::string(words.id), models.given.joints[joint].name, std::nullopt, "", ""};
  const Scales scales = scales_of(models.given, joint, models.training);
  const Limit* limit = worst_of(limits, models.vocabulary, joint, words.id);
  if (limit != nullptr && limit->apart) {
    const Parameter& size =
        first_of(models.vocabulary.candidates[limit->candidate], models.vocabulary);
    if (!size.said) {
      // It holds or it does not: there is no size to be seen.
      out.not_testable_because = "looked for at every effort that was recorded, and none holds";
      return out;
    }
    out.detection_limit = limit->size;
    out.unit = size.unit.empty() ? "1" : size.unit;
    out.parameter = size.name;
    return out;
  }
  if (!shown(models.training, joint, words.stage)) {
    out.not_testable_because = why_not(models.training, joint, words.stage);
    out.by_recording = true;
    return out;
  }
  Untestable why = why_untestable(out.id, scales, models.given);
  if (!why.because.empty()) {
    out.not_testable_because = std::move(why.because);
    out.by_recording = why.by_recording;
  } else if (limit != nullptr) {
    out.not_testable_because =
        "at any plausible size it cannot be told apart from plant parameters or effects already "
        "named";
    out.by_recording = true;
  } else if (models.given.joints[joint].find_effect(out.id) != nullptr) {
    out.not_testable_because = "the plant has it: any size of it is expected";
  } else {
    out.not_testable_because = "no channel of this joint shows it";
  }
  return out;
}

}  // namespace

void add_not_found(const Models& models, Report& report) {
  const std::vector<Limit> all = limits(models.search, models.training, models.vocabulary);
  for (std::size_t j = 0; j < models.given.joints.size(); ++j) {
    const std::string& joint = models.given.joints[j].name;
    for (const EffectWords& words : vocabulary_words()) {
      if (words.id == kUnknown) continue;
      const bool named =
          std::any_of(report.effects.begin(), report.effects.end(),
                      [&](const NamedEffect& e) { return e.id == words.id && e.joint == joint; });
      if (!named) report.not_found.push_back(silent(models, all, j, words));
    }
  }
}

void add_candidates(const Models& models, std::uint64_t seed, Report& report) {
  const double dispersion = models.search.dispersion();
  const double loss = models.best.judgement.loss;
  for (const Hit& hit : screen(models.training, models.best, models.vocabulary, seed)) {
    const Candidate& candidate = models.vocabulary.candidates[hit.candidate];
    const Parameter& size = first_of(candidate, models.vocabulary);
    CandidateRow row;
    row.joint = models.given.joints[candidate.joint].name;
    row.stage = words_for(candidate.id).stage;
    row.id = candidate.id;
    row.gain_share = loss > 0.0 ? hit.gain / loss : 0.0;
    row.z = std::sqrt(hit.statistic);
    row.p_value = hit.p_value;
    row.size = hit.sizes.size() > 0 ? size.scale * hit.sizes[0] : 0.0;
    row.unit = size.unit;
    row.outcome =
        hit.gain < kLeastGain * dispersion ? "gains less than a name costs" : "tried, not kept";
    report.candidates.push_back(std::move(row));
  }
  for (const std::size_t c : models.best.chosen) {
    const Candidate& candidate = models.vocabulary.candidates[c];
    constexpr double kNotScreened = std::numeric_limits<double>::quiet_NaN();
    report.candidates.push_back(
        {models.given.joints[candidate.joint].name, std::string(words_for(candidate.id).stage),
         candidate.id, kNotScreened, kNotScreened, kNotScreened, kNotScreened, "", "named"});
  }
}

}  // namespace ravencal::diagnose
