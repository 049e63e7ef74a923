// SPDX-License-Identifier: Apache-2.0
//
// The plan of a study: every network that it trains, each a job of its own that any process on any
// machine may run. DIR/plan.json holds it; study/job_store.hpp keeps the results.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "learn/shared_seeds.hpp"
#include "learn/train.hpp"
#include "record/load.hpp"
#include "study/ablation_rows.hpp"
#include "study/recording_store.hpp"

namespace ravencal::study {

inline constexpr std::uint32_t kMostSeeds = 1000;  ///< networks per row

/// How networks are trained. Defaults: the paper's.
struct Settings {
  std::string features;         ///< of removal, inaccurate and torque; empty: base_features()
  std::string homing_features;  ///< of homing; empty: those and encoder values, offsets, void
  std::vector<std::uint32_t> hidden = {600, 500, 400};
  std::uint32_t epochs = 600;
  std::uint32_t batch = 1024;
  std::uint32_t seeds = 5;
  std::uint64_t first_seed = 3;  ///< then every 10 on, as the authors'
  NoiseFrom noise_from = NoiseFrom::kTest;
  learn::Isa isa = learn::best_isa();
};

/// Recordings of one study condition, e.g. one load.
struct Condition {
  std::string title;               ///< e.g. "unloaded"
  std::vector<std::string> train;  ///< paths
  std::vector<std::string> test;   ///< a homing condition's: after 0, 1, 2, ... homings
  bool homing = false;
  bool rehomed = false;  ///< trained on recordings of several homings
  /// Twin seeds of tests that the training saw; tables and findings say so.
  learn::SharedSeeds shared = {};
};

struct Input {
  std::string path;
  std::string sha256;
  std::uint64_t rows = 0;
};

/// One network: trained on its condition's training recordings, tested on its test recordings.
struct Job {
  std::size_t condition = 0;  ///< index
  std::string row;            ///< kNoAblation, an ablated set, or a homing row
  std::string features;       ///< --features text
  std::uint64_t seed = 0;
  TestSet tests = TestSet::kPlain;
  std::uint32_t width = 0;  ///< number of features
  std::string key;          ///< key_of() its description
};

inline constexpr std::string_view kPaperStudy = "paper";

struct Plan {
  std::string
      study;  ///< removal, inaccurate, torque, homing, paper (the paper's rows of these) or all
  Settings settings;
  record::LoadOptions load;
  std::vector<Condition> conditions;
  std::vector<Input> inputs;  ///< every recording once
  std::vector<Job> jobs;
  std::vector<std::string> left_out;  ///< sentences: rows whose features the recordings lack
};

/// What Plan::study may be.
inline constexpr std::string_view kStudies[] = {"removal", "inaccurate", "torque",
                                                "homing",  kPaperStudy,  "all"};

/// Hashes and reads the inputs and lists the jobs.
/// Errors: kUsage for an unknown study or features that select nothing; kData for a test that is
/// trained on; kIo and kData of recordings.
core::Result<Plan> make_plan(std::string study, Settings settings, record::LoadOptions load,
                             std::vector<Condition> conditions, RecordingStore& recordings);

/// Everything that the job's result depends on, as one line of text: what the key is the hash of.
std::string description_of(const Plan& plan, const Job& job);

/// Training options of a job, on `threads` threads.
learn::TrainOptions train_options(const Plan& plan, const Job& job, unsigned threads);

/// Rows that the job trains on.
std::uint64_t training_rows(const Plan& plan, const Job& job);

/// Whether the plan's study is this one, or one that contains it.
bool includes(const Plan& plan, std::string_view study);

/// The file that holds a plan.
std::filesystem::path plan_path(const std::filesystem::path& folder);

/// Writes DIR/plan.json whole. Errors: kIo.
core::Status write_plan(const Plan& plan, const std::filesystem::path& folder);
/// Errors: kIo, or kData that names what is wrong with the file.
core::Result<Plan> read_plan(const std::filesystem::path& folder);

/// Inputs of the job whose bytes are no longer those of the plan. Errors: kIo.
core::Result<std::vector<std::string>> changed_inputs(const Plan& plan, const Job& job);

/// What the paper trained on, where the recordings have it: its 112 features without encoder values
/// and offsets, which break after homing; every channel elsewhere.
inline constexpr std::string_view kBaseFeatures =
    "paper112,-group:encoder_value,-group:encoder_offset";
inline constexpr std::string_view kHomingFeatures = "paper112,mpos.void";

}  // namespace ravencal::study
