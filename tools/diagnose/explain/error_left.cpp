// SPDX-License-Identifier: Apache-2.0
//
// What the improved plant leaves of each channel, against what the recordings leave of themselves:
// the alarm for physics that no word of the vocabulary says.
#include "diagnose/explain/parts.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <utility>

#include "core/median.hpp"
#include "core/students_t.hpp"
#include "diagnose/explain/circumstances.hpp"
#include "diagnose/explain/repetition.hpp"
#include "diagnose/findings/policy.hpp"
#include "diagnose/track/filter.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Where the noise is slow, passes are cut shorter: into twice the fewest of them...
constexpr double kPassesPerView = 2.0 * static_cast<double>(kFewestPasses);
/// ...as long as they span so many of its correlations, since neighbours are not compared.
constexpr double kCorrelationsApart = 2.0;

/// Of a joint's own circumstances, those of waves, bumps and friction: position and velocity.
constexpr std::size_t kWhereAndHowFast = 2;

/// Mean square, over that of the floor, of an error in which nothing without a name is as large as
/// the gates ask for.
constexpr double kMostPerFloor2 = 1.0 + kUnnamedPerFloor * kUnnamedPerFloor;

/// The channel without rows that the noise model doubts: around reversals presliding decides, which
/// no plant states to the last micrometre.
Channel undoubted(const Channel& channel) {
  Channel out = channel;
  for (std::size_t r = 0; r < out.used.size(); ++r)
    std::erase_if(out.used[r], [&](Index i) {
      return channel.rows[r].doubt[static_cast<std::size_t>(i)] > 0.0;
    });
  return out;
}

/// Each recording has an encoder constant of its own: as an error of the plant it is a homing
/// offset, and so has a name.
ByRecording without_constants(const Channel& channel, ByRecording residuals) {
  if (channel.kind == ChannelKind::kPosition) take_constants(channel, residuals);
  return residuals;
}

/// One channel of a view, by its undoubted rows.
class Judge {
 public:
  Judge(const View& view, std::size_t c)
      : view_(view),
        channel_(undoubted(view.rows.channels()[c])),
        joint_(view.given.joints[channel_.joint]),
        left_(used_rows(channel_, without_constants(channel_, view.beside_recorder[c]))),
        predicted_(predicted(view.beside_recorder[c])) {
    out_.joint = joint_.name;
    out_.stage = stage_of(channel_);
    out_.unit = unit_of(channel_, view.given);
    out_.before = rms(channel_, without_constants(channel_, view.before[c]));
    out_.left = std::sqrt(left_.squaredNorm() / std::max(1.0, static_cast<double>(left_.size())));
    out_.measured_by = "none";
    const double recorded = rms(channel_, channel_.measured);
    if (recorded > 0.0) out_.of_signal = std::pow(out_.left / recorded, 2);
  }

  [[nodiscard]] bool any_rows() const { return left_.size() > 0; }

  ErrorLeft judge() {
    if (!by_repetition()) by_resolution();
    return out_;
  }

 private:
  /// Effort, or what the cable adds to the position that the controller believes; about its mean.
  [[nodiscard]] VectorXd predicted(const ByRecording& after) const {
    ByRecording values = after;
    for (std::size_t r = 0; r < values.size(); ++r) {
      if (channel_.measured[r].size() == 0) continue;
      values[r] = channel_.measured[r] - after[r];
      if (channel_.kind == ChannelKind::kPosition)
        values[r] -= tent(view_.rows.predictor(r).believed()[channel_.joint],
                          view_.rows.tracks()[r].tent_rows);
    }
    const VectorXd rows = used_rows(channel_, values);
    return rows.size() > 0 ? VectorXd(rows.array() - rows.mean()) : rows;
  }

  /// RMS by which simulations of other forms differ from the plant's, and friction from itself.
  [[nodiscard]] double form() const {
    double square =
        kModelForm * kModelForm * predicted_.squaredNorm() / static_cast<double>(predicted_.size());
    const double stiffness = joint_.parameter("compliance", "stiffness");
    const bool position = channel_.kind == ChannelKind::kPosition;
    for (const char* friction : {"coulomb_friction", "joint_friction"}) {
      if (position && (friction == std::string("coulomb_friction") || !(stiffness > 0.0))) continue;
      const double effort = kKnownVariation * joint_.parameter(friction, "variation") *
                            joint_.parameter(friction, "level");
      square += std::pow(position ? effort / stiffness : effort, 2);
    }
    return std::sqrt(square);
  }

  /// [quantities x rows], each about its mean and over its deviation.
  [[nodiscard]] MatrixXd scaled(std::span<const Circumstance* const> circumstances) const {
    MatrixXd out(static_cast<Index>(circumstances.size()), left_.size());
    for (Index k = 0; k < out.rows(); ++k) {
      VectorXd values = used_rows(channel_, circumstances[static_cast<std::size_t>(k)]->value);
      values.array() -= values.mean();
      const double deviation = std::sqrt(values.squaredNorm() / static_cast<double>(values.size()));
      out.row(k) = (deviation > 0.0 ? VectorXd(values / deviation) : values).transpose();
    }
    return out;
  }

  [[nodiscard]] double rows_per_pass() const {
    const Track& track = view_.rows.tracks().front();
    const double step_s = static_cast<double>(track.tent_rows) * track.period_s;
    const double keep = std::exp(-step_s / channel_.noise.time_s);
    // Sum of the noise's correlations with the rows that follow.
    const double resembling = 1.0 + keep / ((1.0 - keep) * (1.0 + channel_.noise.white_ratio));
    return std::min(kCorrelationsPerPass * resembling,
                    std::max(kCorrelationsApart * resembling,
                             static_cast<double>(left_.size()) / kPassesPerView));
  }

  /// Of each row: passes end with an episode and where they are long enough.
  [[nodiscard]] std::vector<int> passes() const {
    const double most = rows_per_pass();
    std::vector<int> out;
    int pass = -1;
    for (std::size_t r = 0; r < channel_.used.size(); ++r) {
      const std::vector<char>& fresh = channel_.rows[r].fresh;
      Index former = -1;
      double length = most;
      for (const Index i : channel_.used[r]) {
        const bool starts = std::any_of(fresh.begin() + former + 1, fresh.begin() + i + 1,
                                        [](char begins) { return begins != 0; });
        if (starts || length >= most) {
          ++pass;
          length = 0.0;
        }
        length += 1.0;
        former = i;
        out.push_back(pass);
      }
    }
    return out;
  }

  bool by_repetition() {
    const Circumstances around = circumstances_of(channel_, view_.rows, view_.improved);
    std::vector<const Circumstance*> compared;
    for (const auto* list : {&around.own, &around.others})
      for (const Circumstance& c : *list) compared.push_back(&c);
    std::optional<Repetition> best;
    // Each circumstance that does not matter takes neighbours away, each that does and is left out
    // adds to what differs: neither is below the noise.
    for (const std::size_t count : {kWhereAndHowFast, around.own.size(), compared.size()}) {
      const auto found = repetition_of({scaled(std::span(compared).first(count)), left_, passes()},
                                       kMostPerFloor2);
      if (!found || found->passes < kFewestPasses || found->agreement < kLeastAgreement) continue;
      if (!best || found->differs < best->differs) best = found;
    }
    if (!best) return false;
    const double quantile = core::students_t_975(static_cast<double>(best->passes) - 1.0);
    const double allowed2 =
        kMostPerFloor2 * best->differs + form() * form() + quantile * best->excess_deviation;
    out_.measured_by = "repetition";
    out_.floor = std::sqrt(best->differs);
    out_.compared_rows = best->rows;
    out_.agreement = best->agreement;
    out_.allowed = std::sqrt(allowed2);
    out_.reached = best->left <= allowed2;
    return true;
  }

  /// What one count of the sensor is worth, where the plant says so.
  [[nodiscard]] double count() const {
    if (channel_.kind == ChannelKind::kPosition) return joint_.joint_encoder_resolution_ji;
    const double per_n_m = std::abs(joint_.drive.dac_counts_per_n_m);
    return per_n_m > 0.0 ? joint_.reduction / joint_.gearbox_ratio / per_n_m : 0.0;
  }

  /// Deviation of what the sensor adds to each value: neighbours against the middle of the two
  /// beside it (Gasser, Sroka, Jennen-Steinmetz, Biometrika 1986), by the median, which stick and
  /// slip leave alone; and no less than rounding.
  [[nodiscard]] double resolution() const {
    std::vector<double> scatter;
    for (std::size_t r = 0; r < view_.rows.tracks().size(); ++r) {
      if (channel_.used[r].empty()) continue;
      const Track& track = view_.rows.tracks()[r];
      const JointTrack& joint = track.joints[channel_.joint];
      const VectorXd signal = channel_.kind == ChannelKind::kPosition
                                  ? VectorXd(joint.truth - track.forced.motors[channel_.joint].q)
                                  : joint.effort;
      for (Index i = 1; i + 1 < signal.size(); ++i) {
        const double off = signal[i] - 0.5 * (signal[i - 1] + signal[i + 1]);
        if (std::isfinite(off)) scatter.push_back(off / std::sqrt(1.5));
      }
    }
    return std::max(core::normal_deviation(std::move(scatter)), count() / std::sqrt(12.0));
  }

  /// Share of noise that differs from row to row which the filter lets through: root of the sum of
  /// its squared weights.
  [[nodiscard]] double noise_gain() const {
    const auto n = static_cast<double>(view_.rows.tracks().front().tent_rows);
    return std::sqrt((2.0 * n * n + 1.0) / (3.0 * n * n * n));
  }

  /// RMS of what was recorded, about its mean: the effort, or the joint's position.
  [[nodiscard]] double signal() const {
    const VectorXd values = used_rows(channel_, channel_.measured);
    return std::sqrt((values.array() - values.mean()).square().mean());
  }

  /// A sensor wanders by more than it resolves, and without repetition nobody knows by how much:
  /// the alarm waits until most of what was recorded is left.
  void by_resolution() {
    out_.floor = resolution() * noise_gain();
    if (!(out_.floor > 0.0)) return;
    out_.measured_by = "resolution";
    out_.allowed = std::max(std::hypot(std::sqrt(kMostPerFloor2) * out_.floor, form()),
                            std::sqrt(kMostOfSignal) * signal());
    out_.reached = out_.left <= out_.allowed;
  }

  const View& view_;
  Channel channel_;
  const physics::Joint& joint_;
  VectorXd left_, predicted_;  ///< at its rows
  ErrorLeft out_;
};

}  // namespace

void add_error_left(const View& view, Report& report) {
  for (std::size_t c = 0; c < view.rows.channels().size(); ++c) {
    if (view.rows.channels()[c].kind == ChannelKind::kLaw) continue;
    Judge judge(view, c);
    if (judge.any_rows()) report.left.push_back(judge.judge());
  }
}

}  // namespace ravencal::diagnose
