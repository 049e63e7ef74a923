// SPDX-License-Identifier: Apache-2.0
//
// Seconds per training epoch on random data, best of some rounds, and the fraction of this
// machine's single-precision matrix product that they attain. One JSON line per network; run
// through train_bench.sh, which sets the same numbers of PyTorch beside them.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <string_view>
#include <vector>

#include "learn/aligned.hpp"
#include "learn/trainer.hpp"

namespace {

using namespace ravencal;

struct Case {
  std::string_view name;
  std::ptrdiff_t inputs;
  std::vector<std::uint32_t> hidden;
  std::ptrdiff_t rows;
};

template <typename Work>
double seconds_of(const Work& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

double seconds_per_epoch(const Case& c, const learn::TrainerSettings& settings, int rounds) {
  const learn::Shape shape(c.inputs, c.hidden, 3, model::Activation::kSigmoid);
  learn::Samples<float> samples;
  std::srand(1);
  samples.inputs.setRandom(c.inputs, c.rows);
  samples.targets.setRandom(3, c.rows);
  learn::Trainer<float> trainer(shape, settings, learn::initial_parameters(shape, settings.seed));
  double best = 1e9;
  for (int round = 0; round < rounds; ++round) {
    best = std::min(best, seconds_of([&] { trainer.run_epoch(samples); }));
  }
  return best;
}

/// Flops per second of one core in Eigen's large square product: what a trainer made of products
/// could attain at most. It is taken as a linear layer without activation, of the very kernels that
/// train; adding its biases costs below 1 % at this size.
double sgemm_peak(learn::Isa isa) {
  constexpr std::ptrdiff_t kSize = 2048;
  const learn::Shape shape(kSize, {}, kSize, model::Activation::kSigmoid);
  const auto square = static_cast<std::size_t>(kSize * kSize);
  learn::AlignedVector<float> parameters(static_cast<std::size_t>(shape.parameter_count()), 0.5F);
  learn::AlignedVector<float> inputs(square, 0.5F);
  learn::AlignedVector<float> workspace(static_cast<std::size_t>(shape.workspace_size(kSize)));
  learn::AlignedVector<float> outputs(square);
  learn::Tile<float> tile;
  tile.layers = shape.layers().data();
  tile.layer_count = 1;
  tile.parameters = parameters.data();
  tile.inputs = inputs.data();
  tile.samples = kSize;
  tile.workspace = workspace.data();
  double best = 1e9;
  for (int round = 0; round < 8; ++round) {
    best = std::min(best,
                    seconds_of([&] { learn::float_kernels(isa).forward(tile, outputs.data()); }));
  }
  return 2.0 * kSize * kSize * kSize / best;
}

}  // namespace

int main(int argc, char** argv) {
  learn::TrainerSettings settings;
  settings.threads = argc > 1 ? static_cast<unsigned>(std::atoi(argv[1])) : 1;
  const int rounds = argc > 2 ? std::atoi(argv[2]) : 5;
  if (argc > 3) settings.isa = learn::isa_from(argv[3]).value_or(settings.isa);
  if (argc > 4) settings.tile = static_cast<std::uint32_t>(std::atoi(argv[4]));
  const double peak = sgemm_peak(settings.isa) * settings.threads;
  const Case cases[] = {{"light", 112, {128, 64, 32}, 68000},
                        {"paper", 208, {600, 500, 400}, 20480}};
  for (const Case& c : cases) {
    const learn::Shape shape(c.inputs, c.hidden, 3, model::Activation::kSigmoid);
    const double seconds = seconds_per_epoch(c, settings, rounds);
    const double flops = shape.training_flops_per_sample() * static_cast<double>(c.rows) / seconds;
    fmt::print(
        "{{\"network\": \"{}\", \"rows\": {}, \"threads\": {}, \"isa\": \"{}\", \"s_per_epoch\": "
        "{:.5f}, \"gflops\": {:.1f}, \"sgemm_peak_gflops\": {:.1f}, \"share_of_peak\": {:.3f}}}\n",
        c.name, c.rows, settings.threads, learn::name_of(settings.isa), seconds, flops * 1e-9,
        peak * 1e-9, flops / peak);
  }
}
