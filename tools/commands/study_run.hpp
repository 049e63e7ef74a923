// SPDX-License-Identifier: Apache-2.0
//
// What `ablate` and `study` share: a study is planned, run in part or in whole, and collected.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cli/files.hpp"
#include "core/result.hpp"
#include "core/temporary_folder.hpp"
#include "record/load.hpp"
#include "study/plan.hpp"
#include "study/pool.hpp"

namespace ravencal::commands {

/// Recordings in the place of some that are not made yet: a study is listed by them, not planned.
struct StandIns {
  core::TemporaryFolder folder;
  std::uint64_t rows = 0;  ///< of each recording that they stand for
  std::string sentence;    ///< what is to be made, and how
};

/// What the commands of studies take.
struct StudyArguments {
  std::string study;  ///< Plan::study
  std::vector<std::string> train, test, train_loaded, test_loaded, train_rehomed;
  std::vector<std::string> test_homing;  ///< after 0, 1, 2, ... homings
  std::string out;
  study::Settings settings;
  record::LoadOptions load;
  study::PoolOptions pool;
  std::optional<std::size_t> job;
  bool plan = false;
  bool collect = false;
  bool partial = false;
  bool check = false;
  bool json = false;
  bool same_seed = false;
  bool print_tables = false;  ///< and not only the findings
  /// Makes the recordings that no option named; nothing: they must be named.
  std::function<core::Status(StudyArguments&)> make_recordings;
  std::shared_ptr<const StandIns> stand_ins;
};

/// --train, --test and so on, --same-seed and how recordings are read.
void add_study_data_options(CLI::App& command, StudyArguments& arguments);
/// Features, network, seeds.
void add_study_network_options(CLI::App& command, StudyArguments& arguments);
/// --plan, --job, --collect and what belongs to them.
void add_study_run_options(CLI::App& command, StudyArguments& arguments);
/// Those of add_study_data_options() that name files to read.
inline const std::vector<std::string> kStudyInputs = {
    "--train",       "--test",          "--train-loaded", "--test-loaded",
    "--test-homing", "--train-rehomed", "--profile"};

/// True for a folder in which a study or a comparison has finished a job.
bool has_results(const std::filesystem::path& folder);
/// --out, where a study was planned or run before.
cli::Paths folder_of_study(const CLI::App& command);
/// What lies in --out at the end, beside the results.
cli::Paths files_of_study(const CLI::App& command);

/// Plans, runs and collects, as the arguments ask.
core::Status run_study(StudyArguments arguments, int& exit_code);

}  // namespace ravencal::commands
