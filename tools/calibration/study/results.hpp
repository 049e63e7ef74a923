// SPDX-License-Identifier: Apache-2.0
//
// All results of a study's plan, by condition, network and test, with what tables and findings need
// of them: means over seeds, deviations, intervals and differences between paired rows.
// One thread (figures are computed once and kept).
#pragma once

#include <compare>
#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "core/result.hpp"
#include "study/bootstrap.hpp"
#include "study/job.hpp"
#include "study/plan.hpp"

namespace ravencal::study {

/// One row of errors: a network (Job::row) and how it was tested (RowErrors::id).
struct RowId {
  std::string network = std::string(kNoAblation);
  std::string test = std::string(kNoAblation);
  friend auto operator<=>(const RowId&, const RowId&) = default;
};

/// A figure over seeds.
struct Figure {
  double mean = 0.0;
  double deviation = 0.0;  ///< sample standard deviation over seeds; NaN with one seed
  Interval interval;       ///< 95 %, of the mean; NaN for a peak
};

/// A row in one of its tests (by place in Condition::test), or in all of them together.
struct Tested {
  RowId row;
  std::optional<std::size_t> recording;
};

/// Joints [first, end) of a condition.
struct JointRange {
  std::size_t first = 0;
  std::size_t end = 0;
};

/// Results of one condition: all its rows saw the same test recordings.
class ConditionResults {
 public:
  ConditionResults(const Condition& condition, std::vector<JointName> joints)
      : condition_(&condition), joints_(std::move(joints)) {}

  [[nodiscard]] const Condition& condition() const { return *condition_; }
  [[nodiscard]] const std::vector<JointName>& joints() const { return joints_; }
  [[nodiscard]] bool has(const RowId& row) const { return rows_.contains(row); }

  /// Adds one seed's errors; every row gets as many seeds.
  void add(const RowId& row, const RowErrors& errors);

  /// RMSE of a joint, SI units.
  [[nodiscard]] Figure rmse(const Tested& row, std::size_t joint) const;
  /// Largest magnitude of a joint's error, SI units. It is one sample: it has no interval.
  [[nodiscard]] Figure peak(const Tested& row, std::size_t joint) const;
  [[nodiscard]] JointRange all_joints() const { return {0, joints_.size()}; }
  /// RMSE of `row` over that of `reference`, mean of these joints; paired.
  [[nodiscard]] Figure ratio(const Tested& row, const Tested& reference, JointRange joints) const;
  /// ratio(row) - ratio(other), paired.
  [[nodiscard]] Figure ratio_difference(const Tested& row, const Tested& other,
                                        const Tested& reference, JointRange joints) const;

  /// Of the first seed.
  [[nodiscard]] const ErrorBlocks& first_seed(const RowId& row, std::size_t joint,
                                              std::size_t recording) const;

  std::optional<report::MapGrid> grid;
  std::vector<RowMap> maps;  ///< of the unablated network's first seed

 private:
  /// The same figure for every seed and for every resample.
  struct Sampled {
    std::vector<double> seeds;
    std::vector<double> resamples;
  };
  static Figure figure_of(const Sampled& sampled);
  static Sampled combine(const Sampled& a, const Sampled& b, double (*operation)(double, double));

  [[nodiscard]] const Resamples& resamples(std::optional<std::size_t> recording) const;
  [[nodiscard]] const Sampled& sampled(const Tested& row, std::size_t joint) const;
  [[nodiscard]] Sampled mean_ratio(const Tested& row, const Tested& reference,
                                   JointRange joints) const;

  const Condition* condition_;
  std::vector<JointName> joints_;
  std::map<RowId, std::vector<SeedErrors>> rows_;       ///< [joint]
  mutable std::map<std::size_t, Resamples> resamples_;  ///< by recording
  mutable std::map<std::tuple<RowId, std::size_t, std::size_t>, Sampled> sampled_;
};

/// What there is of a plan's results. A row that lacks a seed is left out, and so is a condition
/// without rows.
struct Results {
  std::vector<ConditionResults> conditions;
  std::vector<std::size_t> missing;  ///< jobs without result
};

/// `plan` must outlive the results. Errors: kData for damaged results.
core::Result<Results> read_results(const Plan& plan, const std::filesystem::path& folder);

}  // namespace ravencal::study
