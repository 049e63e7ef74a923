// SPDX-License-Identifier: Apache-2.0
#include "diagnose/search/search.hpp"

#include <algorithm>
#include <cmath>

#include "diagnose/findings/policy.hpp"

namespace ravencal::diagnose {
namespace {

constexpr double kNineInTen_z = 1.28;

Limit limit_of_effect(const Search& search, const Vocabulary& vocabulary, const Resolution& r) {
  const Candidate& candidate = vocabulary.candidates[r.candidate];
  const double needed =
      candidate.kind == CandidateKind::kJump ? kJumpGainNineTimesInTen : kGainNineTimesInTen;
  const Parameter& size = candidate.sizes.front();
  const double x = std::max(std::sqrt(needed) * r.deviation, size.low);
  Limit out{r.candidate, std::abs(x * size.scale), r.own > kLeastOwn};
  if (!out.apart) return out;
  // What changes a channel by little has no name, however certain it is.
  Hit hit;
  hit.candidate = r.candidate;
  hit.start = r.start;
  hit.sizes.setZero(static_cast<Eigen::Index>(candidate.sizes.size()));
  hit.sizes[0] = x;
  // Fitted again, the model without it makes all of it but its own share.
  const double share =
      std::sqrt(r.own) * search.size_between(with(search.best(), vocabulary, hit), search.best());
  if (share > 0.0 && share < kLeastNamedSize) out.size *= kLeastNamedSize / share;
  return out;
}

/// A number whose prior would have to open.
Limit limit_of_number(const Vocabulary& vocabulary, const Resolution& r) {
  const Candidate& candidate = vocabulary.candidates[r.candidate];
  const Parameter& number = vocabulary.numbers[*candidate.opens];
  const double closed2 = r.deviation * r.deviation + number.deviation * number.deviation;
  const double opened2 = r.deviation * r.deviation + std::pow(candidate.opened.deviation, 2);
  const double curvature = 1.0 / closed2 - 1.0 / opened2;
  const double by_gain = curvature > 0.0 ? std::sqrt(kGainNineTimesInTen / curvature) : 0.0;
  const double by_prior = kWrongBy * number.deviation + kNineInTen_z * r.deviation;
  const double x = std::max(by_gain, by_prior);
  return {r.candidate, std::abs(number.scale * x), r.own > kLeastOwn && curvature > 0.0};
}

}  // namespace

std::vector<Limit> limits(const Search& search, const Likelihood& training,
                          const Vocabulary& vocabulary) {
  std::vector<Limit> out;
  for (const Resolution& r : resolutions(training, search.best(), vocabulary)) {
    const Candidate& candidate = vocabulary.candidates[r.candidate];
    if (candidate.unnamed()) continue;
    out.push_back(candidate.opens ? limit_of_number(vocabulary, r)
                                  : limit_of_effect(search, vocabulary, r));
  }
  return out;
}

}  // namespace ravencal::diagnose
