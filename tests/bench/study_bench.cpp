// SPDX-License-Identifier: Apache-2.0
//
// Would the seeds of a study's row train faster together? Networks of one shape that share their
// batches can share one wide first layer; the layers above stay apart. This times that layer, five
// times alone and once of five-fold width, and what it would save of the whole network. CPU time of
// one thread, best of seven epochs.
#include <time.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <vector>

#include "core/random.hpp"
#include "learn/trainer.hpp"

namespace {

using ravencal::learn::Samples;

constexpr std::uint32_t kNetworks = 5;
constexpr Eigen::Index kInputs = 98;
constexpr Eigen::Index kRows = 20480;

double thread_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

double epoch_seconds(const std::vector<std::uint32_t>& hidden, const Samples<float>& samples) {
  const ravencal::learn::Shape shape(kInputs, hidden, samples.targets.rows(),
                                     ravencal::model::Activation::kSigmoid);
  ravencal::learn::TrainerSettings settings;
  settings.threads = 1;
  ravencal::learn::Trainer<float> trainer(shape, settings,
                                          ravencal::learn::initial_parameters(shape, 1));
  trainer.run_epoch(samples);
  double best = 1e9;
  for (int i = 0; i < 7; ++i) {
    const double start = thread_seconds();
    trainer.run_epoch(samples);
    best = std::min(best, thread_seconds() - start);
  }
  return best;
}

void compare(const char* name, const std::vector<std::uint32_t>& hidden,
             const Samples<float>& samples) {
  const double alone = kNetworks * epoch_seconds({hidden.front()}, samples);
  const double together = epoch_seconds({kNetworks * hidden.front()}, samples);
  const double whole = kNetworks * epoch_seconds(hidden, samples);
  std::printf(
      "%s: first layers of %u networks %.4f s apart, %.4f s together; whole networks "
      "%.4f s, at most %.2f times faster together\n",
      name, kNetworks, alone, together, whole, whole / (whole - alone + together));
}

}  // namespace

int main() {
  Samples<float> samples;
  samples.inputs.resize(kInputs, kRows);
  samples.targets.setZero(3, kRows);
  ravencal::core::Random random(1);
  for (Eigen::Index i = 0; i < samples.inputs.size(); ++i) {
    samples.inputs.data()[i] = static_cast<float>(random.uniform());
  }
  compare("light", {128, 64, 32}, samples);
  compare("paper", {600, 500, 400}, samples);
  return 0;
}
