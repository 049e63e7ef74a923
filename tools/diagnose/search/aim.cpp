// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <iterator>
#include <numbers>
#include <unsupported/Eigen/FFT>
#include <vector>

#include "diagnose/search/orders.hpp"
#include "diagnose/search/screen.hpp"

namespace ravencal::diagnose {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

constexpr double kLowestTone_hz = 0.25;  // slower ones are slow noise
constexpr double kHighestTone_hz = 1.6;  // at which the filter still passes most
constexpr double kToneStep = 0.4;        // in periods over the recording, at most
constexpr double kCell_s = 0.02;         // rows of one time for the periodogram
constexpr std::size_t kMoments = 8;
constexpr double kApartS = 1.0;  // moments closer than this are one
constexpr int kEvenMoments = 16;
/// Orders of waves end here: teeth of a gear and poles of a motor behind a gear, per radian, and as
/// many per turn of a motor whose reduction is known.
constexpr double kHighestOrder = 500.0;
constexpr double kHighestPerTurn = 4.0;

/// Whitened, a jump is one kick: the moments of the greatest kicks, and some in between.
std::vector<std::vector<double>> moments_of(const Likelihood& likelihood, const Channel& channel,
                                            std::size_t recording, const VectorXd& innovations) {
  const Track& track = likelihood.tracks()[recording];
  std::vector<std::pair<double, Index>> kicks;
  const std::vector<Index>& used = channel.used[recording];
  for (std::size_t n = 0; n < used.size(); ++n)
    kicks.emplace_back(-std::abs(innovations[channel.first[recording] + static_cast<Index>(n)]),
                       used[n]);
  std::sort(kicks.begin(), kicks.end());
  std::vector<double> moments_s;
  for (const auto& [kick, row] : kicks) {
    if (moments_s.size() == kMoments) break;
    const double t_s = track.forced.t_s[row];
    const bool near = std::any_of(moments_s.begin(), moments_s.end(),
                                  [&](double other) { return std::abs(other - t_s) < kApartS; });
    if (!near) moments_s.push_back(t_s);
  }
  const double half_s = 0.5 * track.period_s * static_cast<double>(track.tent_rows);
  std::vector<std::vector<double>> starts;
  for (const double t_s : moments_s)
    for (const double off_s : {-half_s, 0.0, half_s}) starts.push_back({t_s + off_s});
  const double ends_s = track.forced.t_s[track.rows() - 1];
  for (int n = 1; n < kEvenMoments; ++n) starts.push_back({ends_s * n / kEvenMoments});
  return starts;
}

std::vector<std::vector<double>> orders_of(const Likelihood& likelihood, const Candidate& wave,
                                           const VectorXd& innovations) {
  const ChannelKind kind =
      wave.sizes.front().reaches == Reaches::kDrive ? ChannelKind::kDrive : ChannelKind::kPosition;
  const double reduction = likelihood.base().plant.joints[wave.joint].reduction;
  const double highest = std::max(kHighestOrder, kHighestPerTurn * reduction);
  std::vector<std::vector<double>> starts;
  if (const Channel* channel = likelihood.find(wave.joint, kind); channel != nullptr)
    for (const double order : orders_in(likelihood, *channel, innovations, highest))
      starts.push_back({order});
  return starts;
}

/// Frequency of the strongest sine in a channel, over all recordings.
double tone_of(const Likelihood& likelihood, const Channel& channel, const VectorXd& left) {
  double length_s = 1.0 / kLowestTone_hz;
  for (const Track& track : likelihood.tracks())
    length_s = std::max(length_s, track.period_s * static_cast<double>(track.rows() - 1));
  const std::size_t cells = std::bit_ceil(static_cast<std::size_t>(length_s / kToneStep / kCell_s));
  const double step_hz = 1.0 / (static_cast<double>(cells) * kCell_s);
  const auto lowest = static_cast<Index>(std::ceil(kLowestTone_hz / step_hz));
  const auto highest = static_cast<Index>(kHighestTone_hz / step_hz);
  VectorXd power = VectorXd::Zero(highest - lowest + 1);
  Eigen::FFT<double> fft;
  for (std::size_t r = 0; r < likelihood.tracks().size(); ++r) {
    const VectorXd& t_s = likelihood.tracks()[r].forced.t_s;
    VectorXd values = VectorXd::Zero(static_cast<Index>(cells));
    for (std::size_t n = 0; n < channel.used[r].size(); ++n)
      // Times may step back between episodes; sines of these frequencies repeat after all cells.
      values[std::lround(t_s[channel.used[r][n]] / kCell_s) & static_cast<Index>(cells - 1)] +=
          left[channel.first[r] + static_cast<Index>(n)];
    Eigen::VectorXcd spectrum;
    fft.fwd(spectrum, values);
    power += spectrum.segment(lowest, power.size()).cwiseAbs2();
  }
  Index strongest = 0;
  power.maxCoeff(&strongest);
  return static_cast<double>(lowest + strongest) * step_hz;
}

void set_tone(Likelihood& likelihood, const Candidate& candidate, double f_hz) {
  for (std::size_t part = 0; part < 2; ++part) {
    ByRecording columns;
    for (const Track& track : likelihood.tracks()) {
      const VectorXd phase = 2.0 * std::numbers::pi * f_hz * track.forced.t_s;
      columns.push_back(part == 0 ? VectorXd(phase.array().sin()) : VectorXd(phase.array().cos()));
    }
    likelihood.set_shape(*candidate.sizes[part].shape, std::move(columns));
  }
}

}  // namespace

void aim(Likelihood& training, Likelihood* held_out, const Model& model, Vocabulary& vocabulary) {
  const State state = model.state_for(training);
  const VectorXd innovations =
      training.whitened(training.residuals(state, training.outcome(state)));
  const VectorXd left = root_weights(innovations).cwiseProduct(innovations);
  for (std::size_t c = 0; c < vocabulary.candidates.size(); ++c) {
    Candidate& candidate = vocabulary.candidates[c];
    if (model.chosen.contains(c)) continue;
    if (candidate.kind == CandidateKind::kJump) {
      candidate.starts.clear();
      for (const Channel& channel : training.channels())
        if (channel.joint == candidate.joint && channel.kind == ChannelKind::kPosition)
          candidate.starts = moments_of(training, channel, *candidate.sizes[0].recording, left);
    }
    if (candidate.stated_orders) {
      candidate.starts.resize(*candidate.stated_orders);
      std::ranges::copy(orders_of(training, candidate, left), std::back_inserter(candidate.starts));
    }
    if (candidate.kind == CandidateKind::kTone) {
      const Channel& channel = training.channels()[training.channel_of(*candidate.sizes[0].shape)];
      const double f_hz = tone_of(training, channel, left);
      set_tone(training, candidate, f_hz);
      if (held_out != nullptr) set_tone(*held_out, candidate, f_hz);
      candidate.circumstance = fmt::format("time, at {:.2g} Hz", f_hz);
    }
  }
}

}  // namespace ravencal::diagnose
