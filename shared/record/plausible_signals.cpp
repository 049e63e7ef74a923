// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <vector>

#include "core/median.hpp"
#include "record/plausible_parts.hpp"
#include "record/relation.hpp"

namespace ravencal::record {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double kTurn_rad = 2.0 * std::numbers::pi;
/// A step is a turn but for the motion between two rows, where no step lies between such a motion
/// and a turn less as much.
constexpr double kMotionOfTurn = 0.2;
/// A joint has mass: a step so much larger than both of its neighbours and than 99 of 100 steps is
/// none of its own.
constexpr double kJumpOfSteps = 6.0;
constexpr double kOrdinaryStepShare = 0.99;
/// No jump is told across a longer gap.
constexpr std::int64_t kLongestStepNs = 50'000'000;
/// Values that stay the same to the last bit for so long are frozen, if the joint moves meanwhile.
constexpr std::int64_t kLeastFrozenNs = 500'000'000;
/// A velocity over its position's derivative, either way.
constexpr double kLargestVelocityGain = 2.0;
/// Of an effort's variance. A controller that damps a joint which others move has friction of the
/// wrong sign too, and no inertia.
constexpr double kLeastByInertia = 0.001;
/// Rows without a time of their own, of all.
constexpr double kEqualShare = 0.01;
/// Rows of a robot: 0.1 Hz to 100 kHz.
constexpr std::int64_t kLeastPeriodNs = 10'000, kLongestPeriodNs = 10'000'000'000;

bool is_measured_position(const Channel& channel) {
  return channel.role == Role::kJointTruth || channel.role == Role::kJointEstimate ||
         channel.role == Role::kMotorPosition;
}

const Channel& channel_of(const Recording& recording, Index column) {
  return recording.channels[static_cast<std::size_t>(column)];
}

std::int64_t time_of(const Recording& recording, Index row) {
  return recording.t_ns[static_cast<std::size_t>(row)];
}

struct Jumps {
  std::size_t count = 0;
  Index first_row = 0;

  void add(Index row) {
    if (count++ == 0) first_row = row;
  }
};

/// Steps of a position from row to row; NaN across gaps.
VectorXd steps_of(const Recording& recording, Index column) {
  VectorXd steps(recording.rows());
  steps[0] = std::numeric_limits<double>::quiet_NaN();
  for (Index row = 1; row < recording.rows(); ++row) {
    const bool is_near = time_of(recording, row) - time_of(recording, row - 1) <= kLongestStepNs;
    steps[row] = is_near ? recording.samples(row, column) - recording.samples(row - 1, column)
                         : std::numeric_limits<double>::quiet_NaN();
  }
  return steps;
}

/// Steps of a turn of a position that wraps; none where steps of every size occur.
Jumps turns_of(const VectorXd& steps) {
  Jumps turns;
  for (Index row = 1; row < steps.size(); ++row) {
    const double turn = std::abs(steps[row]) / kTurn_rad;
    if (std::abs(turn - 1.0) < kMotionOfTurn)
      turns.add(row);
    else if (turn > kMotionOfTurn)
      return {};
  }
  return turns;
}

/// Steps that no mass makes.
Jumps jumps_of(const VectorXd& steps, double least_travel) {
  std::vector<double> sizes;
  for (const double step : steps)
    if (std::isfinite(step)) sizes.push_back(std::abs(step));
  const double least =
      std::max(least_travel, kJumpOfSteps * core::upper_quantile(sizes, kOrdinaryStepShare));
  Jumps jumps;
  for (Index row = 2; row + 1 < steps.size(); ++row) {
    const double beside = std::max(std::abs(steps[row - 1]), std::abs(steps[row + 1]));
    if (std::abs(steps[row]) >= std::max(least, kJumpOfSteps * beside)) jumps.add(row);
  }
  return jumps;
}

std::optional<Implausibility> jump(const Recording& recording, Index column) {
  const Channel& channel = channel_of(recording, column);
  const VectorXd steps = steps_of(recording, column);
  Jumps jumps = channel.unit == "rad" ? turns_of(steps) : Jumps();
  const bool are_turns = jumps.count > 0;
  if (!are_turns) jumps = jumps_of(steps, least_travel(channel));
  if (jumps.count == 0) return std::nullopt;
  const std::int64_t t_ns = time_of(recording, jumps.first_row);
  return Implausibility{
      are_turns ? "turn" : "jump",
      channel.name,
      steps[jumps.first_row],
      t_ns,
      false,
      fmt::format("{} steps by {} from one row to the next at {}{}: {}", channel.name,
                  amount_of(steps[jumps.first_row], channel), moment_of(recording, t_ns),
                  jumps.count == 1 ? "" : fmt::format(" and {} times more", jumps.count - 1),
                  are_turns ? "it wraps; `wraps_at` in the profile unwraps it"
                            : "a counter wraps or loses counts; `wraps_at` in the profile says "
                              "where it wraps")};
}

/// The stretch of unchanged values in which `other` travels farthest.
struct Frozen {
  Index from = 0, to = 0;
  double travel = 0.0;
};

Frozen longest_frozen(const Recording& recording, Index column, Index other) {
  Frozen worst;
  for (Index from = 0; from < recording.rows();) {
    Index to = from;
    double least = recording.samples(from, other), most = least;
    while (to < recording.rows() &&
           recording.samples(to, column) == recording.samples(from, column)) {
      least = std::fmin(least, recording.samples(to, other));
      most = std::fmax(most, recording.samples(to, other));
      ++to;
    }
    const bool is_long =
        to > from && time_of(recording, to - 1) - time_of(recording, from) >= kLeastFrozenNs;
    if (is_long && most - least > worst.travel) worst = {from, to, most - least};
    from = std::max(to, from + 1);
  }
  return worst;
}

/// What the joint does by another of its positions.
std::optional<Index> other_position(const Recording& recording, const Channel& channel) {
  for (const Role role : {Role::kJointEstimate, Role::kJointTruth, Role::kMotorPosition}) {
    const auto column = recording.column(role, channel.joint);
    if (role != channel.role && column) return column;
  }
  return std::nullopt;
}

std::optional<Implausibility> frozen(const Recording& recording, Index column) {
  const Channel& channel = channel_of(recording, column);
  const auto other = other_position(recording, channel);
  if (!other) return std::nullopt;
  // A joint that nobody commands has an estimate at rest, and others may drag it.
  if (channel.role != Role::kJointTruth &&
      travel_of(recording.samples.col(column)) < least_travel(channel))
    return std::nullopt;
  const Channel& moving = channel_of(recording, *other);
  const Frozen stretch = longest_frozen(recording, column, *other);
  if (stretch.travel < least_travel(moving)) return std::nullopt;
  const std::int64_t from_ns = time_of(recording, stretch.from);
  const double lasts_s = 1e-9 * static_cast<double>(time_of(recording, stretch.to - 1) - from_ns);
  return Implausibility{
      "frozen",
      channel.name,
      stretch.travel,
      from_ns,
      false,
      fmt::format("{} keeps one value from {} for {:.1f} s ({:.0f} % of the rows), while {} moves "
                  "{}; is its cable or its driver at rest? `--from-s` and `--to-s` leave it out",
                  channel.name, moment_of(recording, from_ns), lasts_s,
                  100.0 * static_cast<double>(stretch.to - stretch.from) /
                      static_cast<double>(recording.rows()),
                  moving.name, amount_of(stretch.travel, moving))};
}

struct Thinned {
  std::vector<Index> rows;
  VectorXd t_s;
};

std::optional<Implausibility> velocity(const Recording& recording, const Thinned& thinned,
                                       Index column) {
  const Channel& channel = channel_of(recording, column);
  const auto position = recording.column(Role::kMotorPosition, channel.joint);
  if (channel.role != Role::kMotorVelocity || !position) return std::nullopt;
  const VectorXd positions = values_at(recording, *position, thinned.rows);
  const auto line =
      derivative_line(thinned.t_s, positions, values_at(recording, column, thinned.rows));
  if (!line || std::abs(line->correlation) < kDerivativeCorrelation) return std::nullopt;
  const double gain = 1.0 / line->slope;
  if (gain > 1.0 / kLargestVelocityGain && gain < kLargestVelocityGain) return std::nullopt;
  return Implausibility{
      "velocity",
      channel.name,
      gain,
      recording.t_ns.front(),
      false,
      fmt::format("{} is {:.3g} times the derivative of {}; compare their units, signs and sides "
                  "of the gear, and the time's unit",
                  channel.name, gain, channel_of(recording, *position).name)};
}

std::optional<Implausibility> effort(const Recording& recording, const Thinned& thinned,
                                     Index column) {
  const Channel& channel = channel_of(recording, column);
  if (channel.role != Role::kDriveTorque) return std::nullopt;
  const auto motor = recording.column(Role::kMotorPosition, channel.joint);
  const auto estimate = recording.column(Role::kJointEstimate, channel.joint);
  if (!motor && !estimate) return std::nullopt;
  const Index position = motor ? *motor : *estimate;
  VectorXd positions = values_at(recording, position, thinned.rows);
  // An effort has its motor's sign, and a weight goes with the joint's angle.
  if (motor && estimate) {
    const auto gear = line_through(positions, values_at(recording, *estimate, thinned.rows));
    if (gear) positions *= std::abs(gear->slope);
  }
  const auto fit =
      effort_of_motion(thinned.t_s, positions, values_at(recording, column, thinned.rows));
  if (!fit || !fit->reversed || fit->share < kLeastExplained || fit->by_inertia < kLeastByInertia)
    return std::nullopt;
  return Implausibility{
      "effort",
      channel.name,
      fit->share,
      recording.t_ns.front(),
      false,
      fmt::format(
          "{} drives its joint backwards: friction and inertia in it have the wrong sign "
          "against {} ({:.0f} % of it goes with the motion); `negate = true` in the profile "
          "turns it",
          channel.name, channel_of(recording, position).name, 100.0 * fit->share)};
}

std::vector<std::int64_t> periods_ns(const Recording& recording) {
  std::vector<std::int64_t> periods;
  for (std::size_t i = 1; i < recording.t_ns.size(); ++i)
    periods.push_back(recording.t_ns[i] - recording.t_ns[i - 1]);
  return periods;
}

}  // namespace

std::vector<Implausibility> doubts_of_signals(const Recording& recording) {
  std::vector<Implausibility> doubts;
  if (recording.rows() < kFewestRows) return doubts;
  Thinned thinned{thinned_rows(recording), {}};
  thinned.t_s.resize(static_cast<Index>(thinned.rows.size()));
  for (Index i = 0; i < thinned.t_s.size(); ++i) {
    thinned.t_s[i] =
        1e-9 * static_cast<double>(time_of(recording, thinned.rows[static_cast<std::size_t>(i)]) -
                                   recording.t_ns.front());
  }
  const auto keep = [&](std::optional<Implausibility> doubt) {
    if (doubt) doubts.push_back(*std::move(doubt));
  };
  for (Index column = 0; column < recording.samples.cols(); ++column) {
    const Channel& channel = channel_of(recording, column);
    if (channel.joint.empty()) continue;
    if (is_measured_position(channel)) {
      keep(jump(recording, column));
      keep(frozen(recording, column));
    }
    keep(velocity(recording, thinned, column));
    keep(effort(recording, thinned, column));
  }
  return doubts;
}

std::vector<Implausibility> doubts_of_stamps(const Recording& recording) {
  std::vector<Implausibility> doubts;
  const std::vector<std::int64_t> periods = periods_ns(recording);
  if (static_cast<Index>(periods.size()) < kFewestRows) return doubts;
  const auto add = [&](std::string kind, double figure, std::string sentence) {
    doubts.push_back(
        {std::move(kind), "", figure, recording.t_ns.front(), false, std::move(sentence)});
  };
  const auto count = static_cast<double>(periods.size());
  const auto equal = static_cast<double>(std::count(periods.begin(), periods.end(), 0));
  if (equal > kEqualShare * count) {
    add("stamps", equal / count,
        fmt::format("time: {:.0f} % of the rows have the stamp of the row before; "
                    "`time_rounded_to` in the profile spreads rounded stamps",
                    100.0 * equal / count));
  }
  const std::int64_t period_ns = core::upper_median(periods);
  if (period_ns < kLeastPeriodNs || period_ns > kLongestPeriodNs) {
    add("rate", 1e-9 * static_cast<double>(period_ns),
        fmt::format("time: rows are {:.3g} s apart; is `time_unit` in the profile right?",
                    1e-9 * static_cast<double>(period_ns)));
  }
  return doubts;
}

}  // namespace ravencal::record
