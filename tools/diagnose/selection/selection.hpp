// SPDX-License-Identifier: Apache-2.0
//
// Forward selection of effects for one residual channel, with refinement, swaps and drops. A
// candidate enters only through its gates: held-out gain over blocks, chance over all candidates,
// physical size, physical bounds.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "diagnose/effects/effect_form.hpp"
#include "diagnose/effects/nominal.hpp"
#include "diagnose/fit/block_fit.hpp"
#include "diagnose/fit/sign_flip.hpp"

namespace ravencal::diagnose {

/// Twice the log of a likelihood ratio from which a rival is out (20 : 1).
inline constexpr double kClearScore = 6.0;

/// What a search through some hundred sets or pairs must gain that nothing called for: twice the
/// logs of their number and of 200 : 1.
inline constexpr double kUncalledScore = 20.0;

/// Share of what the plant predicts: LuGre's and Maxwell's friction differ by as much from a
/// slip element, a stiffening cable from a straight one.
inline constexpr double kModelForm = 0.04;

/// True if one column is the other, up to a factor; nothing is the same as an empty one.
bool same_column(const Eigen::VectorXd& a, const Eigen::VectorXd& b);

/// The gates (MISMATCH: four gates before an effect is named; the fourth is in invariance.hpp).
struct Gates {
  double alpha = 0.01;          ///< chance over all candidates of one channel
  double least_z = 2.5;         ///< held-out gain over its standard error, blocks as observations
  double block_p = 0.0124;      ///< or by sign flips: two-sided chance of a normal beyond least_z
  double least_share = 0.02;    ///< of the held-out squared error that is left
  double most_share = 0.5;      ///< of it: what few stretches repeat counts as well
  double size_per_floor = 0.5;  ///< of what no other part of the model can say
  /// The same of what has no name: no physics speaks for it beforehand.
  double unnamed_per_floor = 0.7;
};

/// The gain in held-out blocks is repeated and not made by a few of them.
inline bool repeats(const Gates& gates, double z, double block_p) {
  return z >= gates.least_z || (z > 0.0 && block_p <= gates.block_p);
}

/// A candidate with its columns at the training rows, for every shape of its grid.
struct Candidate {
  const EffectForm* form = nullptr;
  std::string untestable;  ///< reason, if it cannot be tested here
  std::vector<Shape> shapes;
  std::vector<Eigen::MatrixXd> columns;
};

struct Chosen {
  std::size_t candidate = 0;
  Shape shape;
  Eigen::MatrixXd columns;  ///< [training rows x m]
  /// The column at all rows, where it is the effect's part of a joint replay; else empty: the
  /// form's own.
  Eigen::VectorXd everywhere{};
  bool by_numbers =
      false;  ///< chosen for what the plant's numbers are beside it, whatever it gains
};

struct Evidence {
  double held_out_before = 0.0;  ///< RMS with everything but this effect
  double held_out_after = 0.0;
  double z = 0.0;        ///< of the held-out gain over blocks
  double block_p = 1.0;  ///< of the same gain, by flipping blocks' signs: fair to gains that grow
  double p_value = 1.0;
  double share = 0.0;
  double size = 0.0;  ///< RMS of its contribution
};

/// A set of the cable's effects that was fitted together and compared with others.
struct CableSet {
  std::vector<std::size_t> candidates;
  Eigen::VectorXd errors;   ///< held-out squared error by block
  double cost = 0.0;        ///< twice the negative log of the prior
  double form_error = 0.0;  ///< squared error by which simulations of the same cable differ
};

/// What is known about one channel while effects are added.
struct ChannelModel {
  const Series* series = nullptr;
  Blocks blocks;
  Eigen::MatrixXd base;       ///< constant, nominal parameters' changes, steps
  Eigen::VectorXd precision;  ///< of the base's coefficients
  Eigen::VectorXd target;     ///< residual after the nominal prediction
  /// Nominal parameters stay within their tolerance: a term whose change would exceed it stands at
  /// its limit (`held`, 0 where free), its column is zero and its part is out of the target.
  std::vector<double> limit;
  std::vector<double> tolerance;
  std::vector<double> held;
  Eigen::MatrixXd free_base;    ///< base before any term was held
  Eigen::VectorXd free_target;  ///< target before any term was held
  std::vector<std::shared_ptr<const Candidate>> candidates;
  std::vector<std::string> nominal_ids;  ///< effects that the plant has
  std::vector<std::string> nominal_parameters;
  /// Columns at all rows of nominal terms that were taken anew beside the cable's effects; by term.
  std::map<std::size_t, Eigen::VectorXd> moved_terms;
  std::vector<Chosen> chosen;
  std::vector<CableSet> cable_sets;  ///< that the chosen one was preferred to, itself first
  Eigen::VectorXd noise;             ///< residual of the saturated model, held out
  double floor = 0.0;                ///< RMS below which no held-out model got
  double correlation_rows = 1.0;

  [[nodiscard]] Eigen::MatrixXd columns() const;
  /// Place of a chosen effect's first column in columns().
  [[nodiscard]] Eigen::Index first_column(std::size_t effect) const;
  [[nodiscard]] Eigen::VectorXd column_precision(Eigen::Index count) const;
  /// True if the prerequisite of a candidate is met by the effects chosen or the plant.
  [[nodiscard]] bool permits(const EffectForm& form) const;
  /// True if the candidate may be tested beside the effects chosen: it is not among them, its
  /// prerequisite is met, and a nominal term stands at its limit.
  [[nodiscard]] bool offers(std::size_t candidate) const;
  /// The model with one more effect, and without one of its own; nominal terms held anew.
  [[nodiscard]] ChannelModel with(const Chosen& effect) const;
  [[nodiscard]] ChannelModel without(std::size_t effect) const;
  /// Holds the nominal terms that leave their limits, given the effects chosen.
  void hold_nominal();
  [[nodiscard]] bool has_constant() const { return !free_base.col(0).isZero(0.0); }
  [[nodiscard]] double rms_of(const Eigen::VectorXd& block_errors) const;
};

struct TestedCandidate {
  std::size_t candidate = 0;
  Chosen best;
  Eigen::VectorXd errors;  ///< held-out squared error per block with it
  Evidence evidence;
  Eigen::VectorXd coefficients;  ///< in the joint fit with it
  double median_null = 0.0;      ///< gain that chance reaches half of the time
  double critical_gain = 0.0;    ///< gain needed for the chance gate
  double inflation = 1.0;        ///< of the gain that slow noise feigns, over independent blocks'
  bool consistent = true;
};

/// Coefficients of model.columns() on all blocks; held nominal terms at their limits.
Eigen::VectorXd joint_fit(const ChannelModel& model);

/// Tests all candidates that the model offers against it.
struct ScreenResult {
  Eigen::VectorXd errors;  ///< of the model alone, per block
  std::vector<TestedCandidate> tested;
};
ScreenResult screen(const ChannelModel& model, const Gates& gates, std::uint64_t seed);

/// An admissible candidate in the model, nominal parameters held anew beside it.
struct Contender {
  const TestedCandidate* tested = nullptr;
  Eigen::VectorXd errors;  ///< held-out squared error per block
  /// Twice the negative log of what data and prior say of it, up to a constant; least is likeliest.
  double score = 0.0;
};
/// All admissible candidates of a screen of that model, in its order.
std::vector<Contender> contenders(const ChannelModel& model, const ScreenResult& result,
                                  const Gates& gates);

/// True if the last of the chosen effects has numbers that it can have, the plant's own held anew
/// beside it: a screen sees only what they had not yet bent towards it.
bool last_is_consistent(const ChannelModel& model);

/// Mean of the blocks' gains over its standard error.
double z_score(const Eigen::VectorXd& gains);

/// Squared error that counts as one: the noise's, as often as it says something new.
double noise_unit(const ChannelModel& model);

/// Held-out squared error of the model per block.
Eigen::VectorXd held_out_errors(const ChannelModel& model);

/// Twice the negative log of what is thought of it beforehand: missing physics with so many free
/// numbers; a number of the plant with that relative change; the plant's numbers with
/// `coefficients` of the model, within their tolerances.
double effect_cost(Eigen::Index numbers);
/// Numbers of a chosen effect that the data settle.
Eigen::Index freedom_of(const ChannelModel& model, const Chosen& chosen);
double number_cost(double change, double tolerance);
/// Of an effect with these coefficients: one of the former.
double cost_of(const ChannelModel& model, const Chosen& chosen,
               const Eigen::VectorXd& coefficients);
/// Of the effect chosen there. `coefficients` are the model's.
double chosen_cost(const ChannelModel& model, std::size_t effect,
                   const Eigen::VectorXd& coefficients);
/// Of all chosen effects.
double chosen_cost(const ChannelModel& model, const Eigen::VectorXd& coefficients);
double nominal_cost(const ChannelModel& model, const Eigen::VectorXd& coefficients);

/// The model with its constant out of reach.
ChannelModel without_constant(const ChannelModel& model);

/// Score of the model as `contenders` reckons it, its chosen effects' own cost aside.
double score_of(const ChannelModel& model);

/// The same with what is thought of its effects beforehand.
double penalised_score(const ChannelModel& model);

/// True if held-out errors per block cannot be told apart by two standard errors.
bool tied(const Eigen::VectorXd& a, const Eigen::VectorXd& b);

/// Blocks, noise and prior weights for a channel; `forms` must outlive the model.
ChannelModel prepare_channel(const Series& series, const Nominal& nominal, const Forms& forms);

/// Residual at the training rows of a model with every candidate in it, held out; or of the model
/// itself, if that predicts better.
Eigen::VectorXd saturated_noise(const ChannelModel& model);

/// Rows over which that noise resembles itself, drifts and steps aside.
double noise_memory(const ChannelModel& model, const Eigen::VectorXd& noise);

/// Adds effects until no candidate passes its gates.
void select_effects(ChannelModel& model, const Gates& gates, std::uint64_t seed);

/// Evidence for an effect of the model, given all the others in it.
Evidence evidence_of(const ChannelModel& model, std::size_t chosen, const Gates& gates,
                     std::uint64_t seed);

/// Improves the shape of a continuous form from a start, beside the effects of the model.
Chosen refined(const ChannelModel& model, const Chosen& start);

}  // namespace ravencal::diagnose
