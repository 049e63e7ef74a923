// SPDX-License-Identifier: Apache-2.0
#include "study/pool.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <time.h>

#include <chrono>
#include <exception>
#include <new>

#include "core/random.hpp"
#include "core/run_tasks.hpp"
#include "learn/trainer.hpp"

namespace ravencal::study {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// Runs the job; what a library throws is the job's error, and the other jobs' results are kept.
core::Result<std::optional<JobResult>> run_guarded(const Plan& plan, const Job& job,
                                                   RecordingStore& recordings, unsigned threads,
                                                   const JobProgress& progress) {
  try {
    return run_job(plan, job, recordings, threads, progress);
  } catch (const std::bad_alloc&) {
    return core::data_error(
        fmt::format("job '{}', seed {}: there is not enough memory for it", job.row, job.seed));
  } catch (const std::exception& thrown) {
    return core::data_error(
        fmt::format("job '{}', seed {}: failed: {}", job.row, job.seed, thrown.what()));
  }
}

/// Trains, tests and writes; false if stopped.
core::Result<bool> run_and_write(const Plan& plan, const Job& job,
                                 const std::filesystem::path& folder, RecordingStore& recordings,
                                 unsigned threads, const JobProgress& progress) {
  RAVENCAL_ASSIGN_OR_RETURN(const std::optional<JobResult> result,
                            run_guarded(plan, job, recordings, threads, progress));
  if (!result) return false;
  RAVENCAL_RETURN_IF_ERROR(write_result(plan, job, *result, folder));
  return true;
}

/// Processor time of this thread: the time of training without the machine's other work.
double thread_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// Seconds per floating-point operation of one thread's training.
double seconds_per_flop(const Plan& plan, std::uint32_t width) {
  const std::ptrdiff_t outputs = 3;
  const learn::Shape shape(width, plan.settings.hidden, outputs, model::Activation::kSigmoid);
  learn::TrainerSettings settings;
  settings.batch = plan.settings.batch;
  settings.threads = 1;
  settings.isa = plan.settings.isa;
  learn::Samples<float> samples;
  constexpr std::ptrdiff_t kBatches = 4;
  const auto rows = kBatches * static_cast<std::ptrdiff_t>(settings.batch);
  samples.inputs.resize(width, rows);
  samples.targets.setZero(outputs, rows);
  core::Random random(1);
  for (Eigen::Index i = 0; i < samples.inputs.size(); ++i) {
    samples.inputs.data()[i] = static_cast<float>(random.uniform());
  }
  learn::Trainer<float> trainer(shape, settings, learn::initial_parameters(shape, 1));
  trainer.run_epoch(samples);  // warm
  const double start = thread_seconds();
  trainer.run_epoch(samples);
  return (thread_seconds() - start) /
         (shape.training_flops_per_sample() * static_cast<double>(rows));
}

}  // namespace

core::Result<std::vector<std::size_t>> missing_jobs(const Plan& plan,
                                                    const std::filesystem::path& folder) {
  std::vector<std::size_t> missing;
  for (std::size_t i = 0; i < plan.jobs.size(); ++i) {
    RAVENCAL_ASSIGN_OR_RETURN(const auto result, read_result(plan, plan.jobs[i], folder));
    if (!result) missing.push_back(i);
  }
  return missing;
}

core::Status run_one(const Plan& plan, std::size_t job, const std::filesystem::path& folder,
                     RecordingStore& recordings, unsigned threads, const JobProgress& progress) {
  if (job >= plan.jobs.size()) {
    return core::Error{core::ErrorCode::kUsage, fmt::format("--job {}: the plan's jobs are 0 to {}",
                                                            job, plan.jobs.size() - 1)};
  }
  RAVENCAL_ASSIGN_OR_RETURN(const auto changed, changed_inputs(plan, plan.jobs[job]));
  if (!changed.empty()) {
    return core::Error{core::ErrorCode::kData,
                       fmt::format("{}: changed since the plan was made; make it again with "
                                   "--plan, what does not depend on it is kept",
                                   fmt::join(changed, ", "))};
  }
  RAVENCAL_ASSIGN_OR_RETURN(const auto there, read_result(plan, plan.jobs[job], folder));
  if (there) return {};
  RAVENCAL_ASSIGN_OR_RETURN(
      const bool done, run_and_write(plan, plan.jobs[job], folder, recordings, threads, progress));
  if (done) return {};
  return core::Error{core::ErrorCode::kIo, fmt::format("job {}: stopped; it left no result", job)};
}

core::Result<PoolSummary> run_all(const Plan& plan, const std::filesystem::path& folder,
                                  RecordingStore& recordings, const PoolOptions& options,
                                  const PoolProgress& progress) {
  RAVENCAL_ASSIGN_OR_RETURN(const std::vector<std::size_t> missing, missing_jobs(plan, folder));
  const Clock::time_point start = Clock::now();
  RAVENCAL_ASSIGN_OR_RETURN(
      const core::TasksDone done,
      core::run_tasks(
          missing.size(), options.workers,
          [&](std::size_t i, const JobProgress& report) {
            return run_and_write(plan, plan.jobs[missing[i]], folder, recordings, options.threads,
                                 report);
          },
          [&](double share, std::size_t finished, std::size_t i) {
            return progress(share, fmt::format("{} of {} networks, {}", finished, missing.size(),
                                               plan.jobs[missing[i]].row));
          }));
  return PoolSummary{done.finished, plan.jobs.size() - missing.size(), done.interrupted,
                     seconds_since(start)};
}

double estimated_seconds(const Plan& plan, const std::vector<std::size_t>& jobs) {
  if (jobs.empty()) return 0.0;
  const double speed = seconds_per_flop(plan, plan.jobs[jobs.front()].width);
  double seconds = 0.0;
  for (const std::size_t index : jobs) {
    const Job& job = plan.jobs[index];
    const learn::Shape shape(job.width, plan.settings.hidden, 3, model::Activation::kSigmoid);
    seconds += speed * shape.training_flops_per_sample() *
               static_cast<double>(training_rows(plan, job)) * plan.settings.epochs;
  }
  return seconds;
}

}  // namespace ravencal::study
