// SPDX-License-Identifier: Apache-2.0
//
// A fit ends where its rows and priors say, and not where it began.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <utility>

#include "diagnose/search/screen.hpp"
#include "diagnose/track/tracks.hpp"
#include "diagnose_arm.hpp"

namespace ravencal::diagnose {
namespace {

constexpr int kStarts = 10;
/// Of the score, which tells names apart by some units.
constexpr double kSame = 0.5;
/// Priors wider than this say nothing of where to start.
constexpr double kUnknown = 100.0;

/// What a fit minimises: what a score tells apart.
double objective(const Likelihood& rows, Model& model) {
  judge(rows, 0.0, model);
  return model.judgement.loss / rows.dispersion() + model.prior();
}

/// One arm's recording and its plant, with the noise of the plant alone.
class FitOfTheArm : public ::testing::TestWithParam<const char*> {
 protected:
  FitOfTheArm()
      : plant_(physics::parse_plant(generator::arm_plant(), "one joint").value()),
        rows_(plant_,
              std::move(
                  make_tracks({generator::record_arm(
                                  {.gap_half_rad = 0.0015, .gain = 0.004, .uneven_n_m = 0.3},
                                  {.seed = 21, .duration_s = 90.0, .rate_hz = 50.0, .rich = true})},
                              {}, plant_, {})
                      .value()
                      .training)) {
    rows_.use_threads(1);
    vocabulary_ = vocabulary_of(plant_, rows_, nullptr);
    base_.numbers = vocabulary_.numbers;
    rows_.estimate_noise(rows_.base());
    fit(rows_, base_);
    rows_.estimate_noise(base_.state_for(rows_));
    fit(rows_, base_);
    judge(rows_, 0.0, base_);
    rows_.set_dispersion(base_.judgement.dispersion);
    fit(rows_, base_);
  }

  /// With the candidate of that name from where the screen would start it.
  [[nodiscard]] Model with_candidate(const std::string& id) const {
    for (std::size_t c = 0; c < vocabulary_.candidates.size(); ++c) {
      if (vocabulary_.candidates[c].id != id) continue;
      if (vocabulary_.candidates[c].opens) {
        Hit opened;
        opened.candidate = c;
        return with(base_, vocabulary_, opened);
      }
      for (Hit hit : screen_one(rows_, base_, vocabulary_.candidates[c])) {
        hit.candidate = c;
        return with(base_, vocabulary_, hit);
      }
    }
    ADD_FAILURE() << id << " is no candidate";
    return base_;
  }

  static void move_somewhere(Model& model, std::mt19937& draw) {
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> share(0.3, 3.0);
    for (Parameter* p : model.free())
      p->x = p->bounded(p->deviation > kUnknown ? share(draw) * p->x
                                                : p->mean + p->deviation * normal(draw));
  }

  physics::Plant plant_;
  Likelihood rows_;
  Vocabulary vocabulary_;
  Model base_;
};

TEST_P(FitOfTheArm, EndsAtOnePlaceAndNoWorseThanWhatItContains) {
  const Model started = with_candidate(GetParam());
  std::mt19937 draw(7);
  double least = 1e300, most = -1e300;
  for (int k = 0; k < kStarts; ++k) {
    Model model = started;
    if (k > 0) move_somewhere(model, draw);
    fit(rows_, model);
    const double reached = objective(rows_, model);
    least = std::min(least, reached);
    most = std::max(most, reached);
  }
  EXPECT_LT(most - least, kSame);
  EXPECT_LT(most, objective(rows_, base_) + kSame);
}

INSTANTIATE_TEST_SUITE_P(Names, FitOfTheArm,
                         ::testing::Values("gain_error", "homing_offset", "asymmetric_friction",
                                           "compliance", "coulomb_friction", "thermal_drift"),
                         [](const auto& tested) { return std::string(tested.param); });

}  // namespace
}  // namespace ravencal::diagnose
