// SPDX-License-Identifier: Apache-2.0
#include "study/bootstrap.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/random.hpp"

namespace ravencal::study {

Interval central_interval(std::vector<double> values) {
  std::erase_if(values, [](double value) { return !std::isfinite(value); });
  constexpr std::size_t kFewest = 40;  // fewer have no 2.5 % tail
  if (values.size() < kFewest) {
    return {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::quiet_NaN()};
  }
  std::sort(values.begin(), values.end());
  const auto at = [&](double share) {
    return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
  };
  return {at(0.025), at(0.975)};
}

Resamples::Resamples(std::span<const std::size_t> blocks_per_recording, std::size_t seeds,
                     std::size_t run_blocks, std::uint64_t seed)
    : seeds_(seeds) {
  std::size_t total = 0;
  for (const std::size_t blocks : blocks_per_recording) {
    first_block_.push_back(total);
    total += blocks;
  }
  core::Random random(seed);
  for (std::size_t sample = 0; sample < kResamples; ++sample) {
    std::vector<std::uint16_t> weights(total, 0);
    for (std::size_t r = 0; r < blocks_per_recording.size(); ++r) {
      const std::size_t blocks = blocks_per_recording[r];
      for (std::size_t drawn = 0; drawn < blocks;) {
        const std::uint64_t start = random.below(blocks);
        for (std::size_t i = 0; i < run_blocks && drawn < blocks; ++i, ++drawn) {
          ++weights[first_block_[r] + (start + i) % blocks];
        }
      }
    }
    block_weights_.push_back(std::move(weights));
    std::vector<std::uint16_t> seed_weights(seeds, 0);
    for (std::size_t i = 0; i < seeds; ++i) ++seed_weights[random.below(seeds)];
    seed_weights_.push_back(std::move(seed_weights));
  }
}

std::vector<double> Resamples::rmse(const SeedErrors& errors) const {
  std::vector<double> result;
  result.reserve(kResamples);
  for (std::size_t sample = 0; sample < kResamples; ++sample) {
    const std::vector<std::uint16_t>& weights = block_weights_[sample];
    double sum_of_rmse = 0.0;
    for (std::size_t s = 0; s < seeds_; ++s) {
      if (seed_weights_[sample][s] == 0) continue;
      double squares = 0.0;
      double count = 0.0;
      for (std::size_t r = 0; r < first_block_.size(); ++r) {
        const ErrorBlocks& blocks = errors[s][r];
        for (std::size_t i = 0; i < blocks.squares.size(); ++i) {
          const double weight = weights[first_block_[r] + i];
          squares += weight * blocks.squares[i];
          count += weight * blocks.counts[i];
        }
      }
      sum_of_rmse += seed_weights_[sample][s] * std::sqrt(squares / count);
    }
    result.push_back(sum_of_rmse / static_cast<double>(seeds_));
  }
  return result;
}

Resamples resamples_for(std::span<const SeedErrors> joints, std::uint64_t seed) {
  double longest_s = 0.0;
  std::vector<std::size_t> blocks;
  std::size_t seeds = 0;
  for (const SeedErrors& errors : joints) {
    seeds = errors.size();
    for (const std::vector<ErrorBlocks>& recordings : errors) {
      blocks.clear();
      for (const ErrorBlocks& recording : recordings) {
        longest_s = std::max(longest_s, recording.correlation_s);
        blocks.push_back(recording.squares.size());
      }
    }
  }
  const std::size_t shortest = *std::min_element(blocks.begin(), blocks.end());
  const auto wanted = static_cast<std::size_t>(std::ceil(4.0 * longest_s / kBlockS));
  const std::size_t run =
      std::clamp<std::size_t>(wanted, 1, std::max<std::size_t>(1, shortest / 4));
  return {blocks, seeds, run, seed};
}

double pooled_rmse(std::span<const ErrorBlocks> recordings) {
  double squares = 0.0;
  double count = 0.0;
  for (const ErrorBlocks& blocks : recordings) {
    for (const double square : blocks.squares) squares += square;
    count += blocks.samples();
  }
  return std::sqrt(squares / count);
}

}  // namespace ravencal::study
