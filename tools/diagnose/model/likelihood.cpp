// SPDX-License-Identifier: Apache-2.0
#include "diagnose/model/likelihood.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "diagnose/findings/policy.hpp"
#include "diagnose/track/filter.hpp"
#include "physics/predict/smoother.hpp"

namespace ravencal::diagnose {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

/// Blocks hold equally many used rows: as many as this time holds, were all of it used. So many
/// blocks at least and at most.
constexpr double kBlockS = 2.5;
constexpr double kFewestBlocks = 40.0;
constexpr double kMostBlocks = 120.0;
/// Rows whose squares are left out of a channel's floor.
constexpr double kLeftOutOfFloor = 0.02;
/// Times of the slowest noise: encoders wander with temperature, and what is slow in an effort is
/// friction, which turns with the motion. A constant effort is no noise.
constexpr double kSlowestEncoderNoise_s = 20.0;
constexpr double kSlowestEffortNoise_s = 1.5;
/// Of a signal, what no recording resolves: 20 bits. Of an effort, what the same equations give in
/// another integrator: a step of 2 ms, an effort recorded half a step beside its motion.
constexpr double kLeastNoise = 1e-6;
constexpr double kLeastEffortNoise = 1e-3;
/// The scale of the noise is at least this share of the innovations' RMS; a law is no physics.
constexpr double kLeastScale = 0.5;
constexpr double kLeastLawScale = 0.9;

const VectorXd& signal_of(const JointTrack& joint, ChannelKind kind) {
  return kind == ChannelKind::kPosition ? joint.truth : joint.effort;
}

/// The signal through the filter.
VectorXd filtered(const Track& track, const VectorXd& signal, std::vector<char>& used) {
  leave_out_lost(track, signal, used);
  return tent(physics::without_gaps(signal), track.tent_rows);
}

Index used_rows(const Channel& channel, std::size_t recording) {
  return static_cast<Index>(channel.used[recording].size());
}

double floor_of(const std::vector<NoiseRows>& rows, const ByRecording& residuals) {
  std::vector<double> squares;
  for (std::size_t r = 0; r < rows.size(); ++r)
    for (Index i = 0; i < residuals[r].size(); ++i)
      if (rows[r].used[static_cast<std::size_t>(i)] != 0)
        squares.push_back(residuals[r][i] * residuals[r][i]);
  std::sort(squares.begin(), squares.end());
  squares.resize(
      static_cast<std::size_t>(static_cast<double>(squares.size()) * (1.0 - kLeftOutOfFloor)));
  double sum = 0.0;
  for (const double square : squares) sum += square;
  return std::sqrt(sum / static_cast<double>(std::max<std::size_t>(1, squares.size()))) + 1e-15;
}

}  // namespace

Likelihood::Likelihood(const physics::Plant& plant, std::vector<Track> tracks,
                       const Likelihood* like)
    : plant_(plant), base_(initial_state(plant, tracks.size())), tracks_(std::move(tracks)) {
  for (const Track& track : tracks_)
    predictors_.emplace_back(plant_, track.forced, physics::Masses::kVary);
  move_links(base_);
  for (const physics::Predictor& predictor : predictors_)
    by_plant_.push_back(predictor.predict(plant_));
  for (std::size_t j = 0; j < plant_.joints.size(); ++j) settle_law(j);
  add_channels(like);
  for (Track& track : tracks_)
    for (JointTrack& joint : track.joints) joint.desired = physics::without_gaps(joint.desired);
  lay_out();
}

void Likelihood::add_channels(const Likelihood* like) {
  for (std::size_t j = 0; j < plant_.joints.size(); ++j) {
    const bool has_law =
        like != nullptr ? like->has(j, ChannelKind::kLaw) : law_made_the_commands(j);
    for (const ChannelKind kind :
         {ChannelKind::kDrive, ChannelKind::kPosition, ChannelKind::kLaw}) {
      Channel channel;
      channel.joint = j;
      channel.kind = kind;
      bool any = like != nullptr && like->has(j, kind);
      for (const Track& track : tracks_) {
        const JointTrack& joint = track.joints[j];
        const bool law = kind != ChannelKind::kLaw || (has_law && joint.desired.size() > 0);
        const bool recorded = law && signal_of(joint, kind).size() > 0;
        NoiseRows rows = rows_of(track, j, kind, plant_);
        VectorXd measured;
        if (recorded) measured = filtered(track, signal_of(joint, kind), rows.used);
        if (kind == ChannelKind::kLaw) leave_out_lost(track, joint.desired, rows.used);
        if (recorded && kind == ChannelKind::kPosition) {
          channel.tracking = joint.tracking;
          channel.followed = track.forced.followed[j].size() > 0;
        }
        if (!recorded) rows.used.assign(rows.used.size(), 0);
        any = any || recorded;
        channel.rows.push_back(std::move(rows));
        channel.measured.push_back(std::move(measured));
      }
      const bool wanted = like == nullptr || like->has(j, kind);
      if (any && wanted) channels_.push_back(std::move(channel));
    }
  }
}

const Channel* Likelihood::find(std::size_t joint, ChannelKind kind) const {
  const auto it = std::find_if(channels_.begin(), channels_.end(), [&](const Channel& channel) {
    return channel.joint == joint && channel.kind == kind;
  });
  return it == channels_.end() ? nullptr : &*it;
}

std::vector<std::vector<int>> Likelihood::blocks_of_rows() {
  double used_rows = 0.0, used_s = 0.0;
  std::vector<std::vector<char>> used;
  for (std::size_t r = 0; r < tracks_.size(); ++r) {
    used.emplace_back(static_cast<std::size_t>(tracks_[r].rows()), 0);
    for (const Channel& channel : channels_)
      for (std::size_t i = 0; i < used[r].size(); ++i) used[r][i] |= channel.rows[r].used[i];
    const auto count = static_cast<double>(std::count(used[r].begin(), used[r].end(), 1));
    used_rows += count;
    used_s += count * tracks_[r].period_s * static_cast<double>(tracks_[r].tent_rows);
  }
  const double in_block = std::max(
      1.0, used_rows / std::clamp(std::floor(used_s / kBlockS), kFewestBlocks, kMostBlocks));
  std::vector<std::vector<int>> blocks;
  for (const std::vector<char>& of_recording : used) {
    std::vector<int> block;
    double before = 0.0;
    for (const char is_used : of_recording) {
      block.push_back(block_count_ + static_cast<int>(before / in_block));
      before += is_used;
    }
    block_count_ += std::max(1, static_cast<int>(std::ceil(before / in_block)));
    blocks.push_back(std::move(block));
  }
  return blocks;
}

void Likelihood::lay_out() {
  const std::vector<std::vector<int>> blocks = blocks_of_rows();
  for (Channel& channel : channels_) {
    for (std::size_t r = 0; r < tracks_.size(); ++r) {
      channel.first.push_back(rows_);
      std::vector<Index> used;
      for (Index i = 0; i < tracks_[r].rows(); ++i) {
        if (channel.rows[r].used[static_cast<std::size_t>(i)] == 0) continue;
        used.push_back(i);
        blocks_.push_back(blocks[r][static_cast<std::size_t>(i)]);
      }
      rows_ += static_cast<Index>(used.size());
      channel.used.push_back(std::move(used));
      channel.whiteners.emplace_back(channel.rows[r], channel.noise);
    }
  }
}

VectorXd Likelihood::recorded(const Channel& channel, std::size_t recording) const {
  const Track& track = tracks_[recording];
  const JointTrack& joint = track.joints[channel.joint];
  const VectorXd& shift =
      channel.kind == ChannelKind::kPosition ? joint.truth_shift : joint.effort_shift;
  if (shift.size() == 0) return channel.measured[recording];
  return channel.measured[recording] + tent(physics::without_gaps(shift), track.tent_rows);
}

std::size_t Likelihood::add_shape(std::size_t channel, const ShapeFunction& function) {
  Shape shape{channel, {}};
  for (std::size_t r = 0; r < tracks_.size(); ++r)
    shape.column.push_back(tent(function(tracks_[r], by_plant_[r]), tracks_[r].tent_rows));
  shapes_.push_back(std::move(shape));
  return shapes_.size() - 1;
}

Outcome Likelihood::outcome(const State& state) const {
  Outcome out;
  for (std::size_t r = 0; r < tracks_.size(); ++r) {
    out.predictions.push_back(predictors_[r].predict(state.plant, state.circumstances[r]));
    std::vector<VectorXd> commands;
    for (std::size_t j = 0; j < plant_.joints.size(); ++j)
      commands.push_back(command_of(state, r, j));
    out.commands.push_back(std::move(commands));
  }
  return out;
}

const VectorXd& Likelihood::part_of(const Channel& channel, const State& state,
                                    const Outcome& outcome, std::size_t r,
                                    VectorXd& scratch) const {
  const std::size_t j = channel.joint;
  if (channel.kind == ChannelKind::kLaw) return outcome.commands[r][j];
  const physics::Prediction& prediction = outcome.predictions[r];
  if (channel.kind == ChannelKind::kPosition) return prediction.position[j];
  const double limit = state.plant.joints[j].parameter("saturation", "limit");
  if (limit <= 0.0 || outcome.commands[r][j].size() == 0) return prediction.effort[j];
  // What is recorded is what was asked of the drive; it delivers no more than its limit.
  const VectorXd& asked = outcome.commands[r][j];
  scratch = prediction.effort[j] +
            state.laws[j].saturated * (asked - asked.cwiseMax(-limit).cwiseMin(limit));
  return scratch;
}

std::vector<ByRecording> Likelihood::residuals(const State& state, const Outcome& outcome) const {
  std::vector<ByRecording> all;
  VectorXd scratch;
  for (std::size_t c = 0; c < channels_.size(); ++c) {
    ByRecording of_channel;
    for (std::size_t r = 0; r < tracks_.size(); ++r) {
      VectorXd residual = VectorXd::Zero(tracks_[r].rows());
      if (channels_[c].measured[r].size() > 0)
        residual = channels_[c].measured[r] -
                   tent(part_of(channels_[c], state, outcome, r, scratch), tracks_[r].tent_rows);
      for (const auto& [shape, coefficient] : state.shapes)
        if (shapes_[shape].channel == c) residual -= coefficient * shapes_[shape].column[r];
      of_channel.push_back(std::move(residual));
    }
    all.push_back(std::move(of_channel));
  }
  return all;
}

VectorXd Likelihood::whitened(const std::vector<ByRecording>& residuals) const {
  VectorXd out(rows_);
  for (std::size_t c = 0; c < channels_.size(); ++c)
    for (std::size_t r = 0; r < tracks_.size(); ++r)
      channels_[c].whiteners[r].apply(
          residuals[c][r], out.segment(channels_[c].first[r], used_rows(channels_[c], r)));
  return out;
}

void Likelihood::add_column(const State& state, const Outcome& at, const Parameter& parameter,
                            double step, Eigen::Ref<VectorXd> column) const {
  State changed = state;
  Parameter moved = parameter;
  moved.x += step;
  moved.apply(changed);
  column.setZero();
  for (std::size_t r = 0; r < tracks_.size(); ++r) {
    if (parameter.recording && *parameter.recording != r) continue;
    Outcome one;
    if (parameter.reaches != Reaches::kShape) {
      one.commands.assign(r + 1, at.commands[r]);
      one.predictions.resize(r + 1);
      one.predictions[r] = at.predictions[r];
    }
    if (parameter.reaches == Reaches::kLaw)
      one.commands[r][parameter.joint] = command_of(changed, r, parameter.joint);
    else if (parameter.reaches > Reaches::kShape)
      predictors_[r].update(changed.plant, changed.circumstances[r], parameter.joint,
                            reach_of(parameter.reaches), one.predictions[r]);
    for (std::size_t c = 0; c < channels_.size(); ++c) {
      const Channel& channel = channels_[c];
      const VectorXd difference = parameter.reaches == Reaches::kShape
                                      ? shape_difference(c, state, changed, r)
                                      : difference_of(channel, state, at, changed, one, r);
      if (difference.size() == 0 || difference.isZero(0.0)) continue;
      channel.whiteners[r].apply(difference / step,
                                 column.segment(channel.first[r], used_rows(channel, r)));
    }
  }
}

VectorXd Likelihood::shape_difference(std::size_t channel, const State& state, const State& changed,
                                      std::size_t r) const {
  for (const auto& [shape, coefficient] : changed.shapes) {
    const auto before = state.shapes.find(shape);
    const double added = coefficient - (before == state.shapes.end() ? 0.0 : before->second);
    if (shapes_[shape].channel == channel && added != 0.0) return added * shapes_[shape].column[r];
  }
  return {};
}

VectorXd Likelihood::difference_of(const Channel& channel, const State& state, const Outcome& at,
                                   const State& changed, const Outcome& one, std::size_t r) const {
  VectorXd scratch, other_scratch;
  const VectorXd difference =
      part_of(channel, changed, one, r, scratch) - part_of(channel, state, at, r, other_scratch);
  if (difference.size() == 0 || difference.isZero(0.0)) return {};
  return tent(difference, tracks_[r].tent_rows);
}

void Likelihood::measure_anew(const State& state, const Outcome& outcome,
                              const VectorXd& innovations) {
  const std::vector<ByRecording> left = residuals(state, outcome);
  for (std::size_t c = 0; c < channels_.size(); ++c) {
    Channel& channel = channels_[c];
    for (std::size_t r = 0; r < tracks_.size(); ++r) {
      if (channel.measured[r].size() == 0) continue;
      channel.measured[r] -= left[c][r];
      channel.measured[r] +=
          channel.whiteners[r].undo(innovations.segment(channel.first[r], used_rows(channel, r)));
    }
  }
}

void Likelihood::move_links(const State& state) {
  for (std::size_t r = 0; r < tracks_.size(); ++r)
    predictors_[r].move_links(predictors_[r].predict(state.plant, state.circumstances[r]).hanging);
}

void Likelihood::estimate_noise(const State& state) {
  const std::vector<ByRecording> left = residuals(state, outcome(state));
  for (std::size_t c = 0; c < channels_.size(); ++c) {
    Channel& channel = channels_[c];
    std::vector<const NoiseRows*> rows;
    std::vector<const VectorXd*> values;
    for (std::size_t r = 0; r < tracks_.size(); ++r) {
      rows.push_back(&channel.rows[r]);
      values.push_back(&left[c][r]);
    }
    const bool encoder = channel.kind == ChannelKind::kPosition && !channel.followed;
    channel.noise = diagnose::estimate_noise(
        rows, values, channel.kind == ChannelKind::kLaw ? kLeastLawScale : kLeastScale,
        encoder ? kSlowestEncoderNoise_s : kSlowestEffortNoise_s);
    // Recordings of simulations may hold a law to the last bit.
    const double share = channel.kind == ChannelKind::kDrive ? kLeastEffortNoise : kLeastNoise;
    const double least = share * floor_of(channel.rows, channel.measured);
    channel.noise.deviation = std::max(channel.noise.deviation, least);
    channel.floor = std::max(floor_of(channel.rows, left[c]), least);
    for (std::size_t r = 0; r < tracks_.size(); ++r)
      channel.whiteners[r] = Whitener(channel.rows[r], channel.noise);
  }
}

void Likelihood::take_noise(const Likelihood& other) {
  for (Channel& channel : channels_) {
    const Channel* same = other.find(channel.joint, channel.kind);
    if (same == nullptr) continue;
    channel.noise = same->noise;
    channel.floor = same->floor;
    for (std::size_t r = 0; r < tracks_.size(); ++r)
      channel.whiteners[r] = Whitener(channel.rows[r], channel.noise);
  }
}

std::optional<double> take_constants(const Channel& channel, ByRecording& residuals) {
  double squares = 0.0, recordings = 0.0;
  for (std::size_t r = 0; r < residuals.size(); ++r) {
    const std::vector<Index>& used = channel.used[r];
    if (used.empty()) continue;
    const double constant = residuals[r](used).mean();
    residuals[r].array() -= constant;
    squares += constant * constant;
    recordings += 1.0;
  }
  if (recordings == 0.0) return std::nullopt;
  return std::sqrt(squares / recordings);
}

std::vector<std::optional<double>> take_drawn_constants(const Likelihood& rows,
                                                        std::vector<ByRecording>& residuals) {
  std::vector<std::optional<double>> taken(rows.channels().size());
  for (std::size_t c = 0; c < rows.channels().size(); ++c) {
    const Channel& channel = rows.channels()[c];
    const physics::Joint& joint = rows.base().plant.joints[channel.joint];
    const bool drawn = joint.parameter("homing_offset", "deviation") > 0.0;
    if (drawn && channel.kind == ChannelKind::kPosition)
      taken[c] = take_constants(channel, residuals[c]);
  }
  return taken;
}

double huber_loss(double innovation) {
  const double size = std::abs(innovation);
  return size < kHuber ? size * size : 2.0 * kHuber * size - kHuber * kHuber;
}

double huber_loss(const VectorXd& innovations) {
  double sum = 0.0;
  for (const double e : innovations) sum += huber_loss(e);
  return sum;
}

VectorXd root_weights(const VectorXd& innovations) {
  return innovations.unaryExpr([](double e) {
    const double size = std::abs(e);
    return size > kHuber ? std::sqrt(kHuber / size) : 1.0;
  });
}

}  // namespace ravencal::diagnose
