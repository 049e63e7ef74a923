// SPDX-License-Identifier: Apache-2.0
//
// One job of a study: train a network, test it in every way that its row asks for, keep the errors
// as blocks and maps. The result's bytes depend on the job's description only, not on where, when
// or beside what it ran.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "report/reduce.hpp"
#include "study/error_blocks.hpp"
#include "study/plan.hpp"
#include "study/recording_store.hpp"

namespace ravencal::study {

/// A row of errors: "raw" and "bias" (nothing trained), "none", or a spoilt variant.
struct RowErrors {
  std::string id;
  std::vector<std::vector<ErrorBlocks>> joints;  ///< [joint][test recording], SI units
};

/// Numbers of blocks, by joint and test recording: the same in every row of a condition.
std::vector<std::size_t> shape_of(const RowErrors& row);

inline constexpr std::string_view kRaw = "raw";
inline constexpr std::string_view kBias = "bias";

struct JointName {
  std::string name;
  std::string unit;  ///< SI
};

/// RMSE over the workspace of the first two joints, all test recordings together.
struct RowMap {
  std::string id;                                    ///< kRaw, kBias or kNoAblation
  std::vector<std::vector<report::MapCell>> joints;  ///< [joint][cell], SI units
};

struct JobResult {
  std::vector<JointName> joints;
  std::vector<RowErrors> rows;
  std::optional<report::MapGrid> grid;  ///< SI units; absent with one joint or no motion
  std::vector<RowMap> maps;
  double final_loss = 0.0;  ///< training loss of the kept epoch, scaled outputs
};

/// What a job calls between epochs: the share of the training done; false stops the job.
using JobProgress = std::function<bool(double)>;

/// Trains and tests; nothing (no result, no error) if `progress` stopped it.
core::Result<std::optional<JobResult>> run_job(const Plan& plan, const Job& job,
                                               RecordingStore& recordings, unsigned threads,
                                               const JobProgress& progress);

/// Keeps the job's result. Errors: kIo.
core::Status write_result(const Plan& plan, const Job& job, const JobResult& result,
                          const std::filesystem::path& folder);
/// The job's result if it is there. Errors: kIo, kData if it is damaged.
core::Result<std::optional<JobResult>> read_result(const Plan& plan, const Job& job,
                                                   const std::filesystem::path& folder);

}  // namespace ravencal::study
