// SPDX-License-Identifier: Apache-2.0
//
// Everything that diagnose says about one residual channel of one joint.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "diagnose/findings/findings.hpp"
#include "diagnose/selection/invariance.hpp"
#include "diagnose/selection/selection.hpp"
#include "physics/plant.hpp"

namespace ravencal::diagnose {

/// What the fit of a channel predicts at every row, held out or not. Copies share series, forms and
/// nominal terms.
struct ChannelFit {
  std::shared_ptr<Series> series;  ///< what the model refers to
  ChannelModel model;
  Forms forms;  ///< what model.candidates point to
  std::shared_ptr<Nominal> nominal = std::make_shared<Nominal>();  ///< what forms point to
  std::optional<Unexplained> unnamed;  ///< explained by a shape that has no name
  std::size_t kept = 0;  ///< of the last effects chosen: they predict better, but have no name
  Eigen::VectorXd coefficients;       ///< of model.columns()
  Eigen::VectorXd prediction;         ///< of series.y, all rows: nominal + base + effects
  Eigen::VectorXd held_out_residual;  ///< at the training rows, each under a fit without its fold
  Eigen::VectorXd base_residual;      ///< the same without any effect
};

struct PlaceboParts;

struct ChannelFindings {
  std::string joint;
  Stage stage = Stage::kDrive;
  std::string unit;
  std::vector<Mismatch> mismatch;
  std::vector<NamedEffect> effects;
  std::vector<NamedEffect> kept;  ///< in the improved plant without a name
  std::vector<HeldOut> held_out;
  std::optional<ErrorLeft> left;
  std::vector<Unexplained> unexplained;
  std::vector<NotFound> not_found;
  std::vector<CandidateRow> candidates;
  std::vector<std::string> notes;  ///< sentences for the verdict: proxies, prior knowledge used
  Eigen::VectorXd
      found_load;  ///< drive stage: effort of weights that the plant lacks; may be empty
  std::optional<double> weight_deviation;  ///< drive stage: how well all of the weight is known
  /// Transmission stage: friction behind the cable that its loop alone says, 95 %, in the effort's
  /// unit; none where the plant has no such friction.
  std::optional<Interval> friction_behind;
  Eigen::VectorXd posture;     ///< drive stage: effort found that no link carries; may be empty
  double constant_load = 0.0;  ///< constant beside what is named
  double offset = 0.0;         ///< the same, beside what is kept as well
  std::vector<NamedEffect> refitted;  ///< nominal parameters within their tolerance
  ChannelPlot plot;
  double floor = 0.0;
  std::shared_ptr<const PlaceboParts> placebo;  ///< none for placebos themselves
  /// The drive's findings without what is kept: the free run may do better so. Empty: nothing is.
  std::shared_ptr<const ChannelFindings> bare;
};

struct ChannelOptions {
  Gates gates;
  std::uint64_t seed = 1;
  bool details = true;  ///< limits, remainder, plot; off for placebos
};

/// A channel's fit and the names that it gives.
struct NamedChannel {
  std::unique_ptr<ChannelFit> fit;
  ChannelFindings findings;
};

/// Drive, transmission and tracking channels: what they name and, of a drive, what its load is.
NamedChannel name_channel(const Series& series, const physics::Plant& plant,
                          const ChannelOptions& options);

/// All there is to say of it: limits, remainder, what is kept without a name, figures.
ChannelFindings describe(const NamedChannel& named, const physics::Plant& plant,
                         const ChannelOptions& options);

/// Both.
ChannelFindings analyse_channel(const Series& series, const physics::Plant& plant,
                                const ChannelOptions& options);

/// The command stage: control law and disturbances of its output.
ChannelFindings analyse_command(const Series& series, const physics::Plant& plant,
                                const ChannelOptions& options);

/// Gains of position error, measured rate and desired rate in the command of rows [first, last),
/// held-out rows left out.
Eigen::Vector3d recorded_gains(const Series& series, Eigen::Index first, Eigen::Index last);

/// Fit only: selection, offset, withdrawal of proxies. The forms refer to the fit that holds them.
std::unique_ptr<ChannelFit> fit_channel(const Series& series, const physics::Plant& plant,
                                        const ChannelOptions& options, ChannelFindings& findings);

/// Decides on the steps, the constant and the effects of a prepared model; `notes`: names that are
/// withdrawn.
void choose_model(ChannelFit& fit, const physics::Plant& plant, const ChannelOptions& options,
                  std::vector<std::string>& notes);

/// Takes a drive's torque constant for off where its numbers are all off by one factor, and nothing
/// else was chosen.
void adopt_common_factor(ChannelFit& fit);

/// Lets the joint's loops follow it wherever other joints move it, as far as the fit knows. Returns
/// the share of that motion which is new.
double follow_others(ChannelFit& fit, const physics::Plant& plant);
/// Fits loops and what other joints add to the motion that they follow until both agree.
void settle_loops(ChannelFit& fit, const physics::Plant& plant);

/// Adds to the model what predicts better without the evidence for a name.
void keep_without_name(ChannelFit& fit, const ChannelOptions& options);

/// Parameters of what is named, fitted beside what is kept; and what is kept.
void take_values_of(ChannelFit& fit, const physics::Plant& plant, const ChannelOptions& options,
                    ChannelFindings& findings);

/// Coefficients of a chosen effect.
Eigen::VectorXd coefficients_of(const ChannelFit& fit, std::size_t chosen);

/// Parameters of a chosen effect with intervals that hold for the circumstances of the recording
/// and for the form of its law.
std::vector<NamedParameter> sizes_of(const ChannelFit& fit, std::size_t chosen,
                                     const Invariance& invariance, const ChannelOptions& options);
/// True if its size is not nothing: the interval leaves zero out.
bool certain(const ChannelFit& fit, std::size_t chosen,
             const std::vector<NamedParameter>& parameters);

/// Chosen effects; those that too many others could stand for become unexplained.
void name_effects(const ChannelFit& fit, const ChannelOptions& options, ChannelFindings& findings);

/// A constant error is an effect of its own in the transmission; everywhere else it is free. It is
/// named where neither the plant's numbers within their tolerance nor an effect explain it.
void name_offset(const ChannelFit& fit, const physics::Plant& plant, const ChannelOptions& options,
                 ChannelFindings& findings);

/// Where an effect that a channel shows enters: what a clock or an encoder does is the sensor's,
/// whatever positions are compared.
std::string reported_stage(std::string_view id, Stage shown_in);

/// A constant effort of the drive that no load explains: dry friction that differs between the
/// directions.
void name_asymmetry(const ChannelFit& fit, const ChannelOptions& options,
                    ChannelFindings& findings);

/// Steps: lost counts, a slipping cable, or either.
void name_steps(const ChannelFit& fit, const ChannelOptions& options, ChannelFindings& findings);

/// Nominal parameters at their refitted values: no findings, but the improved plant's numbers.
void name_refitted(const ChannelFit& fit, ChannelFindings& findings);

/// Every candidate with what became of it.
void add_candidates(const ChannelFit& fit, const ChannelOptions& options,
                    ChannelFindings& findings);

/// What an interval counts: chance and the plant's tolerances, for the question whether there is
/// anything; or what simulations of cables and slow noise leave open as well, for how much it is.
enum class Doubt { kChance, kFormToo };

/// Parameters with 95 % intervals by bootstrap over blocks, shapes included to first order, nominal
/// numbers drawn from their tolerances.
std::vector<NamedParameter> parameters_of(const ChannelFit& fit, std::size_t chosen,
                                          std::uint64_t seed, Doubt doubt);

/// 95 % interval of a coefficient that time alone has to do with, a constant's (0) or a step's,
/// drawn in the same way.
Interval interval_over_time(const ChannelFit& fit, Eigen::Index column, std::uint64_t seed,
                            Doubt doubt);

/// What the model says the cable stretches by, at the training rows.
Eigen::VectorXd stretch_of(const ChannelFit& fit);

/// The first parameter's interval, wider by what the effect's size does between circumstances and,
/// where the cable was simulated for it, by what simulations of cables differ by: the form is not
/// the physics to the last percent, and which value is meant is open by that much.
void widen_by_form(const Invariance& invariance, bool of_cable,
                   std::vector<NamedParameter>& parameters);

/// The first parameter's interval, wider by what it would be if numbers of the plant that the data
/// hold at their limits were one tolerance less far off: that data want a number beyond its limit
/// says that the model's form is wrong by as much.
void widen_by_held(const ChannelFit& fit, std::size_t chosen,
                   std::vector<NamedParameter>& parameters);

/// One standard error of each nominal parameter's relative change, by bootstrap over blocks.
Eigen::VectorXd nominal_deviation(const ChannelFit& fit, std::uint64_t seed);

/// Friction behind the cable that the transmission's loop says whatever the plant does, 95 %:
/// chance and what simulations of cables differ by.
std::optional<Interval> friction_behind(const ChannelFit& fit, const ChannelOptions& options);

/// What was not found, and the least size that would have been.
void add_limits(const ChannelFit& fit, const ChannelOptions& options, ChannelFindings& findings);

/// Where the residual before any effect exceeds what a learner without physics can predict.
void add_location(const ChannelFit& fit, const ChannelOptions& options, ChannelFindings& findings);

/// Least size of a remainder: friction and cables of a simulation follow the real ones to some
/// percent of what they do at best.
double least_remainder(const ChannelFit& fit);

/// A shape without a name that explains what the effects leave, and the chosen effects that say a
/// part of what it says.
struct UnnamedShape {
  Unexplained what;  ///< the share is of the error that the effects leave
  std::vector<std::size_t> says_more_than;
};
std::optional<UnnamedShape> likeliest_shape(const ChannelFit& fit, const ChannelOptions& options);

/// A tone that goes through the whole recording: nothing of the vocabulary makes one.
void add_tone(const ChannelFit& fit, const ChannelOptions& options, ChannelFindings& findings);

/// What the effects leave that is still predictable.
void add_remainder(const ChannelFit& fit, const ChannelOptions& options, ChannelFindings& findings);

/// A few hundred points of the residual before and after, for the page.
void add_plot(const ChannelFit& fit, ChannelFindings& findings);

/// Root mean square over held-out rows of the series, or of the cross-validated residual.
void add_held_out(const ChannelFit& fit, ChannelFindings& findings);

}  // namespace ravencal::diagnose
