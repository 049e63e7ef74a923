// SPDX-License-Identifier: Apache-2.0
//
// Runs the jobs of a plan on this machine: several networks at the same time, one thread each, or
// one network on several threads. Finished jobs are skipped; a job that is stopped leaves nothing.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "study/job.hpp"
#include "study/plan.hpp"

namespace ravencal::study {

struct PoolOptions {
  unsigned workers = 0;  ///< networks at the same time; 0: one per core
  unsigned threads = 1;  ///< per network
};

/// Told the share of all missing jobs that is done and a word about it; false stops at once.
using PoolProgress = std::function<bool(double, const std::string&)>;

/// Indices of the jobs whose results are not there. Errors: kData for a damaged result.
core::Result<std::vector<std::size_t>> missing_jobs(const Plan& plan,
                                                    const std::filesystem::path& folder);

/// Runs one job and writes its result, unless it is there. Errors: kUsage for a number that the
/// plan does not have, kData if an input is no longer what was planned.
core::Status run_one(const Plan& plan, std::size_t job, const std::filesystem::path& folder,
                     RecordingStore& recordings, unsigned threads, const JobProgress& progress);

struct PoolSummary {
  std::size_t ran = 0;
  std::size_t there_already = 0;
  bool interrupted = false;
  double wall_s = 0.0;
};

/// Runs all that is missing. The first error stops the rest.
core::Result<PoolSummary> run_all(const Plan& plan, const std::filesystem::path& folder,
                                  RecordingStore& recordings, const PoolOptions& options,
                                  const PoolProgress& progress);

/// Seconds of one core that these jobs' training takes, from a few batches of made-up samples of
/// the first one's shape, measured now. Testing comes on top.
double estimated_seconds(const Plan& plan, const std::vector<std::size_t>& jobs);

}  // namespace ravencal::study
