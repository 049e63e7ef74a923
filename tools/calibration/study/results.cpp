// SPDX-License-Identifier: Apache-2.0
#include "study/results.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <set>
#include <utility>

#include "study/job_store.hpp"

namespace ravencal::study {
namespace {

/// The same draws for every row of a condition: differences between rows are paired.
constexpr std::uint64_t kBootstrapSeed = 1;
/// Stands for all recordings together in keys.
constexpr std::size_t kAllRecordings = std::numeric_limits<std::size_t>::max();

SeedErrors chosen(const SeedErrors& errors, std::optional<std::size_t> recording) {
  if (!recording) return errors;
  SeedErrors result;
  for (const std::vector<ErrorBlocks>& recordings : errors) {
    result.push_back({recordings[*recording]});
  }
  return result;
}

double mean_of(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

std::vector<std::string> ids_of(const JobResult& result) {
  std::vector<std::string> ids;
  for (const RowErrors& row : result.rows) ids.push_back(row.id);
  return ids;
}

/// Whether two results have the same joints, and blocks of the same times.
bool are_alike(const JobResult& one, const JobResult& other) {
  const auto same = [](const JointName& a, const JointName& b) {
    return a.name == b.name && a.unit == b.unit;
  };
  return std::equal(one.joints.begin(), one.joints.end(), other.joints.begin(), other.joints.end(),
                    same) &&
         shape_of(one.rows.front()) == shape_of(other.rows.front());
}

}  // namespace

void ConditionResults::add(const RowId& row, const RowErrors& errors) {
  std::vector<SeedErrors>& joints = rows_[row];
  joints.resize(joints_.size());
  for (std::size_t joint = 0; joint < joints_.size(); ++joint) {
    joints[joint].push_back(errors.joints[joint]);
  }
}

Figure ConditionResults::figure_of(const Sampled& sampled) {
  Figure figure;
  figure.mean = mean_of(sampled.seeds);
  double squares = 0.0;
  for (const double value : sampled.seeds) squares += (value - figure.mean) * (value - figure.mean);
  const auto seeds = static_cast<double>(sampled.seeds.size());
  figure.deviation = std::sqrt(squares / (seeds - 1.0));
  figure.interval = central_interval(sampled.resamples);
  return figure;
}

ConditionResults::Sampled ConditionResults::combine(const Sampled& a, const Sampled& b,
                                                    double (*operation)(double, double)) {
  Sampled result = a;
  for (std::size_t i = 0; i < a.seeds.size(); ++i) {
    result.seeds[i] = operation(a.seeds[i], b.seeds[i]);
  }
  for (std::size_t i = 0; i < a.resamples.size(); ++i) {
    result.resamples[i] = operation(a.resamples[i], b.resamples[i]);
  }
  return result;
}

const Resamples& ConditionResults::resamples(std::optional<std::size_t> recording) const {
  const std::size_t key = recording.value_or(kAllRecordings);
  if (const auto found = resamples_.find(key); found != resamples_.end()) return found->second;
  // The correlation time comes from the network without an ablation.
  auto row = rows_.find(RowId{});
  if (row == rows_.end()) row = rows_.find(RowId{std::string(kAllFeatures)});
  if (row == rows_.end()) row = rows_.begin();
  std::vector<SeedErrors> joints;
  for (const SeedErrors& errors : row->second) joints.push_back(chosen(errors, recording));
  return resamples_.emplace(key, resamples_for(joints, kBootstrapSeed)).first->second;
}

const ConditionResults::Sampled& ConditionResults::sampled(const Tested& row,
                                                           std::size_t joint) const {
  const auto key = std::make_tuple(row.row, joint, row.recording.value_or(kAllRecordings));
  if (const auto found = sampled_.find(key); found != sampled_.end()) return found->second;
  const SeedErrors errors = chosen(rows_.at(row.row)[joint], row.recording);
  Sampled result;
  for (const std::vector<ErrorBlocks>& recordings : errors) {
    result.seeds.push_back(pooled_rmse(recordings));
  }
  result.resamples = resamples(row.recording).rmse(errors);
  return sampled_.emplace(key, std::move(result)).first->second;
}

ConditionResults::Sampled ConditionResults::mean_ratio(const Tested& row, const Tested& reference,
                                                       JointRange joints) const {
  const auto divide = [](double a, double b) { return a / b; };
  const auto add = [](double a, double b) { return a + b; };
  Sampled sum = combine(sampled(row, joints.first), sampled(reference, joints.first), divide);
  for (std::size_t joint = joints.first + 1; joint < joints.end; ++joint) {
    sum = combine(sum, combine(sampled(row, joint), sampled(reference, joint), divide), add);
  }
  const auto count = static_cast<double>(joints.end - joints.first);
  for (auto* values : {&sum.seeds, &sum.resamples}) {
    for (double& value : *values) value /= count;
  }
  return sum;
}

Figure ConditionResults::rmse(const Tested& row, std::size_t joint) const {
  return figure_of(sampled(row, joint));
}

Figure ConditionResults::peak(const Tested& row, std::size_t joint) const {
  Sampled peaks;
  for (const std::vector<ErrorBlocks>& recordings :
       chosen(rows_.at(row.row)[joint], row.recording)) {
    double peak = 0.0;
    for (const ErrorBlocks& blocks : recordings) peak = std::max(peak, blocks.peak);
    peaks.seeds.push_back(peak);
  }
  return figure_of(peaks);
}

Figure ConditionResults::ratio(const Tested& row, const Tested& reference,
                               JointRange joints) const {
  return figure_of(mean_ratio(row, reference, joints));
}

Figure ConditionResults::ratio_difference(const Tested& row, const Tested& other,
                                          const Tested& reference, JointRange joints) const {
  const auto subtract = [](double a, double b) { return a - b; };
  return figure_of(
      combine(mean_ratio(row, reference, joints), mean_ratio(other, reference, joints), subtract));
}

const ErrorBlocks& ConditionResults::first_seed(const RowId& row, std::size_t joint,
                                                std::size_t recording) const {
  return rows_.at(row)[joint].front()[recording];
}

core::Result<Results> read_results(const Plan& plan, const std::filesystem::path& folder) {
  Results results;
  std::vector<std::optional<JobResult>> found;
  std::set<std::pair<std::size_t, std::string>> incomplete;
  for (std::size_t i = 0; i < plan.jobs.size(); ++i) {
    RAVENCAL_ASSIGN_OR_RETURN(auto result, read_result(plan, plan.jobs[i], folder));
    if (!result) {
      results.missing.push_back(i);
      incomplete.emplace(plan.jobs[i].condition, plan.jobs[i].row);
    }
    found.push_back(std::move(result));
  }
  for (std::size_t c = 0; c < plan.conditions.size(); ++c) {
    std::optional<ConditionResults> condition;
    const JobResult* first = nullptr;
    std::map<std::string, JobResult*> first_of_row;
    for (std::size_t i = 0; i < plan.jobs.size(); ++i) {
      const Job& job = plan.jobs[i];
      if (job.condition != c || incomplete.contains({c, job.row})) continue;
      if (!condition) {
        condition.emplace(plan.conditions[c], found[i]->joints);
        first = &*found[i];
      }
      JobResult*& of_row = first_of_row.try_emplace(job.row, &*found[i]).first->second;
      if (!are_alike(*first, *found[i]) || ids_of(*of_row) != ids_of(*found[i])) {
        return core::data_error(fmt::format(
            "{}: its joints, blocks or rows are not those of the other results of '{}'; remove it "
            "and run job {} again",
            result_path(folder, key_of(description_of(plan, job))).string(),
            plan.conditions[c].title, i));
      }
      for (const RowErrors& row : found[i]->rows) condition->add({job.row, row.id}, row);
      if (condition->maps.empty()) {
        condition->grid = found[i]->grid;
        condition->maps = found[i]->maps;
      }
    }
    if (condition) results.conditions.push_back(std::move(*condition));
  }
  return results;
}

}  // namespace ravencal::study
