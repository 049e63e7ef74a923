// SPDX-License-Identifier: Apache-2.0
//
// How well a state explains recordings: every channel of every joint, predicted and measured alike
// seen through one filter, their difference whitened by the channel's noise and summed by Huber's
// loss. Drives, positions and the commands of the law stand in one vector.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <optional>
#include <string_view>
#include <vector>

#include "diagnose/model/noise.hpp"
#include "diagnose/model/parameter.hpp"
#include "diagnose/model/state.hpp"
#include "diagnose/track/track.hpp"

namespace ravencal::diagnose {

/// Innovations beyond so many deviations count linearly.
inline constexpr double kHuber = 2.5;

enum class ChannelKind { kPosition, kDrive, kLaw };

struct Channel {
  std::size_t joint = 0;
  ChannelKind kind = ChannelKind::kPosition;
  bool tracking = false;                  ///< a position that followed the command (JointTrack)
  bool followed = false;                  ///< ...under the plant's law: it shows a drive
  std::vector<NoiseRows> rows;            ///< [recording]
  std::vector<Eigen::VectorXd> measured;  ///< [recording], filtered; empty: not recorded there
  std::vector<Eigen::Index> first;        ///< [recording]: place of its first used row in the stack
  std::vector<std::vector<Eigen::Index>> used;  ///< [recording]: its used rows
  NoiseModel noise;
  std::vector<Whitener> whiteners;  ///< [recording]
  /// RMS of what the plant's own physics leaves, the largest fiftieth apart: what an effect's size
  /// is compared with.
  double floor = 1.0;
};

/// Values of one channel in each recording: [recording][row].
using ByRecording = std::vector<Eigen::VectorXd>;

/// What a state predicts: [recording].
struct Outcome {
  std::vector<physics::Prediction> predictions;
  std::vector<std::vector<Eigen::VectorXd>> commands;  ///< of the law, [recording][joint]
};

/// A shape that no plant can have, in one channel.
struct Shape {
  std::size_t channel = 0;
  ByRecording column;
};
using ShapeFunction =
    std::function<Eigen::VectorXd(const Track&, const physics::Prediction& by_plant)>;

class Likelihood {
 public:
  /// `plant` is the one that was given. `like`: whose channels to take, those included that none of
  /// these tracks shows; null: those that any shows.
  Likelihood(const physics::Plant& plant, std::vector<Track> tracks,
             const Likelihood* like = nullptr);

  /// Columns are found on so many threads; 0: one per core.
  void use_threads(unsigned threads) { threads_ = threads; }
  [[nodiscard]] unsigned threads() const { return threads_; }

  /// The plant as it was given, along these recordings.
  [[nodiscard]] const State& base() const { return base_; }
  [[nodiscard]] const std::vector<Track>& tracks() const { return tracks_; }
  [[nodiscard]] const std::vector<Channel>& channels() const { return channels_; }
  [[nodiscard]] const physics::Predictor& predictor(std::size_t recording) const {
    return predictors_[recording];
  }
  /// That channel of the joint; null: none shows it.
  [[nodiscard]] const Channel* find(std::size_t joint, ChannelKind kind) const;
  [[nodiscard]] bool has(std::size_t joint, ChannelKind kind) const {
    return find(joint, kind) != nullptr;
  }
  [[nodiscard]] Eigen::Index rows() const { return rows_; }
  /// Of each stacked row: a stretch of some seconds in one recording.
  [[nodiscard]] const std::vector<int>& blocks() const { return blocks_; }
  [[nodiscard]] int block_count() const { return block_count_; }

  /// The place of a new shape, to which a state's coefficient belongs.
  std::size_t add_shape(std::size_t channel, const ShapeFunction& function);
  [[nodiscard]] std::size_t channel_of(std::size_t shape) const { return shapes_[shape].channel; }
  void set_shape(std::size_t shape, ByRecording column) {
    shapes_[shape].column = std::move(column);
  }

  /// The channel's signal as it was recorded, filtered: `measured` unless another simulation is the
  /// baseline.
  [[nodiscard]] Eigen::VectorXd recorded(const Channel& channel, std::size_t recording) const;
  [[nodiscard]] Outcome outcome(const State& state) const;
  /// Measured minus predicted, filtered: [channel][recording].
  [[nodiscard]] std::vector<ByRecording> residuals(const State& state,
                                                   const Outcome& outcome) const;
  /// Stacked innovations.
  [[nodiscard]] Eigen::VectorXd whitened(const std::vector<ByRecording>& residuals) const;
  /// Change of the whitened prediction per change of x, from the outcome of `state`.
  void add_column(const State& state, const Outcome& at, const Parameter& parameter, double step,
                  Eigen::Ref<Eigen::VectorXd> column) const;

  /// As if the recordings were what the state predicts, with these innovations beside it.
  void measure_anew(const State& state, const Outcome& outcome, const Eigen::VectorXd& innovations);

  /// Links weigh where this state holds them.
  void move_links(const State& state);
  void estimate_noise(const State& state);
  /// By which a score divides the loss, at least 1: correlation that the noise model leaves.
  [[nodiscard]] double dispersion() const { return dispersion_; }
  void set_dispersion(double dispersion) { dispersion_ = dispersion; }
  /// The noise of the same channels of other recordings.
  void take_noise(const Likelihood& other);

 private:
  void add_channels(const Likelihood* like);
  /// No plant states whether its controller's damping knows of the desired velocity: the recorded
  /// effort says which of the two it is.
  void settle_law(std::size_t joint);
  /// Whether the plant's law, but for one gain, made what the recordings hold as efforts where the
  /// drive was on.
  [[nodiscard]] bool law_made_the_commands(std::size_t joint) const;
  void lay_out();
  /// Block of each row of each recording.
  [[nodiscard]] std::vector<std::vector<int>> blocks_of_rows();
  [[nodiscard]] Eigen::VectorXd command_of(const State& state, std::size_t recording,
                                           std::size_t joint) const;
  /// What the channel shows in that recording, before the filter; `scratch` may hold it.
  [[nodiscard]] const Eigen::VectorXd& part_of(const Channel& channel, const State& state,
                                               const Outcome& outcome, std::size_t recording,
                                               Eigen::VectorXd& scratch) const;
  /// Filtered; empty: nothing.
  [[nodiscard]] Eigen::VectorXd shape_difference(std::size_t channel, const State& state,
                                                 const State& changed, std::size_t recording) const;
  [[nodiscard]] Eigen::VectorXd difference_of(const Channel& channel, const State& state,
                                              const Outcome& at, const State& changed,
                                              const Outcome& one, std::size_t recording) const;

  physics::Plant plant_;
  State base_;
  std::vector<Track> tracks_;
  std::vector<physics::Predictor> predictors_;
  std::vector<Channel> channels_;
  std::vector<Shape> shapes_;
  std::vector<physics::Prediction> by_plant_;  ///< what shapes are made of
  std::vector<int> blocks_;
  int block_count_ = 0;
  Eigen::Index rows_ = 0;
  unsigned threads_ = 1;
  double dispersion_ = 1.0;
};

/// Which rows of a recording a channel uses: one per width of the filter, away from starts, from
/// lost values and, in drives, from rest. Rows near reversals are doubted.
NoiseRows rows_of(const Track& track, std::size_t joint, ChannelKind kind,
                  const physics::Plant& plant);

/// Rows within whose filter a value of the signal was lost become unused.
void leave_out_lost(const Track& track, const Eigen::VectorXd& signal, std::vector<char>& used);

/// Takes off the mean over the used rows of each recording; their RMS, none without used rows.
std::optional<double> take_constants(const Channel& channel, ByRecording& residuals);
/// The same of every channel ([channel]) whose constant the plant draws at each homing.
std::vector<std::optional<double>> take_drawn_constants(const Likelihood& rows,
                                                        std::vector<ByRecording>& residuals);

/// Huber's loss of one innovation, of stacked ones, and the root of each row's weight in it.
double huber_loss(double innovation);
double huber_loss(const Eigen::VectorXd& innovations);
Eigen::VectorXd root_weights(const Eigen::VectorXd& innovations);

}  // namespace ravencal::diagnose
