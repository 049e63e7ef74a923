// SPDX-License-Identifier: Apache-2.0
#include "study/pool.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <time.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <mutex>
#include <thread>

#include "core/random.hpp"
#include "core/side_by_side.hpp"
#include "learn/trainer.hpp"

namespace ravencal::study {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// Trains, tests and writes; false if stopped.
core::Result<bool> run_and_write(const Plan& plan, const Job& job,
                                 const std::filesystem::path& folder, RecordingStore& recordings,
                                 unsigned threads, const JobProgress& progress) {
  RAVENCAL_ASSIGN_OR_RETURN(const std::optional<JobResult> result,
                            run_job(plan, job, recordings, threads, progress));
  if (!result) return false;
  const std::filesystem::path path = result_path(folder, job);
  std::error_code error;
  std::filesystem::create_directories(path.parent_path(), error);
  RAVENCAL_RETURN_IF_ERROR(write_result(*result, path));
  return true;
}

/// Hands out the missing jobs to the workers and keeps what they share.
class Pool {
 public:
  Pool(const Plan& plan, std::vector<std::size_t> jobs, const PoolProgress& progress)
      : plan_(plan), jobs_(std::move(jobs)), shares_(jobs_.size()), progress_(progress) {}

  void work(const std::filesystem::path& folder, RecordingStore& recordings, unsigned threads) {
    for (std::size_t next = next_++; next < jobs_.size() && !stop_; next = next_++) {
      const Job& job = plan_.jobs[jobs_[next]];
      const auto done = run_and_write(plan_, job, folder, recordings, threads,
                                      [&](double share) { return report(next, share, job); });
      if (!done.ok()) fail(done.error());
      if (done.ok() && *done) ++finished_;
    }
  }

  [[nodiscard]] const std::optional<core::Error>& error() const { return error_; }
  [[nodiscard]] std::size_t finished() const { return finished_; }

 private:
  bool report(std::size_t index, double share, const Job& job) {
    shares_[index] = share;
    double sum = 0.0;
    for (const std::atomic<double>& own : shares_) sum += own;
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!stop_ &&
        !progress_(sum / static_cast<double>(shares_.size()),
                   fmt::format("{} of {} networks, {}", finished_.load(), jobs_.size(), job.row))) {
      stop_ = true;
    }
    return !stop_;
  }

  void fail(const core::Error& error) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!error_) error_ = error;
    stop_ = true;
  }

  const Plan& plan_;
  std::vector<std::size_t> jobs_;
  std::vector<std::atomic<double>> shares_;  ///< done of each job
  const PoolProgress& progress_;
  std::atomic<std::size_t> next_{0};
  std::atomic<std::size_t> finished_{0};
  std::atomic<bool> stop_{false};
  std::mutex mutex_;  ///< of progress_ and error_
  std::optional<core::Error> error_;
};

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
  RAVENCAL_ASSIGN_OR_RETURN(std::vector<std::size_t> missing, missing_jobs(plan, folder));
  PoolSummary summary;
  summary.there_already = plan.jobs.size() - missing.size();
  const std::size_t wanted =
      options.workers > 0 ? options.workers : std::max(1U, std::thread::hardware_concurrency());
  const std::size_t workers = std::min(wanted, missing.size());
  const Clock::time_point start = Clock::now();
  Pool pool(plan, missing, progress);
  core::side_by_side(workers, [&] { pool.work(folder, recordings, options.threads); });
  if (pool.error()) return *pool.error();
  summary.ran = pool.finished();
  summary.interrupted = summary.ran < missing.size();
  summary.wall_s = seconds_since(start);
  return summary;
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
