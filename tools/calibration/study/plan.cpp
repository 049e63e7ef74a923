// SPDX-License-Identifier: Apache-2.0
#include "study/plan.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <optional>
#include <set>

#include "learn/distinct.hpp"
#include "learn/file_hash.hpp"
#include "model/feature_spec.hpp"
#include "study/job_store.hpp"

namespace ravencal::study {
namespace {

using Channels = std::vector<record::Channel>;

std::set<std::string> names_selected(std::string_view features, const Channels& channels) {
  std::set<std::string> names;
  const auto selected = model::select_features(features, channels);
  if (!selected.ok()) return names;
  for (const model::FeatureSpec& feature : *selected) names.insert(feature.channel);
  return names;
}

/// `base` without the set, or nothing if that leaves all or none of it.
std::optional<std::string> without(const std::string& base, const FeatureSet& set,
                                   const Channels& channels) {
  const std::set<std::string> all = names_selected(base, channels);
  std::string features = base;
  for (const std::string& term : set.terms) {
    if (!names_selected(term, channels).empty()) features += (features.empty() ? "-" : ",-") + term;
  }
  const auto left = model::select_features(features, channels);
  if (!left.ok() || left->empty()) return std::nullopt;
  if (names_selected(features, channels) == all) return std::nullopt;
  return features;
}

/// The text that the user gave, or `preferred` where the recording has its channels, or all.
core::Result<std::string> base_of(const std::string& given, std::string_view preferred,
                                  const Channels& channels) {
  if (given.empty()) {
    return std::string(model::select_features(preferred, channels).ok() ? preferred : "");
  }
  const auto selected = model::select_features(given, channels);
  if (!selected.ok()) return selected.error();
  return given;
}

/// Adds jobs to a plan, seed by seed.
class Planner {
 public:
  Planner(Plan& plan, const Channels& channels) : plan_(plan), channels_(channels) {}

  void add(std::size_t condition, std::string_view row, const std::string& features,
           TestSet tests) {
    const auto selected = model::select_features(features, channels_);
    const auto width = selected.ok() ? static_cast<std::uint32_t>(selected->size()) : 0U;
    for (std::uint32_t i = 0; i < plan_.settings.seeds; ++i) {
      Job job;
      job.condition = condition;
      job.row = row;
      job.features = features;
      job.seed = plan_.settings.first_seed + 10ULL * i;
      job.tests = tests;
      job.width = width;
      job.key = key_of(description_of(plan_, job));
      plan_.jobs.push_back(std::move(job));
    }
  }

  void add_without(std::size_t condition, const std::string& base, const FeatureSet& set) {
    if (const auto features = without(base, set, channels_)) {
      add(condition, set.id, *features, TestSet::kPlain);
    } else {
      plan_.left_out.push_back(fmt::format("{}, without {}: leaves all or none of the features",
                                           plan_.conditions[condition].title, set.title));
    }
  }

  void add_homing(std::size_t condition, const std::string& base) {
    add(condition, kAllFeatures, base, TestSet::kEncoder);
    for (const FeatureSet& set : homing_sets()) {
      if (plan_.study != kPaperStudy || set.id == kNoEncoder) add_without(condition, base, set);
    }
    if (const auto features = without(base, other_poses(), channels_)) {
      add(condition, kOnlyEncoder, *features, TestSet::kEncoder);
    }
  }

 private:
  Plan& plan_;
  const Channels& channels_;
};

core::Status read_inputs(Plan& plan, RecordingStore& recordings) {
  std::set<std::string> paths;
  for (const Condition& condition : plan.conditions) {
    paths.insert(condition.train.begin(), condition.train.end());
    paths.insert(condition.test.begin(), condition.test.end());
  }
  for (const std::string& path : paths) {
    RAVENCAL_ASSIGN_OR_RETURN(std::string hash, learn::sha256_of_file(path));
    RAVENCAL_ASSIGN_OR_RETURN(const record::Recording* const recording, recordings.get(path));
    plan.inputs.push_back({path, std::move(hash), static_cast<std::uint64_t>(recording->rows())});
  }
  return {};
}

const Input* input_of(const Plan& plan, const std::string& path) {
  const auto input = std::find_if(plan.inputs.begin(), plan.inputs.end(),
                                  [&](const Input& i) { return i.path == path; });
  return input == plan.inputs.end() ? nullptr : &*input;
}

std::string hashes_of(const Plan& plan, const std::vector<std::string>& paths) {
  std::vector<std::string> hashes;
  for (const std::string& path : paths) {
    const Input* const input = input_of(plan, path);
    hashes.push_back(input == nullptr ? "unknown" : input->sha256);
  }
  return fmt::format("{}", fmt::join(hashes, ","));
}

core::Status check(const Plan& plan) {
  if (std::find(std::begin(kStudies), std::end(kStudies), plan.study) == std::end(kStudies)) {
    return core::Error{core::ErrorCode::kUsage, fmt::format("'{}' is no study; they are {}",
                                                            plan.study, fmt::join(kStudies, ", "))};
  }
  for (const Condition& condition : plan.conditions) {
    if (condition.train.empty() || condition.test.empty()) {
      return core::Error{
          core::ErrorCode::kUsage,
          fmt::format("{}: name recordings to train on and others to test on", condition.title)};
    }
  }
  return {};
}

/// Errors: kData for a test that its own condition trains on.
core::Status check_tests_are_unseen(const Plan& plan) {
  const auto hashed = [&plan](const std::vector<std::string>& paths) {
    std::vector<learn::HashedFile> files;
    for (const std::string& path : paths) files.push_back({path, input_of(plan, path)->sha256});
    return files;
  };
  for (const Condition& condition : plan.conditions) {
    RAVENCAL_RETURN_IF_ERROR(learn::check_unseen(hashed(condition.train), hashed(condition.test)));
  }
  return {};
}

core::Status find_what_is_shared(Plan& plan, RecordingStore& recordings) {
  for (Condition& condition : plan.conditions) {
    std::vector<const record::Recording*> training, tested;
    for (const auto& [paths, list] :
         {std::pair{&condition.train, &training}, std::pair{&condition.test, &tested}}) {
      for (const std::string& path : *paths) {
        RAVENCAL_ASSIGN_OR_RETURN(const record::Recording* const one, recordings.get(path));
        list->push_back(one);
      }
    }
    RAVENCAL_RETURN_IF_ERROR(learn::check_unseen(training, tested));
    condition.shared = learn::shared_seeds(learn::seeds_of(training), tested);
  }
  return {};
}

/// How rows were chosen: another choice gives other results.
std::string words_of(const record::LoadOptions& load) {
  std::string words = load.skip_bad ? "skip-bad" : "";
  if (load.range.from_s) words += fmt::format(" from {}", *load.range.from_s);
  if (load.range.to_s) words += fmt::format(" to {}", *load.range.to_s);
  return words;
}

}  // namespace

bool includes(const Plan& plan, std::string_view study) {
  return plan.study == study || plan.study == "all" || plan.study == kPaperStudy;
}

std::string description_of(const Plan& plan, const Job& job) {
  const Condition& condition = plan.conditions[job.condition];
  const Settings& s = plan.settings;
  return fmt::format(
      "ravencal ablation 2; train {}; test {}; load {} {} {}; features {}; seed {}; hidden {}; "
      "epochs {}; batch {}; kernels {}; tests {}; noise of {} rows",
      hashes_of(plan, condition.train), hashes_of(plan, condition.test), plan.load.profile,
      plan.load.profile_options.arm, words_of(plan.load), job.features, job.seed,
      fmt::join(s.hidden, ","), s.epochs, s.batch, learn::name_of(s.isa), name_of(job.tests),
      name_of(s.noise_from));
}

learn::TrainOptions train_options(const Plan& plan, const Job& job, unsigned threads) {
  learn::TrainOptions options;
  options.features = job.features;
  options.hidden = plan.settings.hidden;
  options.trainer.epochs = plan.settings.epochs;
  options.trainer.batch = plan.settings.batch;
  options.trainer.seed = job.seed;
  options.trainer.threads = threads;
  options.trainer.isa = plan.settings.isa;
  return options;
}

std::uint64_t training_rows(const Plan& plan, const Job& job) {
  std::uint64_t rows = 0;
  for (const std::string& path : plan.conditions[job.condition].train) {
    const Input* const input = input_of(plan, path);
    if (input != nullptr) rows += input->rows;
  }
  return rows;
}

core::Result<std::vector<std::string>> changed_inputs(const Plan& plan, const Job& job) {
  const Condition& condition = plan.conditions[job.condition];
  std::vector<std::string> changed;
  for (const auto* paths : {&condition.train, &condition.test}) {
    for (const std::string& path : *paths) {
      RAVENCAL_ASSIGN_OR_RETURN(const std::string hash, learn::sha256_of_file(path));
      const Input* const input = input_of(plan, path);
      if (input == nullptr || input->sha256 != hash) changed.push_back(path);
    }
  }
  return changed;
}

core::Result<Plan> make_plan(std::string study, Settings settings, record::LoadOptions load,
                             std::vector<Condition> conditions, RecordingStore& recordings) {
  Plan plan;
  plan.study = std::move(study);
  plan.settings = std::move(settings);
  plan.load = std::move(load);
  plan.conditions = std::move(conditions);
  RAVENCAL_RETURN_IF_ERROR(check(plan));
  RAVENCAL_RETURN_IF_ERROR(read_inputs(plan, recordings));
  RAVENCAL_RETURN_IF_ERROR(check_tests_are_unseen(plan));
  RAVENCAL_RETURN_IF_ERROR(find_what_is_shared(plan, recordings));
  RAVENCAL_ASSIGN_OR_RETURN(const record::Recording* const first,
                            recordings.get(plan.conditions.front().train.front()));
  RAVENCAL_ASSIGN_OR_RETURN(plan.settings.features,
                            base_of(plan.settings.features, kBaseFeatures, first->channels));
  RAVENCAL_ASSIGN_OR_RETURN(
      plan.settings.homing_features,
      base_of(plan.settings.homing_features, kHomingFeatures, first->channels));
  Planner planner(plan, first->channels);
  for (std::size_t c = 0; c < plan.conditions.size(); ++c) {
    if (plan.conditions[c].homing) {
      if (includes(plan, "homing")) planner.add_homing(c, plan.settings.homing_features);
      continue;
    }
    if (plan.study == "homing") continue;
    const bool paper = plan.study == kPaperStudy;
    planner.add(c, kNoAblation, plan.settings.features, paper ? TestSet::kPaper : TestSet::kFull);
    if (!includes(plan, "removal")) continue;
    for (const FeatureSet& set : paper ? paper_sets() : ablated_sets()) {
      planner.add_without(c, plan.settings.features, set);
    }
  }
  return plan;
}

}  // namespace ravencal::study
