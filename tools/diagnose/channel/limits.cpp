// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "diagnose/channel/channel.hpp"
#include "diagnose/findings/quantiles.hpp"
#include "diagnose/fit/derived_seed.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Squared error to gain so that a gate at `bound` opens nine times in ten; `deviation` is that of
/// the gain's root.
double gain_for(double bound, double deviation) {
  return std::pow(std::sqrt(bound) + kNineInTen * deviation, 2);
}

/// Gain in squared error at which the gates of a screen open nine times in ten: chance (a squared
/// normal's median is 0.455 of its variance), size, share.
double gain_needed(const TestedCandidate& t, const ScreenResult& result, const ChannelModel& model,
                   const Gates& gates) {
  const double chance = t.inflation * gain_for(t.critical_gain, std::sqrt(t.median_null / 0.455));
  const auto rows = static_cast<double>(model.target.size());
  const double size = rows * std::pow(gates.size_per_floor * model.floor, 2);
  return std::max({chance, size, gates.least_share * result.errors.sum()});
}

/// How large an effect must be so that the plant's numbers cannot say it: all of them within their
/// tolerances, and any one of those that stand at their limit wherever it may be. A fit that has
/// settled holds some of them where the effect itself would have moved them.
class LeastSize {
 public:
  explicit LeastSize(const ChannelModel& model)
      : model_(model),
        columns_(model.columns()),
        precision_(model.column_precision(columns_.cols())),
        most_(VectorXd::Constant(columns_.cols(), std::numeric_limits<double>::infinity())),
        unit_(noise_unit(model)) {
    columns_.leftCols(model.free_base.cols()) = model.free_base;
    for (std::size_t term = 0; term < model.limit.size(); ++term)
      most_[static_cast<Index>(term) + 1] = model.limit[term];
    for (const auto& candidate : model.candidates) {
      if (const auto term = candidate->form->nominal_term()) numbers_.push_back(*term);
    }
    const Index k = columns_.cols();
    total_ = MatrixXd::Zero(k + 1, k + 1);
    total_.topLeftCorner(k, k) = columns_.transpose() * columns_;
  }

  /// Least multiple of a candidate's columns times `direction`; none where no multiple is enough.
  /// `gain`: what the gates ask for.
  std::optional<double> of(const Chosen& effect, const VectorXd& direction, double gain) {
    const VectorXd z = effect.columns * direction;
    cross_ = columns_.transpose() * z;
    energy_ = z.squaredNorm();
    if (!(energy_ > 0.0)) return std::nullopt;
    const auto enough = [&](double times) {
      return stands_out(effect, times * direction, times, gain);
    };
    double low = std::sqrt(gain / energy_);
    double high = low;
    for (int doubling = 0; !enough(high); ++doubling) {
      if (doubling == kMostDoublings) return std::nullopt;
      low = high;
      high *= 2.0;
    }
    for (int halving = 0; halving < 4 && low < high; ++halving) {
      const double middle = std::sqrt(low * high);
      (enough(middle) ? high : low) = middle;
    }
    return high;
  }

 private:
  /// From here on less than a hundredth of the column is not the model's own.
  static constexpr int kMostDoublings = 7;

  bool stands_out(const Chosen& effect, const VectorXd& coefficients, double times, double gain) {
    const Index k = columns_.cols();
    total_.col(k).head(k) = times * cross_;
    total_.row(k).head(k) = total_.col(k).head(k).transpose();
    total_(k, k) = times * times * energy_;
    const VectorXd b = solve_within(total_, precision_, most_);
    const double cost = cost_of(model_, effect, coefficients);
    if (squared_error(total_, b) < std::max(gain, gain_for(unit_ * cost, std::sqrt(unit_))))
      return false;
    return std::all_of(numbers_.begin(), numbers_.end(), [&](std::size_t term) {
      return std::abs(b[static_cast<Index>(term) + 1]) < model_.limit[term] || unlike(term, cost);
    });
  }

  /// That number of the plant beyond its tolerance is clearly less likely, against such odds.
  [[nodiscard]] bool unlike(std::size_t term, double odds) const {
    const Index column = static_cast<Index>(term) + 1;
    VectorXd precision = precision_;
    VectorXd most = most_;
    precision[column] = 0.0;
    most[column] = std::numeric_limits<double>::infinity();
    const VectorXd b = solve_within(total_, precision, most);
    const double against = odds - number_cost(b[column], model_.tolerance[term]);
    return squared_error(total_, b) >= gain_for(unit_ * std::max(0.0, against), std::sqrt(unit_));
  }

  const ChannelModel& model_;
  MatrixXd columns_;
  VectorXd precision_;
  VectorXd most_;
  double unit_;
  std::vector<std::size_t> numbers_;
  MatrixXd total_;  ///< moments of columns and effect
  VectorXd cross_;
  double energy_ = 0.0;
};

/// The effect's first parameter at so many times its column, in the direction in which it is seen
/// less well; none where a motor cannot be so far off.
std::optional<FormParameter> parameter_at(const ChannelModel& model, const Chosen& effect,
                                          double times) {
  const EffectForm& form = *model.candidates[effect.candidate]->form;
  std::optional<FormParameter> most;
  for (const double sign : {1.0, -1.0}) {
    const VectorXd coefficient = VectorXd::Constant(1, sign * times);
    if (form.off_by(coefficient) &&
        !form.inconsistency(*model.series, effect.shape, coefficient).empty())
      continue;
    FormParameter p = form.parameters(*model.series, effect.shape, coefficient).front();
    p.value = std::abs(p.value);
    if (!most || p.value > most->value) most = p;
  }
  return most;
}

/// Of several columns, in equal parts, the RMS.
std::optional<FormParameter> least_limit(const TestedCandidate& t, const ScreenResult& result,
                                         const ChannelModel& model, LeastSize& least,
                                         const Gates& gates) {
  const MatrixXd& z = t.best.columns;
  const VectorXd direction = (z.colwise().norm().array() + 1e-300).inverse().matrix().transpose();
  const auto times = least.of(t.best, direction, gain_needed(t, result, model, gates));
  if (!times) return std::nullopt;
  if (z.cols() == 1) return parameter_at(model, t.best, *times * direction[0]);
  const double rms = *times * (z * direction).norm() / std::sqrt(static_cast<double>(z.rows()));
  return FormParameter{"rms", rms, model.series->unit};
}

NotFound limit_of(const TestedCandidate& t, const ScreenResult& result, const ChannelModel& model,
                  LeastSize& least, const Gates& gates) {
  NotFound entry;
  entry.id = model.candidates[t.candidate]->form->id();
  entry.joint = model.series->joint;
  if (const auto limit = least_limit(t, result, model, least, gates)) {
    entry.parameter = limit->name;
    entry.detection_limit = limit->value;
    entry.unit = limit->unit;
  } else {
    entry.not_testable_because =
        "in this motion it looks, at any size that it can have, like what the plant's numbers or "
        "the effects already named can say";
  }
  return entry;
}

/// Why a candidate was not tested; empty if it was.
std::string not_tested_because(const FormCandidate& candidate, const ChannelModel& model) {
  if (!candidate.untestable.empty() || model.permits(*candidate.form)) return candidate.untestable;
  return "it changes " + candidate.form->prerequisite() +
         ", which neither the plant nor this recording shows";
}

/// What a step is found by does not tell a slip from lost counts.
void add_step_limits(const ChannelFit& fit, std::map<std::string, NotFound>& entries) {
  const ChannelModel& model = fit.model;
  const auto least = least_step(*model.series, model.blocks, model.noise, model.correlation_rows);
  for (const EffectKind* kind : effect_kinds()) {
    if (!kind->traits().step) continue;
    NotFound entry{kind->id(), model.series->joint, std::nullopt, model.series->unit, "", "size"};
    if (least)
      entry.detection_limit = std::max(*least, model.floor);
    else
      entry.not_testable_because = "too little was recorded in one go";
    entries.emplace(kind->id(), entry);
  }
}

}  // namespace

void add_limits(const ChannelFit& fit, const ChannelOptions& options, ChannelFindings& findings) {
  const ScreenResult result =
      screen(fit.model, options.gates, derived_seed(options.seed, "limits"));
  const auto named = [&](const std::string& id) {
    return std::any_of(findings.effects.begin(), findings.effects.end(),
                       [&](const NamedEffect& effect) { return effect.id == id; });
  };
  // One line per id: of several sources (couplings), the one that is seen least well.
  std::map<std::string, NotFound> worst;
  LeastSize least(fit.model);
  for (const TestedCandidate& t : result.tested) {
    const EffectForm& form = *fit.model.candidates[t.candidate]->form;
    if (named(form.id()) || form.nominal_term()) continue;
    NotFound entry = limit_of(t, result, fit.model, least, options.gates);
    auto [it, inserted] = worst.try_emplace(entry.id, entry);
    if (!inserted && entry.detection_limit && it->second.detection_limit &&
        *entry.detection_limit > *it->second.detection_limit) {
      it->second = entry;
    }
  }
  for (const auto& candidate : fit.model.candidates) {
    const std::string& id = candidate->form->id();
    const std::string why = not_tested_because(*candidate, fit.model);
    if (why.empty() || named(id) || worst.contains(id)) continue;
    worst.emplace(id, NotFound{id, findings.joint, std::nullopt, "", why});
  }
  const VectorXd deviation =
      nominal_deviation(fit, derived_seed(options.seed, "limits of numbers"));
  for (std::size_t i = 0; i < fit.nominal->terms.size(); ++i) {
    const NominalTerm& term = fit.nominal->terms[i];
    if (term.form_only || named(term.id) || worst.contains(term.id)) continue;
    const double change =
        (fit.model.limit[i] + (kNormal95 + kNineInTen) * deviation[static_cast<Index>(i)]) *
        std::abs(term.value);
    worst.emplace(term.id,
                  NotFound{term.id, findings.joint, change, term.unit, "", term.parameter});
  }
  if (findings.stage == Stage::kTransmission) add_step_limits(fit, worst);
  for (auto& [id, entry] : worst) {
    if (!named(id)) findings.not_found.push_back(std::move(entry));
  }
}

}  // namespace ravencal::diagnose
