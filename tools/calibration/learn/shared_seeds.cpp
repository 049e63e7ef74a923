// SPDX-License-Identifier: Apache-2.0
#include "learn/shared_seeds.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>

namespace ravencal::learn {
namespace {

using model::RandomSeeds;
using record::Recording;

std::optional<std::uint64_t> number_in(const Recording& recording, const char* key) {
  const auto entry = recording.meta.find(key);
  if (entry == recording.meta.end()) return std::nullopt;
  const std::string& text = entry->second;
  std::uint64_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return number;
}

/// Nothing where the recording is not the twin's.
std::optional<RandomSeeds> seeds_in(const Recording& recording) {
  const auto run = number_in(recording, "seed");
  const auto homing = number_in(recording, "homing_seed");
  if (!recording.meta.contains("plant_hash") || !run || !homing) return std::nullopt;
  return RandomSeeds{std::filesystem::path(recording.source).filename().string(), *run, *homing,
                     number_in(recording, "rehomings").value_or(0)};
}

}  // namespace

std::vector<RandomSeeds> seeds_of(std::span<const Recording* const> recordings) {
  std::vector<RandomSeeds> all;
  for (const Recording* recording : recordings) {
    if (auto seeds = seeds_in(*recording)) all.push_back(std::move(*seeds));
  }
  return all;
}

SharedSeeds shared_seeds(std::span<const RandomSeeds> trained,
                         std::span<const Recording* const> tested) {
  SharedSeeds shared;
  for (const Recording* recording : tested) {
    const auto own = seeds_in(*recording);
    if (!own) continue;
    const auto run = std::find_if(trained.begin(), trained.end(),
                                  [&](const RandomSeeds& other) { return other.run == own->run; });
    if (run != trained.end()) shared.runs.push_back({recording->source, run->recording, own->run});
    const auto homing = std::find_if(trained.begin(), trained.end(), [&](const RandomSeeds& other) {
      return other.homing == own->homing && other.rehomings == own->rehomings;
    });
    if (homing != trained.end())
      shared.homings.push_back({recording->source, homing->recording, own->homing});
  }
  return shared;
}

core::Status check_run_seeds(const SharedSeeds& shared) {
  if (shared.runs.empty()) return {};
  const SharedSeed& first = shared.runs.front();
  return core::data_error(fmt::format(
      "{}: has the run seed {} of {}, which the training saw: both wander alike, so this is no "
      "test. Simulate one of them with another --seed (and --homing-seed), or give --same-seed for "
      "figures all the same, which then say so",
      first.tested, first.seed, first.trained));
}

std::vector<std::string> sentences_of(const SharedSeeds& shared) {
  std::vector<std::string> sentences;
  for (const SharedSeed& one : shared.runs) {
    sentences.push_back(
        fmt::format("same seed: {} has the run seed {} of {}, which the training saw; both wander "
                    "alike, so this is no test",
                    one.tested, one.seed, one.trained));
  }
  for (const SharedSeed& one : shared.homings) {
    sentences.push_back(fmt::format(
        "one homing: {} has the homing (seed {}) of {}, which the training saw; another "
        "homing leaves another constant error",
        one.tested, one.seed, one.trained));
  }
  return sentences;
}

nlohmann::ordered_json shared_seeds_json(const std::vector<SharedSeed>& shared) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const SharedSeed& one : shared) {
    list.push_back({{"tested", one.tested}, {"trained", one.trained}, {"seed", one.seed}});
  }
  return list;
}

}  // namespace ravencal::learn
