// SPDX-License-Identifier: Apache-2.0
#include "diagnose/model/likelihood.hpp"

#include <algorithm>
#include <cmath>

#include "diagnose/track/filter.hpp"
#include "physics/predict/smoother.hpp"
#include "physics/servo_law.hpp"

namespace ravencal::diagnose {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

/// Cables and friction forget how a recording began.
constexpr double kForgottenS = 1.0;
/// A block is a stretch of this length; so many at least and at most.
constexpr double kBlockS = 2.5;
constexpr int kFewestBlocks = 24;
constexpr int kMostBlocks = 120;
/// Reach of a difference that tells motion from the encoder's counts, and the counts.
constexpr double kStillS = 0.04;
constexpr double kStillQuanta = 2.5;
/// Around a reversal, where presliding and quanta decide: half widths beyond the filter, and the
/// further variance in variances of the noise.
constexpr double kTurnDriveS = 0.06;
constexpr double kTurnPositionS = 0.08;
constexpr double kTurnDriveDoubt = 30.0;
constexpr double kTurnPositionDoubt = 3.0;
/// Rows whose squares are left out of a channel's floor.
constexpr double kLeftOutOfFloor = 0.02;
/// The scale of the noise is at least this share of the innovations' RMS; a law is no physics.
constexpr double kLeastScale = 0.5;
constexpr double kLeastLawScale = 0.9;

Index rows_in(double seconds, const Track& track) {
  return std::max<Index>(1, std::lround(seconds / track.period_s));
}

template <typename Mark>
void mark_around(Index centre, Index reach, Index rows, Mark&& mark) {
  for (Index i = std::max<Index>(0, centre - reach); i <= std::min(rows - 1, centre + reach); ++i)
    mark(static_cast<std::size_t>(i));
}

/// At rest dry friction is whatever the effort asks.
void leave_out_rest(const Track& track, std::size_t joint, std::vector<char>& used) {
  const VectorXd& q = track.forced.motors[joint].q;
  const Index reach = rows_in(kStillS, track);
  const double least = kStillQuanta * track.joints[joint].quantum;
  for (Index i = 0; i < q.size(); ++i) {
    const double moved = q[std::min(q.size() - 1, i + reach)] - q[std::max<Index>(0, i - reach)];
    if (std::abs(moved) < least)
      mark_around(i, track.tent_rows + reach, q.size(), [&](std::size_t n) { used[n] = 0; });
  }
}

void doubt_turns(const Track& track, std::size_t joint, double reach_s, double doubt,
                 std::vector<double>& doubts) {
  const VectorXd& v = track.forced.motors[joint].v;
  const Index reach = track.tent_rows + rows_in(reach_s, track);
  for (Index i = 1; i < v.size(); ++i) {
    if (v[i] * v[i - 1] <= 0.0)
      mark_around(i, reach, v.size(), [&](std::size_t n) { doubts[n] = doubt; });
  }
}

const VectorXd& signal_of(const JointTrack& joint, ChannelKind kind) {
  return kind == ChannelKind::kPosition ? joint.truth : joint.effort;
}

/// The signal through the filter; rows within whose reach a value was lost become unused.
VectorXd filtered(const Track& track, const VectorXd& signal, std::vector<char>& used) {
  for (Index i = 0; i < signal.size(); ++i) {
    if (!std::isfinite(signal[i]))
      mark_around(i, track.tent_rows, signal.size(), [&](std::size_t n) { used[n] = 0; });
  }
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
  add_channels(like);
  lay_out();
}

void Likelihood::add_channels(const Likelihood* like) {
  for (std::size_t j = 0; j < plant_.joints.size(); ++j) {
    const bool has_law = physics::servo_law(plant_.joints[j]).has_value();
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
        NoiseRows rows = rows_of(track, j, kind);
        VectorXd measured;
        if (recorded) measured = filtered(track, signal_of(joint, kind), rows.used);
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

bool Likelihood::has(std::size_t joint, ChannelKind kind) const {
  return std::any_of(channels_.begin(), channels_.end(), [&](const Channel& channel) {
    return channel.joint == joint && channel.kind == kind;
  });
}

NoiseRows Likelihood::rows_of(const Track& track, std::size_t joint, ChannelKind kind) const {
  const auto count = static_cast<std::size_t>(track.rows());
  NoiseRows rows{std::vector<char>(count, 0), std::vector<double>(count, 0.0), track.period_s,
                 track.forced.fresh};
  double begun_s = 0.0;
  const double ends_s = track.forced.t_s[track.rows() - 1] - kTentS;
  for (Index i = 0; i < track.rows(); ++i) {
    const double t_s = track.forced.t_s[i];
    if (track.forced.fresh[static_cast<std::size_t>(i)] != 0) begun_s = t_s;
    // One row per width of the filter: others say the same again.
    const bool sampled = i % track.tent_rows == 0 && t_s - begun_s >= kForgottenS && t_s <= ends_s;
    rows.used[static_cast<std::size_t>(i)] = sampled ? 1 : 0;
  }
  for (Index i = 0; i < track.rows(); ++i) {
    if (track.lost[joint][static_cast<std::size_t>(i)] != 0)
      mark_around(i, track.tent_rows, track.rows(), [&](std::size_t n) { rows.used[n] = 0; });
  }
  if (kind == ChannelKind::kDrive) {
    leave_out_rest(track, joint, rows.used);
    if (plant_.joints[joint].find_effect("presliding") == nullptr)
      doubt_turns(track, joint, kTurnDriveS, kTurnDriveDoubt, rows.doubt);
  }
  if (kind == ChannelKind::kPosition)
    doubt_turns(track, joint, kTurnPositionS, kTurnPositionDoubt, rows.doubt);
  return rows;
}

void Likelihood::lay_out() {
  double length_s = 0.0;
  for (const Track& track : tracks_) length_s += track.period_s * static_cast<double>(track.rows());
  const double block_s =
      length_s / std::clamp(std::floor(length_s / kBlockS), static_cast<double>(kFewestBlocks),
                            static_cast<double>(kMostBlocks));
  std::vector<int> first_block;
  for (const Track& track : tracks_) {
    first_block.push_back(block_count_);
    block_count_ += 1 + static_cast<int>(track.forced.t_s[track.rows() - 1] / block_s);
  }
  for (Channel& channel : channels_) {
    for (std::size_t r = 0; r < tracks_.size(); ++r) {
      channel.first.push_back(rows_);
      std::vector<Index> used;
      for (Index i = 0; i < tracks_[r].rows(); ++i) {
        if (channel.rows[r].used[static_cast<std::size_t>(i)] == 0) continue;
        used.push_back(i);
        blocks_.push_back(first_block[r] + static_cast<int>(tracks_[r].forced.t_s[i] / block_s));
      }
      rows_ += static_cast<Index>(used.size());
      channel.used.push_back(std::move(used));
      channel.whiteners.emplace_back(channel.rows[r], channel.noise);
    }
  }
}

std::size_t Likelihood::add_shape(std::size_t channel, const ShapeFunction& function) {
  Shape shape{channel, {}};
  for (std::size_t r = 0; r < tracks_.size(); ++r)
    shape.column.push_back(tent(function(tracks_[r], by_plant_[r]), tracks_[r].tent_rows));
  shapes_.push_back(std::move(shape));
  return shapes_.size() - 1;
}

VectorXd Likelihood::command_of(const State& state, std::size_t recording,
                                std::size_t joint) const {
  const Track& track = tracks_[recording];
  const VectorXd& desired = track.joints[joint].desired;
  const auto law = physics::servo_law(state.plant.joints[joint]);
  if (!law || desired.size() == 0) return {};
  const physics::Motion& motor = track.forced.motors[joint];
  const LawErrors& errors = state.laws[joint];
  return law->position * (1.0 + errors.position) * (desired - motor.q) +
         law->rate * (1.0 + errors.rate) *
             (errors.desired_rate * first_difference(desired, track.period_s) - motor.v);
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

VectorXd Likelihood::predicted(const Channel& channel, const Outcome& outcome,
                               std::size_t recording) const {
  const physics::Prediction& prediction = outcome.predictions[recording];
  switch (channel.kind) {
    case ChannelKind::kPosition:
      return tent(prediction.position[channel.joint], tracks_[recording].tent_rows);
    case ChannelKind::kDrive:
      return tent(prediction.effort[channel.joint], tracks_[recording].tent_rows);
    case ChannelKind::kLaw:
      break;
  }
  return tent(outcome.commands[recording][channel.joint], tracks_[recording].tent_rows);
}

std::vector<ByRecording> Likelihood::residuals(const State& state, const Outcome& outcome) const {
  std::vector<ByRecording> all;
  for (std::size_t c = 0; c < channels_.size(); ++c) {
    ByRecording of_channel;
    for (std::size_t r = 0; r < tracks_.size(); ++r) {
      VectorXd residual = VectorXd::Zero(tracks_[r].rows());
      if (channels_[c].measured[r].size() > 0)
        residual = channels_[c].measured[r] - predicted(channels_[c], outcome, r);
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
    if (parameter.reaches == Reaches::kLaw) {
      one.commands.assign(r + 1, at.commands[r]);
      one.commands[r][parameter.joint] = command_of(changed, r, parameter.joint);
    } else if (parameter.reaches != Reaches::kShape) {
      one.predictions.resize(r + 1);
      one.predictions[r] = at.predictions[r];
      predictors_[r].update(changed.plant, changed.circumstances[r], parameter.joint,
                            reach_of(parameter.reaches), one.predictions[r]);
    }
    for (std::size_t c = 0; c < channels_.size(); ++c) {
      const Channel& channel = channels_[c];
      VectorXd difference;
      if (parameter.reaches == Reaches::kShape) {
        for (const auto& [shape, coefficient] : changed.shapes) {
          const auto before = state.shapes.find(shape);
          const double added = coefficient - (before == state.shapes.end() ? 0.0 : before->second);
          if (shapes_[shape].channel == c && added != 0.0)
            difference = added * shapes_[shape].column[r];
        }
      } else if ((channel.kind == ChannelKind::kLaw) == (parameter.reaches == Reaches::kLaw)) {
        const auto& part = [&](const Outcome& o) -> const VectorXd& {
          if (channel.kind == ChannelKind::kLaw) return o.commands[r][channel.joint];
          return channel.kind == ChannelKind::kDrive ? o.predictions[r].effort[channel.joint]
                                                     : o.predictions[r].position[channel.joint];
        };
        difference = part(one) - part(at);
        if (difference.size() > 0 && !difference.isZero(0.0))
          difference = tent(difference, tracks_[r].tent_rows);
      }
      if (difference.size() == 0 || difference.isZero(0.0)) continue;
      channel.whiteners[r].apply(difference / step,
                                 column.segment(channel.first[r], used_rows(channel, r)));
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
    channel.noise = diagnose::estimate_noise(
        rows, values, channel.kind == ChannelKind::kLaw ? kLeastLawScale : kLeastScale);
    channel.floor = floor_of(channel.rows, left[c]);
    for (std::size_t r = 0; r < tracks_.size(); ++r)
      channel.whiteners[r] = Whitener(channel.rows[r], channel.noise);
  }
}

void Likelihood::take_noise(const Likelihood& other) {
  for (Channel& channel : channels_) {
    for (const Channel& same : other.channels_) {
      if (same.joint != channel.joint || same.kind != channel.kind) continue;
      channel.noise = same.noise;
      channel.floor = same.floor;
      for (std::size_t r = 0; r < tracks_.size(); ++r)
        channel.whiteners[r] = Whitener(channel.rows[r], channel.noise);
    }
  }
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
