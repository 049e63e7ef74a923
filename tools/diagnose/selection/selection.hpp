// SPDX-License-Identifier: Apache-2.0
//
// The model of one residual channel: what the plant says, its numbers within their tolerances,
// steps and effects; what a candidate would add to it, and the gates through which it enters:
// held-out gain over blocks, chance over all candidates, physical size, physical bounds.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "diagnose/effects/effect_form.hpp"
#include "diagnose/effects/nominal.hpp"
#include "diagnose/findings/policy.hpp"
#include "diagnose/fit/block_fit.hpp"
#include "diagnose/fit/sign_flip.hpp"
#include "diagnose/selection/step.hpp"

namespace ravencal::diagnose {

/// True if the candidate is one of those.
bool is_among(const std::vector<std::size_t>& candidates, std::size_t candidate);

/// True if one column is the other, up to a factor; nothing is the same as an empty one.
bool same_column(const Eigen::VectorXd& a, const Eigen::VectorXd& b);

/// The gates (MISMATCH: four gates before an effect is named; the fourth is in invariance.hpp).
struct Gates {
  double alpha = kAlpha;
  double least_z = kLeastGain_z;
  double block_p = kLeastGain_p;
  double least_share = kLeastShare;
  double most_share = kMostShare;
  double size_per_floor = kSizePerFloor;
  double unnamed_per_floor = kUnnamedPerFloor;
};

/// The gain in held-out blocks is repeated and not made by a few of them.
inline bool repeats(const Gates& gates, double z, double block_p) {
  return z >= gates.least_z || (z > 0.0 && block_p <= gates.block_p);
}

/// A candidate with its columns at the training rows, for every shape of its grid.
struct FormCandidate {
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

/// A whole model that the chosen one was preferred to.
struct Compared {
  std::vector<std::size_t> candidates;
  bool steps = false;
  Eigen::VectorXd errors;   ///< held-out squared error by block
  double cost = 0.0;        ///< twice the negative log of the prior
  double form_error = 0.0;  ///< squared error by which simulations of the same physics differ
};

/// What is known about one channel while effects are added.
struct ChannelModel {
  const Series* series = nullptr;
  Blocks blocks;
  Eigen::MatrixXd base;       ///< constant, nominal parameters' changes, steps
  std::vector<Step> steps;    ///< each a column of the base, the last ones
  Eigen::VectorXd precision;  ///< of the base's coefficients
  Eigen::VectorXd target;     ///< residual after the nominal prediction
  /// Nominal parameters stay within their tolerance: a term whose change would exceed it stands at
  /// its limit (`held`, 0 where free), its column is zero and its part is out of the target.
  std::vector<double> limit;
  std::vector<double> tolerance;
  std::vector<double> held;
  Eigen::MatrixXd free_base;    ///< base before any term was held
  Eigen::VectorXd free_target;  ///< target before any term was held
  std::vector<std::shared_ptr<const FormCandidate>> candidates;
  std::vector<std::string> nominal_ids;  ///< effects that the plant has
  std::vector<std::string> nominal_parameters;
  /// Columns at all rows of nominal terms that were taken anew beside the cable's effects; by term.
  std::map<std::size_t, Eigen::VectorXd> moved_terms;
  std::vector<Chosen> chosen;
  std::vector<Compared> compared;
  Eigen::VectorXd noise;  ///< residual of the saturated model, held out
  double floor = 0.0;     ///< RMS below which no held-out model got
  double correlation_rows = 1.0;

  [[nodiscard]] Eigen::MatrixXd columns() const;
  /// Of the effects chosen, in their order.
  [[nodiscard]] std::vector<std::size_t> chosen_candidates() const;
  /// Place of a chosen effect's first column in columns().
  [[nodiscard]] Eigen::Index first_column(std::size_t effect) const;
  /// Place of a step's column in columns().
  [[nodiscard]] Eigen::Index step_at(std::size_t step) const {
    return static_cast<Eigen::Index>(1 + limit.size() + step);
  }
  [[nodiscard]] Eigen::VectorXd column_precision(Eigen::Index count) const;
  /// True if the prerequisite of a candidate is met by the effects chosen or the plant.
  [[nodiscard]] bool permits(const EffectForm& form) const;
  /// True if the candidate may be tested beside the effects chosen: it is not among them, its
  /// prerequisite is met, and a nominal term stands at its limit.
  [[nodiscard]] bool offers(std::size_t candidate) const;
  /// The model with one more effect, and without one of its own; nominal terms held anew.
  [[nodiscard]] ChannelModel with(const Chosen& effect) const;
  [[nodiscard]] ChannelModel without(std::size_t effect) const;
  /// Takes that residual for noise; the floor is the least that any had.
  void take_noise(Eigen::VectorXd residual);
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

/// What comparisons keep of the model.
Compared as_compared(const ChannelModel& model);

/// Held-out squared error of the model per block.
Eigen::VectorXd held_out_errors(const ChannelModel& model);

/// Twice the negative log of the prior: of one candidate with so many free numbers; more where it
/// is physics that the plant lacks; of a number of the plant with that relative change.
double effect_cost(Eigen::Index numbers);
double missing_cost(const EffectForm& form, const Series& series);
double number_cost(double change, double tolerance);
/// Numbers of a chosen effect that the data settle.
Eigen::Index freedom_of(const ChannelModel& model, const Chosen& chosen);
/// Of an effect with these coefficients: one of the former.
double cost_of(const ChannelModel& model, const Chosen& chosen,
               const Eigen::VectorXd& coefficients);
/// Of the effect chosen there. `coefficients` are the model's.
double chosen_cost(const ChannelModel& model, std::size_t effect,
                   const Eigen::VectorXd& coefficients);
/// Of the plant's numbers within their tolerances.
double nominal_cost(const ChannelModel& model, const Eigen::VectorXd& coefficients);
/// Of the whole model: numbers, effects, steps, constant.
double prior_cost(const ChannelModel& model, const Eigen::VectorXd& coefficients);

/// The model with its constant out of reach.
ChannelModel without_constant(const ChannelModel& model);

/// Twice the negative log of likelihood and the plant's numbers' prior: held-out squared error in
/// units of the noise, effects' own cost aside.
double score_of(const ChannelModel& model);

/// The same with the whole prior; least is likeliest. Models of one channel are compared in one
/// unit.
double penalised_score(const ChannelModel& model);
double penalised_score(const ChannelModel& model, double unit);

/// True if held-out errors per block cannot be told apart by two standard errors.
bool tied(const Eigen::VectorXd& a, const Eigen::VectorXd& b);

/// Blocks, noise and prior weights for a channel; `forms` must outlive the model.
ChannelModel prepare_channel(const Series& series, const Nominal& nominal, const Forms& forms);

/// Residual at the training rows of a model with every candidate in it, each with the shape that
/// alone helps most, held out; or of the model itself, if that predicts better.
Eigen::VectorXd saturated_noise(const ChannelModel& model);

/// Rows over which that noise resembles itself, drifts and steps aside.
double noise_memory(const ChannelModel& model, const Eigen::VectorXd& noise);

/// Evidence for an effect of the model, given all the others in it.
Evidence evidence_of(const ChannelModel& model, std::size_t chosen, const Gates& gates,
                     std::uint64_t seed);

/// Improves the shape of a continuous form from a start, beside the effects of the model.
Chosen refined(const ChannelModel& model, const Chosen& start);

}  // namespace ravencal::diagnose
