// SPDX-License-Identifier: Apache-2.0
#include "diagnose/search/search.hpp"

#include <algorithm>
#include <cmath>

#include "diagnose/findings/policy.hpp"

namespace ravencal::diagnose {
namespace {

class Limits {
 public:
  Limits(const Search& search, const Vocabulary& vocabulary)
      : search_(search), model_(search.best()), vocabulary_(vocabulary) {}

  [[nodiscard]] Limit of(const Resolution& r) const {
    const Candidate& candidate = vocabulary_.candidates[r.candidate];
    const double needed =
        search_.dispersion() *
        (candidate.kind == CandidateKind::kJump ? kJumpGainNineTimesInTen : kGainNineTimesInTen);
    const Parameter& size = candidate.sizes.front();
    const double x = std::max(std::sqrt(needed) * r.deviation, size.low);
    Limit out{r.candidate, std::abs(x * size.scale), r.own > kLeastOwn};
    if (!out.apart) return out;
    // What changes a channel by little has no name, however certain it is.
    Hit hit;
    hit.candidate = r.candidate;
    hit.start = r.start;
    hit.sizes.setZero(1);
    hit.sizes.resize(static_cast<Eigen::Index>(candidate.sizes.size()));
    hit.sizes.setZero();
    hit.sizes[0] = x;
    // Fitted again, the model without it makes all of it but its own share.
    const double share =
        std::sqrt(r.own) * search_.size_between(with(model_, vocabulary_, hit), model_);
    if (share > 0.0 && share < kLeastNamedSize) out.size *= kLeastNamedSize / share;
    return out;
  }

  /// A number whose prior would have to open.
  [[nodiscard]] Limit of_number(std::size_t c, double deviation, double own) const {
    const Candidate& candidate = vocabulary_.candidates[c];
    const Parameter& number = vocabulary_.numbers[*candidate.opens];
    const double closed2 = deviation * deviation + number.deviation * number.deviation;
    const double opened2 = deviation * deviation + std::pow(candidate.opened.deviation, 2);
    const double curvature = 1.0 / closed2 - 1.0 / opened2;
    const double by_gain =
        curvature > 0.0 ? std::sqrt(search_.dispersion() * kGainNineTimesInTen / curvature) : 0.0;
    const double by_prior = kWrongBy * number.deviation + kNineInTen_z * deviation;
    const double x = std::max(by_gain, by_prior);
    const double size = number.logarithmic ? number.nominal * std::expm1(x) : number.scale * x;
    return {c, std::abs(size), own > kLeastOwn && curvature > 0.0};
  }

 private:
  static constexpr double kNineInTen_z = 1.28;

  const Search& search_;
  const Model& model_;
  const Vocabulary& vocabulary_;
};

}  // namespace

std::vector<Limit> limits(const Search& search, const Likelihood& training,
                          const Vocabulary& vocabulary) {
  const Limits of(search, vocabulary);
  std::vector<Limit> out;
  for (const Resolution& r : resolutions(training, search.best(), vocabulary)) {
    const Candidate& candidate = vocabulary.candidates[r.candidate];
    if (candidate.unnamed()) continue;
    out.push_back(candidate.opens ? of.of_number(r.candidate, r.deviation, r.own) : of.of(r));
  }
  return out;
}

}  // namespace ravencal::diagnose
