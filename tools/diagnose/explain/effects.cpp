// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "diagnose/explain/models.hpp"
#include "diagnose/findings/combinations.hpp"
#include "diagnose/findings/effect_words.hpp"
#include "diagnose/findings/experiments.hpp"
#include "diagnose/findings/policy.hpp"
#include "diagnose/findings/quantiles.hpp"
#include "diagnose/findings/sides.hpp"
#include "diagnose/findings/words.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// A parameter as it is written, and how well it is known.
struct Estimate {
  const Parameter* parameter = nullptr;
  double deviation = 0.0;  ///< of x
  Index place = -1;        ///< in the covariance; -1: it was not fitted
};

class ReportedEffects {
 public:
  ReportedEffects(const Models& models, const View& view) : m_(models), view_(view) {
    const MatrixXd& covariance = m_.fitted.judgement.covariance;
    Index place = 0;
    const auto estimate = [&](const Parameter& fitted, const Parameter& written) {
      Estimate e{&written, 0.0, -1};
      if (!fitted.held) {
        e.place = place++;
        // What stays the plant's moves the others: that is part of what is not known.
        e.deviation = std::hypot(std::sqrt(std::max(0.0, covariance(e.place, e.place))),
                                 written.x - fitted.x);
      }
      return e;
    };
    for (std::size_t n = 0; n < m_.fitted.numbers.size(); ++n)
      numbers_.push_back(estimate(m_.fitted.numbers[n], m_.written.numbers[n]));
    for (const auto& [c, parameters] : m_.fitted.effects) {
      const auto written = m_.written.effects.find(c);
      const bool kept = written != m_.written.effects.end();
      for (std::size_t k = 0; k < parameters.size(); ++k) {
        const Estimate e = estimate(parameters[k], kept ? written->second[k] : parameters[k]);
        if (kept) effects_[c].push_back(e);
      }
    }
    if (m_.written.chosen.empty()) return;
    fitted_after_ = errors_of(m_.written, m_.training);
    if (&view_.rows != &m_.training) shown_after_ = errors_of(m_.written, view_.rows);
  }

  void fill(Report& report) const {
    for (const std::size_t c : m_.written.chosen) {
      const Candidate& candidate = m_.vocabulary.candidates[c];
      const std::vector<std::size_t> together = said_with(c);
      if (together.front() != c) continue;
      Model less = m_.written;
      for (const std::size_t other : together) less = without(less, m_.vocabulary, other);
      fit(m_.training, less);
      judge(m_.training, 0.0, less);
      if (!candidate.unnamed()) {
        report.effects.push_back(effect(c, less));
        continue;
      }
      // A shape that takes nothing of the rows that are shown is of the fitted ones alone.
      Unexplained found = unexplained(candidate, less);
      if (found.size > 0.0) report.unexplained.push_back(std::move(found));
    }
    add_refitted(report);
    add_combinations(report);
  }

 private:
  /// Of what is chosen, the wrong numbers of one effect and joint: directions of one place. Alone,
  /// what is no number.
  [[nodiscard]] std::vector<std::size_t> said_with(std::size_t c) const {
    const Candidate& candidate = m_.vocabulary.candidates[c];
    if (!candidate.opens) return {c};
    std::vector<std::size_t> out;
    for (const std::size_t other : m_.written.chosen) {
      const Candidate& one = m_.vocabulary.candidates[other];
      if (one.opens && one.id == candidate.id && one.joint == candidate.joint) out.push_back(other);
    }
    return out;
  }

  /// RMS of each channel; moments are those of the rows that were fitted.
  [[nodiscard]] std::vector<double> errors_of(const Model& model, const Likelihood& rows) const {
    State state = rows.base();
    state.plant = plant_of(model, m_.training);
    take_laws(model.state_for(m_.training), state);
    for (const auto& [c, parameters] : model.effects)
      for (const Parameter& p : parameters)
        if (p.shape || (p.recording && &rows == &m_.training)) p.apply(state);
    const Left left = left_by(state, rows);
    std::vector<double> out;
    for (std::size_t c = 0; c < left.residuals.size(); ++c)
      out.push_back(rms(rows.channels()[c], left.residuals[c]));
    return out;
  }

  /// An effect's error in the channel in which it takes most of it, in floors.
  struct Taken {
    const Channel* channel = nullptr;
    double before = 0.0, after = 0.0;

    [[nodiscard]] double size() const {
      return std::sqrt(std::max(0.0, before * before - after * after));
    }
  };

  /// Where it takes most of what was fitted, on the rows of the view.
  [[nodiscard]] Taken taken_by(const Candidate& candidate, const Model& less) const {
    // Recordings that no fit saw have moments of their own.
    const bool fitted = candidate.of_recording();
    const Likelihood& rows = fitted ? m_.training : view_.rows;
    const std::vector<double> before_fitted = errors_of(less, m_.training);
    const std::size_t c = channel_of(candidate, before_fitted, rows);
    const bool same = &rows == &m_.training;
    return {&rows.channels()[c], same ? before_fitted[c] : errors_of(less, rows)[c],
            (same ? fitted_after_ : shown_after_)[c]};
  }

  /// Of its own joint where that shows it: what it takes there is what is said of it.
  [[nodiscard]] std::size_t channel_of(const Candidate& candidate,
                                       const std::vector<double>& before,
                                       const Likelihood& shown) const {
    std::size_t most = 0;
    double greatest = -1e300;
    for (const bool own_joint : {true, false}) {
      for (std::size_t c = 0; c < before.size(); ++c) {
        const Channel& channel = m_.training.channels()[c];
        const double floors = (before[c] * before[c] - fitted_after_[c] * fitted_after_[c]) /
                              std::pow(channel.floor, 2);
        if ((own_joint && channel.joint != candidate.joint) || !(floors > greatest)) continue;
        if (used_row_count(shown.channels()[c]) == 0) continue;
        greatest = floors;
        most = c;
      }
      if (greatest > 0.0) break;
    }
    return most;
  }

  [[nodiscard]] NamedEffect effect(std::size_t c, const Model& less) const {
    const Candidate& candidate = m_.vocabulary.candidates[c];
    const Taken taken = taken_by(candidate, less);
    NamedEffect out;
    out.id = candidate.id;
    out.joint = m_.given.joints[candidate.joint].name;
    out.from = candidate.from;
    out.stage = stage_of(*taken.channel);
    out.unit = unit_of(*taken.channel, m_.given);
    out.held_out_before = taken.before;
    out.held_out_after = taken.after;
    out.of_fitted_rows = candidate.of_recording() || !view_.held_out;
    out.size = taken.size();
    // Ratio of the likelihoods: a bound on the chance of such data without the effect.
    const double gain = (less.judgement.loss - m_.written.judgement.loss) / m_.search.dispersion() +
                        less.prior() - m_.written.prior();
    out.p_value = std::exp(-0.5 * std::max(0.0, gain));
    out.out_of_tolerance = candidate.wrong_number;
    out.beyond_plants = candidate.beyond_plants();
    out.parameters = parameters_of(c);
    out.sides = sides_of(words_for(candidate.id), sensing_of(candidate.joint));
    add_rivals(candidate, out);
    return out;
  }

  [[nodiscard]] Sensing sensing_of(std::size_t joint) const {
    const std::vector<physics::Effect>& effects = m_.improved.joints[joint].effects;
    const bool yields = std::any_of(effects.begin(), effects.end(), [](const auto& effect) {
      return words_for(effect.id).seat == Seat::kBetween;
    });
    return {shown(m_.training, joint, "transmission"), yields,
            m_.given.joints[joint].gearbox_ratio > 1.0};
  }

  [[nodiscard]] bool holds(const Model& model, const Candidate& candidate) const {
    return std::any_of(model.chosen.begin(), model.chosen.end(), [&](std::size_t c) {
      const Candidate& other = m_.vocabulary.candidates[c];
      return other.id == candidate.id && other.joint == candidate.joint;
    });
  }

  /// Probability of the name by the weights of all models, and the likeliest others without which
  /// the set does not hold the truth at 95 %.
  void add_rivals(const Candidate& candidate, NamedEffect& effect) const {
    double all = 0.0, with_it = 0.0;
    std::map<std::string, double> instead;
    for (const Model* model : m_.search.ranked()) {
      const double weight = std::exp(-0.5 * (model->judgement.score - m_.best.judgement.score));
      all += weight;
      if (holds(*model, candidate)) {
        with_it += weight;
        continue;
      }
      for (const std::size_t other : model->chosen)
        if (!m_.best.chosen.contains(other)) instead[m_.vocabulary.candidates[other].id] += weight;
    }
    effect.probability = with_it / all;
    instead.erase(candidate.id);
    std::vector<std::pair<double, std::string>> order;
    for (const auto& [id, weight] : instead) order.emplace_back(weight / all, id);
    std::sort(order.rbegin(), order.rend());
    double held = *effect.probability;
    for (const auto& [share, id] : order) {
      if (held >= kCredible) break;
      held += share;
      effect.ambiguous_with.push_back(id);
    }
    const EffectWords& words = words_for(candidate.id);
    for (const std::string_view id : words.look_alikes)
      add_once(effect.ambiguous_with, std::string(id));
    if (m_.given.joints.size() == 1)
      for (const std::string_view id : words.look_alikes_on_one_joint)
        add_once(effect.ambiguous_with, std::string(id));
    if (!effect.ambiguous_with.empty())
      effect.separate_by = experiment_that_parts(effect.id, effect.ambiguous_with);
  }

  static NamedParameter named(const Estimate& e) {
    const Parameter& p = *e.parameter;
    const double half = kNormal95 * e.deviation * std::abs(p.slope());
    return {p.name, p.value(), p.unit, {p.value() - half, p.value() + half}};
  }

  [[nodiscard]] std::vector<NamedParameter> parameters_of(std::size_t c) const {
    const Candidate& candidate = m_.vocabulary.candidates[c];
    std::vector<NamedParameter> out;
    if (candidate.opens) {
      for (const std::size_t said : said_with(c))
        out.push_back(named(numbers_[*m_.vocabulary.candidates[said].opens]));
      return out;
    }
    const std::vector<Estimate>& list = effects_.at(c);
    for (std::size_t k = 0; k < list.size(); ++k) {
      const Parameter& p = *list[k].parameter;
      if (p.name == "sine") {
        add_wave(list[k], list[k + 1], out);
        ++k;
      } else if (p.said) {
        out.push_back(named(list[k]));
      }
    }
    return out;
  }

  void add_wave(const Estimate& sine, const Estimate& cosine,
                std::vector<NamedParameter>& out) const {
    const Eigen::Vector2d at(sine.parameter->value(), cosine.parameter->value());
    const double amplitude = std::max(at.norm(), 1e-300);
    const Eigen::Matrix2d covariance =
        m_.fitted.judgement.covariance.block<2, 2>(sine.place, sine.place) * sine.parameter->scale *
        cosine.parameter->scale;
    const double half = kNormal95 *
                        std::sqrt(std::max(0.0, (at.transpose() * covariance * at).value())) /
                        amplitude;
    out.push_back(
        {"amplitude", amplitude, sine.parameter->unit, {amplitude - half, amplitude + half}});
    const double phase = std::atan2(at[1], at[0]);
    const double phase_half = std::min(half / amplitude, std::numbers::pi);
    out.push_back({"phase", phase, "rad", {phase - phase_half, phase + phase_half}});
  }

  [[nodiscard]] Unexplained unexplained(const Candidate& candidate, const Model& less) const {
    const Taken taken = taken_by(candidate, less);
    Unexplained out;
    out.joint = m_.given.joints[candidate.joint].name;
    out.stage = stage_of(*taken.channel);
    out.unit = unit_of(*taken.channel, m_.given);
    out.size = taken.size();
    out.share_of_excess = taken.before > 0.0 ? std::pow(out.size / taken.before, 2) : 0.0;
    out.depends_on = {candidate.circumstance};
    return out;
  }

  /// Numbers of the plant that moved within their tolerance.
  void add_refitted(Report& report) const {
    const std::set<std::size_t> opened = opened_by(m_.written, m_.vocabulary);
    for (std::size_t n = 0; n < numbers_.size(); ++n) {
      const Parameter& p = m_.moved.numbers[n];
      if (!p.in_plant || p.held || opened.contains(n)) continue;
      NamedEffect out;
      out.id = p.effect;
      out.joint = m_.given.joints[p.joint].name;
      out.parameters = {named({&p, numbers_[n].deviation, numbers_[n].place})};
      report.refitted.push_back(std::move(out));
    }
  }

  /// Of parameters of one joint that are named.
  void add_combinations(Report& report) const {
    for (std::size_t j = 0; j < m_.given.joints.size(); ++j) {
      std::vector<CombinedParameter> parameters;
      std::vector<Index> places;
      std::vector<double> logs, slopes;
      std::string stage;
      for (const std::size_t c : m_.written.chosen) {
        const Candidate& candidate = m_.vocabulary.candidates[c];
        if (candidate.joint != j || candidate.unnamed() || candidate.opens) continue;
        for (const Estimate& e : effects_.at(c)) {
          const double value = e.parameter->value();
          if (e.place < 0 || !(value > 0.0) || !e.parameter->said) continue;
          parameters.push_back({candidate.id, e.parameter->name});
          places.push_back(e.place);
          logs.push_back(std::log(value));
          slopes.push_back(e.parameter->slope() / value);
        }
        stage = std::string(words_for(candidate.id).stage);
      }
      const auto count = static_cast<Index>(places.size());
      const auto per_x = Eigen::Map<const VectorXd>(slopes.data(), count).asDiagonal();
      const MatrixXd covariance = per_x * m_.fitted.judgement.covariance(places, places) * per_x;
      auto found =
          combination_of(parameters, Eigen::Map<const VectorXd>(logs.data(), count), covariance);
      if (!found) continue;
      found->joint = m_.given.joints[j].name;
      found->stage = stage;
      report.combinations.push_back(std::move(*found));
    }
  }

  const Models& m_;
  const View& view_;
  std::vector<Estimate> numbers_;
  std::map<std::size_t, std::vector<Estimate>> effects_;
  /// What the written model leaves of the rows that were fitted and, where they are others, of
  /// those of the view.
  std::vector<double> fitted_after_, shown_after_;
};

}  // namespace

void add_effects(const Models& models, const View& view, Report& report) {
  ReportedEffects(models, view).fill(report);
}

}  // namespace ravencal::diagnose
