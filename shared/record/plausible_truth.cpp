// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <Eigen/Core>
#include <cmath>
#include <limits>
#include <optional>

#include "record/plausible_parts.hpp"
#include "record/relation.hpp"

namespace ravencal::record {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// A gain of truth over estimate outside of these is no cable: the largest stretch in public
/// recordings of cable-driven tools leaves 0.85.
constexpr double kLeastGain = 0.5, kLargestGain = 2.0;
/// The gains of the twin's own joints lie within it: 1.06 to 1.09.
constexpr double kOrdinaryGain = 0.1;
/// An error that goes with the position to so large a share is a scale; cables leave at most 0.8.
constexpr double kShareOfScale = 0.9;
/// The truth of a joint that moves like another one's estimate correlates with it at least so far,
/// and leaves so small a share of what its own estimate leaves unexplained; the other's own truth
/// leaves a larger one there.
constexpr double kFollows = 0.7, kShareLeft = 0.2;
/// The distance between two hard stops is at least the motion between them; a quarter is room for
/// what the recording leaves out of it.
constexpr double kOffsetOfTravel = 0.75;
/// Increments over this time are the motion, at delays up to some of them.
constexpr std::int64_t kIncrementNs = 100'000'000, kLongestIncrementNs = 200'000'000;
constexpr Index kLagStep = 5, kLags = 8;  // of thinned rows: 0.4 s at 100 Hz

/// One joint at the thinned rows.
struct Pair {
  std::string joint;
  Channel truth_channel;
  VectorXd truth, estimate;
  VectorXd truth_increments, estimate_increments;

  /// A joint that its robot holds is moved by its cables' stretch and by its neighbours' coupling.
  [[nodiscard]] bool moves() const { return travel_of(estimate) >= least_travel(truth_channel); }
};

std::vector<std::optional<Index>> rows_ahead(const Recording& recording,
                                             const std::vector<Index>& rows) {
  const auto t_ns = [&](std::size_t i) {
    return recording.t_ns[static_cast<std::size_t>(rows[i])];
  };
  std::vector<std::optional<Index>> ahead(rows.size());
  std::size_t to = 0;
  for (std::size_t from = 0; from < rows.size(); ++from) {
    while (to < rows.size() && t_ns(to) - t_ns(from) < kIncrementNs) ++to;
    if (to < rows.size() && t_ns(to) - t_ns(from) <= kLongestIncrementNs)
      ahead[from] = static_cast<Index>(to);
  }
  return ahead;
}

VectorXd increments_of(const VectorXd& values, const std::vector<std::optional<Index>>& ahead) {
  VectorXd increments(values.size());
  for (Index row = 0; row < values.size(); ++row) {
    const auto to = ahead[static_cast<std::size_t>(row)];
    increments[row] = to ? values[*to] - values[row] : std::numeric_limits<double>::quiet_NaN();
  }
  return increments;
}

std::vector<Pair> pairs_of(const Recording& recording) {
  const std::vector<Index> rows = thinned_rows(recording);
  const auto ahead = rows_ahead(recording, rows);
  std::vector<Pair> pairs;
  for (const std::string& joint : recording.calibratable_joints()) {
    const Index truth = *recording.column(Role::kJointTruth, joint);
    const Index estimate = *recording.column(Role::kJointEstimate, joint);
    Pair pair{joint,
              recording.channels[static_cast<std::size_t>(truth)],
              values_at(recording, truth, rows),
              values_at(recording, estimate, rows),
              {},
              {}};
    pair.truth_increments = increments_of(pair.truth, ahead);
    pair.estimate_increments = increments_of(pair.estimate, ahead);
    pairs.push_back(std::move(pair));
  }
  return pairs;
}

double correlation(const VectorXd& x, const VectorXd& y) {
  const auto line = line_through(x, y);
  return line ? std::abs(line->correlation) : 0.0;
}

/// How far a joint's truth follows its own estimate, however late one of the two is.
double own_correlation(const Pair& pair) {
  const Index rows = pair.truth.size();
  double most = 0.0;
  for (Index lag = 0; lag <= std::min(kLags * kLagStep, rows / 2); lag += kLagStep) {
    const Index kept = rows - lag;
    most = std::max(
        {most, correlation(pair.estimate_increments.head(kept), pair.truth_increments.tail(kept)),
         correlation(pair.estimate_increments.tail(kept), pair.truth_increments.head(kept))});
  }
  return most;
}

/// The joint whose estimate this truth follows instead of its own, and whose own truth does not: a
/// joint that another one drags along moves like that one too.
const Pair* followed(const Pair& pair, const std::vector<Pair>& pairs) {
  const double own = own_correlation(pair);
  double least_left = std::min(1.0 - kFollows * kFollows, kShareLeft * (1.0 - own * own));
  const Pair* best = nullptr;
  for (const Pair& other : pairs) {
    const double r = correlation(other.estimate_increments, pair.truth_increments);
    if (&other == &pair || 1.0 - r * r > least_left) continue;
    const double of_other = own_correlation(other);
    if (1.0 - of_other * of_other < kShareLeft) continue;
    least_left = 1.0 - r * r;
    best = &other;
  }
  return best;
}

class TruthDoubts {
 public:
  TruthDoubts(const Recording& recording, const std::vector<Pair>& pairs)
      : recording_(recording), pairs_(pairs) {}

  std::vector<Implausibility> all() && {
    for (const Pair& pair : pairs_) {
      if (!pair.moves()) continue;
      if (const Pair* other = followed(pair, pairs_)) {
        say_exchanged(pair, *other);
        continue;
      }
      const auto line = line_through(pair.estimate, pair.truth);
      if (!line) continue;
      if (line->correlation < -kSameMotion) {
        add("sign", pair, line->correlation, true,
            fmt::format("{}: truth and estimate move in opposite directions (correlation {:.2f}); "
                        "turn the sign of the one that counts the wrong way",
                        pair.joint, line->correlation));
        continue;
      }
      say_gain(pair, *line);
      say_offset(pair);
      if (std::max(line->correlation, own_correlation(pair)) < kSameMotion)
        say_unrelated(pair, *line);
    }
    return std::move(doubts_);
  }

 private:
  void add(std::string kind, const Pair& pair, double figure, bool is_error, std::string sentence) {
    doubts_.push_back({std::move(kind), pair.truth_channel.name, figure, recording_.t_ns.front(),
                       is_error, std::move(sentence)});
  }

  void say_exchanged(const Pair& pair, const Pair& other) {
    add("exchanged", pair, correlation(other.estimate_increments, pair.truth_increments), true,
        fmt::format("{}: its truth moves like {} (correlation {:.2f}), and not like {} ({:.2f}); "
                    "are plugs or columns exchanged?",
                    pair.joint, other.joint,
                    correlation(other.estimate_increments, pair.truth_increments), pair.joint,
                    own_correlation(pair)));
  }

  /// The gain lies between the line of truth over estimate and that of estimate over truth.
  void say_gain(const Pair& pair, const Line& line) {
    const double least = line.slope;
    const double largest = line.slope / (line.correlation * line.correlation);
    if (line.correlation < kSameMotion) return;
    const bool is_error = largest < kLeastGain || least > kLargestGain;
    const auto of_error = line_through(pair.estimate, pair.truth - pair.estimate);
    const double share = of_error ? of_error->correlation * of_error->correlation : 0.0;
    const bool is_scale =
        share >= kShareOfScale && (largest < 1.0 - kOrdinaryGain || least > 1.0 + kOrdinaryGain);
    if (!is_error && !is_scale) return;
    add("gain", pair, std::sqrt(least * largest), is_error,
        fmt::format(
            "{}: the truth moves {:.3f} times as far as the estimate ({:.0f} % of the error "
            "goes with the position); compare counts per turn (x4 decoding), unit and "
            "gear ratio",
            pair.joint, std::sqrt(least * largest), 100.0 * share));
  }

  void say_offset(const Pair& pair) {
    const double travel = travel_of(pair.estimate);
    double sum = 0.0, count = 0.0;
    for (Index row = 0; row < pair.truth.size(); ++row) {
      const double error = pair.truth[row] - pair.estimate[row];
      if (!std::isfinite(error)) continue;
      sum += error;
      count += 1.0;
    }
    if (!(count > 0.0)) return;
    const double offset = sum / count;
    if (std::abs(offset) < kOffsetOfTravel * travel) return;
    add("offset", pair, offset, false,
        fmt::format("{}: the truth lies {} beside the estimate, which moves {}; compare the hard "
                    "stop and its position in the encoders' file with the homing",
                    pair.joint, amount_of(offset, pair.truth_channel),
                    amount_of(travel, pair.truth_channel)));
  }

  void say_unrelated(const Pair& pair, const Line& line) {
    add("unrelated", pair, line.correlation, false,
        fmt::format("{}: truth and estimate do not show the same motion (correlation {:.2f}); do "
                    "they belong together, and do their clocks?",
                    pair.joint, line.correlation));
  }

  const Recording& recording_;
  const std::vector<Pair>& pairs_;
  std::vector<Implausibility> doubts_;
};

}  // namespace

std::vector<Implausibility> doubts_of_truth(const Recording& recording) {
  if (recording.rows() < kFewestRows) return {};
  const std::vector<Pair> pairs = pairs_of(recording);
  return TruthDoubts(recording, pairs).all();
}

}  // namespace ravencal::record
