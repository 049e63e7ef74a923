// SPDX-License-Identifier: Apache-2.0
#include <mutex>
#include <random>
#include <vector>

#include "core/side_by_side.hpp"
#include "diagnose/explain/models.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::VectorXd;

/// The best model with its numbers, and nothing that was added to the plant.
State nothing_left_out(const Models& models) {
  Model model = models.best;
  for (const std::size_t c : models.best.chosen) model = without(model, models.vocabulary, c);
  return model.state_for(models.training);
}

VectorXd with_signs_drawn(VectorXd innovations, const Likelihood& likelihood, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<double> signs;
  for (int block = 0; block < likelihood.block_count(); ++block)
    signs.push_back((random() & 1U) != 0 ? 1.0 : -1.0);
  for (Eigen::Index i = 0; i < innovations.size(); ++i)
    innovations[i] *=
        signs[static_cast<std::size_t>(likelihood.blocks()[static_cast<std::size_t>(i)])];
  return innovations;
}

}  // namespace

double false_alarm_rate(const Models& models, int placebos, std::uint64_t seed,
                        const std::function<bool(double share)>& go_on) {
  const Likelihood& training = models.training;
  const State best = models.best.state_for(training);
  const VectorXd innovations = training.whitened(training.residuals(best, training.outcome(best)));
  const State null = nothing_left_out(models);
  const Outcome predicted = training.outcome(null);
  std::vector<char> alarm(static_cast<std::size_t>(placebos), 0);
  std::mutex mutex;
  int done = 0;
  bool stopped = false;
  const auto going_on = [&] {
    const std::lock_guard<std::mutex> lock(mutex);
    stopped = stopped || !go_on(static_cast<double>(done) / placebos);
    return !stopped;
  };
  core::for_each_index(alarm.size(), training.threads(), [&](std::size_t i) {
    if (!going_on()) return;
    const std::uint64_t own_seed = seed + 1000003U * (i + 1);
    Likelihood placebo = training;
    placebo.use_threads(1);
    placebo.measure_anew(null, predicted, with_signs_drawn(innovations, training, own_seed));
    Vocabulary vocabulary = models.vocabulary;
    Search search(placebo, nullptr, vocabulary, models.search.alpha(), own_seed);
    search.run(going_on);
    alarm[i] = search.best().chosen.empty() ? 0 : 1;
    const std::lock_guard<std::mutex> lock(mutex);
    ++done;
  });
  int alarms = 0;
  for (const char rang : alarm) alarms += rang;
  return static_cast<double>(alarms) / placebos;
}

}  // namespace ravencal::diagnose
