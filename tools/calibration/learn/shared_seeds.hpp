// SPDX-License-Identifier: Apache-2.0
//
// Whether a test on the digital twin is one: a recording with a run seed of the training has the
// same random wander, which a model may have learned although no feature tells it on a robot.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "model/random_seeds.hpp"
#include "record/recording.hpp"

namespace ravencal::learn {

/// Of those recordings that state their seeds in `meta`, as `simulate` writes it.
std::vector<model::RandomSeeds> seeds_of(std::span<const record::Recording* const> recordings);

/// A recording that is tested on, and one of the training with the same seed.
struct SharedSeed {
  std::string tested;
  std::string trained;
  std::uint64_t seed = 0;
};

struct SharedSeeds {
  std::vector<SharedSeed> runs;     ///< the same run seed: no test
  std::vector<SharedSeed> homings;  ///< one homing: a test within one session
  [[nodiscard]] bool empty() const { return runs.empty() && homings.empty(); }
};

/// At most one of each kind per tested recording. `trained`: of the model, or of the training.
SharedSeeds shared_seeds(std::span<const model::RandomSeeds> trained,
                         std::span<const record::Recording* const> tested);

/// Errors (kData): a tested recording has a run seed of the training. `--same-seed` is the user's
/// way around.
core::Status check_run_seeds(const SharedSeeds& shared);

/// Sentences for beneath a table, a line each; empty: nothing is shared.
std::vector<std::string> sentences_of(const SharedSeeds& shared);

/// `same_seed` and `one_homing`: lists of `tested`, `trained`, `seed`.
nlohmann::ordered_json shared_seeds_json(const std::vector<SharedSeed>& shared);

}  // namespace ravencal::learn
