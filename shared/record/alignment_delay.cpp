// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "record/alignment.hpp"
#include "record/moving_mean.hpp"

namespace ravencal::record {
namespace {

// Increments over this time are the velocity in the band of a joint's motion. Quantisation and
// noise dominate shorter ones; longer ones contain hysteresis, which looks like delay at steady
// speed.
constexpr std::int64_t kIncrementNs = 100'000'000;
constexpr std::int64_t kLongestGapNs = 50'000'000;
constexpr double kMeanHalfNs = 5e6;              // truth is averaged over 10 ms
constexpr std::size_t kMostIncrements = 20'000;  // enough for 0.02 ms; more costs time only
constexpr std::size_t kBlocks = 20;
constexpr double kCoarseStepS = 1e-3;
constexpr double kFineStepS = 1e-4;
constexpr int kFineSteps = 20;    // to either side of the coarse optimum
constexpr double kRelated = 0.5;  // least correlation of two views of one motion

/// One increment of the robot's joint between two of its rows.
struct Increment {
  std::int64_t from_ns;
  std::int64_t to_ns;
  double value;
};

/// Second moments of robot and truth increments.
struct Moments {
  double aa = 0.0, ab = 0.0, bb = 0.0;

  void add(double a, double b) {
    aa += a * a;
    ab += a * b;
    bb += b * b;
  }
  Moments& operator+=(const Moments& other) {
    aa += other.aa;
    ab += other.ab;
    bb += other.bb;
    return *this;
  }
  [[nodiscard]] double correlation() const {
    return aa > 0.0 && bb > 0.0 ? ab / std::sqrt(aa * bb) : 0.0;
  }
  /// Minus twice the log likelihood, up to a constant, with gain and noise at their best, as if
  /// `count` increments had been there at every delay: else the delay that leaves fewest of them
  /// outside of the recording would win.
  [[nodiscard]] double misfit(std::size_t count) const {
    const double r = correlation();
    return static_cast<double>(count) * std::log1p(-std::min(r * r, 1.0 - 1e-12));
  }
};

std::vector<Increment> increments_of(std::span<const std::int64_t> t_ns,
                                     const Eigen::Ref<const Eigen::VectorXd>& x) {
  std::vector<Increment> all;
  std::size_t to = 0;
  for (std::size_t from = 0; from < t_ns.size(); ++from) {
    while (to < t_ns.size() && t_ns[to] - t_ns[from] < kIncrementNs) ++to;
    if (to == t_ns.size()) break;
    const double value = x[static_cast<Eigen::Index>(to)] - x[static_cast<Eigen::Index>(from)];
    if (std::isfinite(value) && t_ns[to] - t_ns[from] <= kIncrementNs + kLongestGapNs)
      all.push_back({t_ns[from], t_ns[to], value});
  }
  if (all.size() <= kMostIncrements) return all;
  std::vector<Increment> some;
  some.reserve(kMostIncrements);
  for (std::size_t i = 0; i < kMostIncrements; ++i)
    some.push_back(all[i * all.size() / kMostIncrements]);
  return some;
}

class DelaySearch {
 public:
  DelaySearch(const Track& robot, const Track& truth) {
    for (const auto& position : robot.position)
      increments_.push_back(increments_of(robot.t_ns, position));
    for (const auto& position : truth.position) {
      const std::span<const double> values(position.data(),
                                           static_cast<std::size_t>(position.size()));
      truth_.emplace_back(truth.t_ns, values, kMeanHalfNs, kLongestGapNs);
    }
  }

  /// Moments of one joint's block `block` of kBlocks at a delay; all blocks: kBlocks.
  Moments moments(std::size_t joint, double delay_s, std::size_t block) const {
    const auto& list = increments_[joint];
    const std::size_t first = block == kBlocks ? 0 : block * list.size() / kBlocks;
    const std::size_t last = block == kBlocks ? list.size() : (block + 1) * list.size() / kBlocks;
    Moments sum;
    for (std::size_t i = first; i < last; ++i) {
      const double b = truth_[joint].at(list[i].to_ns, 1e9 * delay_s) -
                       truth_[joint].at(list[i].from_ns, 1e9 * delay_s);
      if (std::isfinite(b)) sum.add(list[i].value, b);
    }
    return sum;
  }

  [[nodiscard]] std::size_t joints() const { return increments_.size(); }
  [[nodiscard]] std::size_t increments(std::size_t joint) const {
    return increments_[joint].size();
  }

  double misfit(double delay_s) const {
    double sum = 0.0;
    for (std::size_t joint = 0; joint < joints(); ++joint)
      sum += moments(joint, delay_s, kBlocks).misfit(increments(joint));
    return sum;
  }

 private:
  std::vector<std::vector<Increment>> increments_;
  std::vector<MovingMean> truth_;
};

/// Minimum of a sampled curve, by the parabola through the lowest sample and its neighbours, in
/// units of the sampling step.
double lowest_point(std::span<const double> curve) {
  const auto lowest = std::min_element(curve.begin(), curve.end());
  const auto i = lowest - curve.begin();
  if (i == 0 || i + 1 == static_cast<std::ptrdiff_t>(curve.size())) return static_cast<double>(i);
  const double left = *(lowest - 1);
  const double right = *(lowest + 1);
  const double curvature = left - 2.0 * *lowest + right;
  return static_cast<double>(i) + (curvature > 0.0 ? 0.5 * (left - right) / curvature : 0.0);
}

/// Sums by block on a fine grid of delays, so that leaving a block out is a subtraction.
class FineGrid {
 public:
  FineGrid(const DelaySearch& search, double centre_s)
      : joints_(search.joints()), centre_s_(centre_s), sums_(kGrid * joints_ * kBlocks) {
    for (std::size_t joint = 0; joint < joints_; ++joint)
      counts_.push_back(search.increments(joint));
    for (std::size_t grid = 0; grid < kGrid; ++grid) {
      const double delay_s = delay_at(static_cast<double>(grid));
      for (std::size_t joint = 0; joint < joints_; ++joint) {
        for (std::size_t block = 0; block < kBlocks; ++block)
          sums_[at(grid, joint, block)] = search.moments(joint, delay_s, block);
      }
    }
  }

  /// The delay that fits best without that block; kBlocks leaves out none.
  [[nodiscard]] double delay_without(std::size_t left_out) const {
    std::vector<double> curve(kGrid, 0.0);
    for (std::size_t grid = 0; grid < kGrid; ++grid) {
      for (std::size_t joint = 0; joint < joints_; ++joint) {
        Moments sum;
        for (std::size_t block = 0; block < kBlocks; ++block) {
          if (block != left_out) sum += sums_[at(grid, joint, block)];
        }
        curve[grid] += sum.misfit(counts_[joint]);
      }
    }
    return delay_at(lowest_point(curve));
  }

 private:
  static constexpr std::size_t kGrid = 2 * kFineSteps + 1;

  [[nodiscard]] double delay_at(double grid) const {
    return centre_s_ + (grid - kFineSteps) * kFineStepS;
  }
  [[nodiscard]] std::size_t at(std::size_t grid, std::size_t joint, std::size_t block) const {
    return (grid * joints_ + joint) * kBlocks + block;
  }

  std::size_t joints_;
  double centre_s_;
  std::vector<std::size_t> counts_;  // increments of each joint
  std::vector<Moments> sums_;
};

core::Error cannot(std::string why) {
  return {core::ErrorCode::kData, "the delay cannot be estimated: " + std::move(why)};
}

core::Status check_relation(const DelaySearch& search, double delay_s,
                            std::span<const std::string> joints, double& best_correlation) {
  best_correlation = 0.0;
  for (std::size_t joint = 0; joint < search.joints(); ++joint) {
    const double r = search.moments(joint, delay_s, kBlocks).correlation();
    if (r < -kRelated) {
      return cannot(fmt::format(
          "robot and truth of joint '{}' move in opposite directions (correlation {:.2f}); "
          "check 'sign' in the encoders' configuration",
          joints[joint], r));
    }
    best_correlation = std::max(best_correlation, r);
  }
  if (best_correlation >= kRelated) return {};
  return cannot(fmt::format(
      "robot and truth do not show the same motion (best correlation of velocities {:.2f}); "
      "do the recordings belong together, and do the joints move?",
      best_correlation));
}

}  // namespace

core::Result<DelayEstimate> estimate_delay(const Track& robot, const Track& truth,
                                           std::span<const std::string> joints,
                                           const DelayOptions& options) {
  const DelaySearch search(robot, truth);
  std::vector<double> coarse;
  const int steps = static_cast<int>(std::ceil(options.largest_s / kCoarseStepS));
  for (int i = -steps; i <= steps; ++i) coarse.push_back(search.misfit(i * kCoarseStepS));
  const auto lowest =
      static_cast<int>(std::min_element(coarse.begin(), coarse.end()) - coarse.begin());
  const double centre_s = (lowest - steps) * kCoarseStepS;
  DelayEstimate estimate;
  RAVENCAL_RETURN_IF_ERROR(check_relation(search, centre_s, joints, estimate.correlation));
  if (lowest == 0 || lowest == 2 * steps) {
    return cannot(fmt::format(
        "the best fit lies at the edge of the search, {:.0f} ms; search further", 1e3 * centre_s));
  }

  const FineGrid grid(search, centre_s);
  estimate.delay_s = grid.delay_without(kBlocks);
  // Jackknife: blocks are long against the correlation time of the residuals.
  std::vector<double> without;
  for (std::size_t block = 0; block < kBlocks; ++block)
    without.push_back(grid.delay_without(block));
  const double mean = std::accumulate(without.begin(), without.end(), 0.0) / kBlocks;
  double squares = 0.0;
  for (const double value : without) squares += (value - mean) * (value - mean);
  estimate.sigma_s = std::sqrt(squares * (kBlocks - 1.0) / kBlocks);
  return estimate;
}

}  // namespace ravencal::record
