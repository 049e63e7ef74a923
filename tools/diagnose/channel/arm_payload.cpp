// SPDX-License-Identifier: Apache-2.0
#include "diagnose/channel/arm_payload.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "diagnose/effects/effects.hpp"
#include "diagnose/findings/policy.hpp"
#include "diagnose/fit/derived_seed.hpp"
#include "diagnose/selection/search.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// Rise of a score (twice the negative log likelihood) at the ends of a 95 % interval.
constexpr double kRise95 = 3.84;

bool is_weight(const std::string& id) { return traits_of(id).weight != Weight::kNone; }

/// Penalised score of a drive; its constant is left out where it is not worth its cost.
double score_of_drive(const ChannelModel& model) {
  return std::min(penalised_score(without_constant(model)), penalised_score(model));
}

/// The model without what it took for a weight.
ChannelModel weightless(ChannelModel model) {
  for (std::size_t i = model.chosen.size(); i-- > 0;) {
    if (is_weight(model.candidates[model.chosen[i].candidate]->form->id()))
      model = model.without(i);
  }
  return model;
}

/// One drive as its own channel explains it, and without what it took for a weight.
class Joint {
 public:
  Joint(const ChannelFit& fit, const ChannelOptions& options)
      : options_(options), own_(fit.model), bare_({weightless(own_)}) {
    per_kg_ = own_.blocks.gather(seen_columns(*payload(), *fit.series, {})).col(0);
  }

  [[nodiscard]] double own() const { return score_of_drive(own_); }

  /// The model that is likeliest under that mass, before the mass is hung on it.
  [[nodiscard]] const ChannelModel& bare(double mass_kg) const {
    return *std::min_element(bare_.begin(), bare_.end(),
                             [&](const ChannelModel& a, const ChannelModel& b) {
                               return score_under(a, mass_kg) < score_under(b, mass_kg);
                             });
  }

  [[nodiscard]] ChannelModel loaded(ChannelModel model, double mass_kg) const {
    model.free_target -= mass_kg * per_kg_;
    model.hold_nominal();
    return model;
  }

  /// Effects that stood in for the weight may hide others: those chosen with it hung are a further
  /// model. All of them are judged against the least noise that any of them leaves.
  void choose_under(double mass_kg) {
    if (bare_.front().chosen.empty()) return;
    ChannelModel model = bare_.front();
    model.chosen.clear();
    for (auto& candidate : model.candidates) {
      if (candidate->form->traits().weight != Weight::kOnTool) continue;
      auto hung = std::make_shared<FormCandidate>(*candidate);
      hung->untestable = "it hangs";
      candidate = hung;
    }
    model = loaded(std::move(model), mass_kg);
    select_effects(model, options_.gates, options_.seed);
    model.free_target += mass_kg * per_kg_;
    model.hold_nominal();
    const VectorXd noise =
        model.noise.squaredNorm() < own_.noise.squaredNorm() ? model.noise : own_.noise;
    bare_.push_back(weightless(std::move(model)));
    for (ChannelModel& each : bare_) each.noise = noise;
    own_.noise = noise;
  }

  /// Of the likeliest model under that mass.
  [[nodiscard]] double score_under(double mass_kg) const {
    double least = std::numeric_limits<double>::infinity();
    for (const ChannelModel& model : bare_) least = std::min(least, score_under(model, mass_kg));
    return least;
  }

  /// Effects that the mass makes superfluous cost nothing.
  [[nodiscard]] double score_under(const ChannelModel& bare, double mass_kg) const {
    ChannelModel model = loaded(bare, mass_kg);
    double least = score_of_drive(model);
    for (std::size_t i = model.chosen.size(); i-- > 0;) {
      const ChannelModel fewer = model.without(i);
      const double without = score_of_drive(fewer);
      if (without > least) continue;
      least = without;
      model = fewer;
    }
    return least;
  }

  /// The mass that this joint alone would weigh, its constant left to the payload.
  [[nodiscard]] double own_mass_kg() const {
    ChannelModel model = without_constant(bare_.front());
    const Index column = model.free_base.cols();
    model.free_base.conservativeResize(Eigen::NoChange, column + 1);
    model.free_base.col(column) = per_kg_;
    model.precision.conservativeResize(column + 1);
    model.precision[column] = 0.0;
    model.hold_nominal();
    return joint_fit(model)[column];
  }

  /// How the mass that this joint weighs differs between circumstances.
  [[nodiscard]] double spread(double mass_kg) const {
    ChannelModel model = without_constant(bare(mass_kg));
    for (std::size_t c = 0; c < model.candidates.size(); ++c) {
      if (model.candidates[c]->form->traits().weight == Weight::kOnTool)
        model.chosen.push_back({c, {}, per_kg_});
    }
    model.hold_nominal();
    return invariance_of(model, joint_fit(model), model.chosen.size() - 1).spread;
  }

  /// RMS of the effort of a kilogram, as the channel shows it.
  [[nodiscard]] double effort_per_kg() const {
    return std::sqrt(per_kg_.squaredNorm() / static_cast<double>(per_kg_.size()));
  }

 private:
  const ChannelOptions& options_;
  ChannelModel own_;
  std::vector<ChannelModel> bare_;  ///< models that explain the drive beside a mass
  VectorXd per_kg_;
};

double score_of_all(const std::vector<Joint>& joints, double mass_kg) {
  double sum = effect_cost(1) + kMissingCost;
  for (const Joint& joint : joints) sum += joint.score_under(mass_kg);
  return sum;
}

/// Lets every joint choose its effects anew under the mass that each of them would weigh alone.
void choose_anew(std::vector<Joint>& joints) {
  std::vector<double> masses;
  masses.reserve(joints.size());
  for (const Joint& joint : joints) masses.push_back(joint.own_mass_kg());
  for (Joint& joint : joints) {
    for (const double mass : masses) joint.choose_under(mass);
  }
}

struct Weighed {
  double mass_kg = 0.0, deviation_kg = 0.0, score = std::numeric_limits<double>::infinity();
};

/// The likeliest mass about those that single joints propose, at the top of the parabola through
/// the three masses around it.
Weighed weigh(const std::vector<Joint>& joints, double least_kg) {
  constexpr int kMasses = 12;
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const Joint& joint : joints) {
    const double mass = joint.own_mass_kg();
    low = std::min(low, mass);
    high = std::max(high, mass);
  }
  const double reach = 0.25 * std::max(std::abs(low), std::abs(high));
  low = std::max(low - reach, least_kg);
  const double step = (high + reach - low) / (kMasses - 1);
  std::array<double, kMasses> scores{};
  for (int i = 0; i < kMasses; ++i) scores[i] = score_of_all(joints, low + i * step);
  const auto best = std::min_element(scores.begin() + 1, scores.end() - 1) - scores.begin();
  const double curvature = scores[best - 1] - 2.0 * scores[best] + scores[best + 1];
  if (!(curvature > 0.0)) return {};
  const double move =
      std::clamp(0.5 * (scores[best - 1] - scores[best + 1]) / curvature, -1.0, 1.0);
  const double mass = low + (static_cast<double>(best) + move) * step;
  return {mass, step * std::sqrt(2.0 / curvature), score_of_all(joints, mass)};
}

/// Held-out gains by that mass over the blocks of all joints, each in units of its noise.
VectorXd gains_by(const std::vector<Joint>& joints, double mass_kg) {
  std::vector<double> gains;
  for (const Joint& joint : joints) {
    const ChannelModel bare = without_constant(joint.bare(mass_kg));
    const VectorXd gain =
        (held_out_errors(bare) - held_out_errors(joint.loaded(bare, mass_kg))) / noise_unit(bare);
    gains.insert(gains.end(), gain.begin(), gain.end());
  }
  return Eigen::Map<const VectorXd>(gains.data(), static_cast<Index>(gains.size()));
}

/// By how much the mass makes the joints likelier, the one that it helps most left out: what one
/// joint alone says may be that joint's own.
double likelier_without_the_strongest(const std::vector<Joint>& joints, double mass_kg) {
  double sum = 0.0;
  double most = 0.0;
  for (const Joint& joint : joints) {
    const double gain = joint.own() - joint.score_under(mass_kg);
    sum += gain;
    most = std::max(most, gain);
  }
  return sum - most;
}

/// True if a drive named what may be that weight: a constant that it takes for friction, or a
/// heavier link.
bool names_instead(const ChannelFindings& drive) {
  return std::any_of(drive.effects.begin(), drive.effects.end(),
                     [](const NamedEffect& e) { return is_weight(e.id) || is_dry_asymmetry(e); });
}

NamedEffect named(const Joint& joint, const Weighed& found, std::uint64_t seed) {
  const ChannelModel bare = without_constant(joint.bare(found.mass_kg));
  const ChannelModel loaded = joint.loaded(bare, found.mass_kg);
  const VectorXd before = held_out_errors(bare), after = held_out_errors(loaded);
  NamedEffect effect;
  effect.id = payload_kind().id();
  effect.joint = bare.series->joint;
  effect.stage = stage_word(bare.series->stage);
  const double half_width =
      std::sqrt(kRise95) * std::hypot(found.deviation_kg, kModelForm * found.mass_kg);
  effect.parameters = {
      {"mass", found.mass_kg, "kg", {found.mass_kg - half_width, found.mass_kg + half_width}}};
  effect.held_out_before = bare.rms_of(before);
  effect.held_out_after = bare.rms_of(after);
  effect.unit = bare.series->unit;
  effect.p_value = sign_flip_p(before - after, seed);
  effect.size = std::abs(found.mass_kg) * joint.effort_per_kg();
  effect.invariance_spread = joint.spread(found.mass_kg);
  effect.separate_by = payload()->separate_by();
  return effect;
}

}  // namespace

std::optional<NamedEffect> payload_of_arm(const std::vector<std::unique_ptr<ChannelFit>>& drives,
                                          const std::vector<ChannelFindings>& findings,
                                          const ChannelOptions& options) {
  std::vector<Joint> joints;
  int instead = 0;
  double removable_mass_kg = 0.0;
  for (std::size_t i = 0; i < drives.size(); ++i) {
    if (!drives[i] || !payload()->untestable(*drives[i]->series).empty()) continue;
    joints.emplace_back(*drives[i], options);
    instead += names_instead(findings[i]) ? 1 : 0;
    removable_mass_kg = drives[i]->series->removable_mass_kg;
  }
  if (joints.size() < 2) return std::nullopt;
  choose_anew(joints);
  double own = 0.0;
  for (const Joint& joint : joints) own += joint.own();
  const Weighed found = weigh(joints, -removable_mass_kg);
  if (!(found.score < own) || std::abs(found.mass_kg) < 2.0 * found.deviation_kg)
    return std::nullopt;
  if (z_score(gains_by(joints, found.mass_kg)) < options.gates.least_z) return std::nullopt;
  if (instead == 0 && likelier_without_the_strongest(joints, found.mass_kg) < kClearScore)
    return std::nullopt;
  std::optional<NamedEffect> strongest;
  for (const Joint& joint : joints) {
    NamedEffect effect = named(joint, found, derived_seed(options.seed, "payload"));
    if (!strongest || held_out_share(effect) > held_out_share(*strongest)) strongest = effect;
  }
  strongest->probability = 1.0 / (1.0 + std::exp(-0.5 * (own - found.score)));
  return strongest;
}

void hang(const NamedEffect& found, SeriesSet& set) {
  for (Series& series : set.series) {
    if (series.stage != Stage::kDrive || series.payload_per_kg.size() == 0) continue;
    series.payload_kg = found.parameters.front().value;
    series.payload_effort = series.payload_kg * payload()->columns(series, {}).col(0);
  }
}

}  // namespace ravencal::diagnose
