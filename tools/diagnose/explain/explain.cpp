// SPDX-License-Identifier: Apache-2.0
#include "diagnose/explain/explain.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <set>

#include "diagnose/search/search.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using record::Recording;

constexpr double kEver = std::numeric_limits<double>::infinity();
/// Models this much behind the best may be what is there (20 : 1).
constexpr double kMayBe = 6.0;
constexpr double kNormal95 = 1.96;

core::Result<std::vector<Track>> tracks_of(const std::vector<Recording>& recordings,
                                           const physics::Plant& plant, double from_s,
                                           double to_s) {
  std::vector<Track> tracks;
  for (const Recording& recording : recordings) {
    RAVENCAL_ASSIGN_OR_RETURN(Track track, make_track(recording, plant, from_s, to_s));
    tracks.push_back(std::move(track));
  }
  return tracks;
}

std::string stage_of(ChannelKind kind) {
  switch (kind) {
    case ChannelKind::kPosition:
      return "transmission";
    case ChannelKind::kDrive:
      return "drive";
    case ChannelKind::kLaw:
      break;
  }
  return "command";
}

/// What a report says of the best model and those beside it.
class Explanation {
 public:
  Explanation(const physics::Plant& plant, Likelihood& training, Likelihood* held_out,
              Vocabulary& vocabulary, const Search& search)
      : plant_(plant),
        training_(training),
        shown_(held_out != nullptr ? *held_out : training),
        own_(held_out == nullptr),
        vocabulary_(vocabulary),
        dispersion_(search.dispersion()),
        ranked_(search.ranked()),
        best_(*ranked_.front()),
        errors_(errors_of(best_)) {}

  void fill(Report& report) const {
    for (const std::size_t c : best_.chosen) {
      const Candidate& candidate = vocabulary_.candidates[c];
      Model less = without(best_, vocabulary_, c);
      fit(training_, less);
      judge(training_, dispersion_, 0.0, less);
      if (candidate.unnamed())
        report.unexplained.push_back(unexplained(candidate, less));
      else
        report.effects.push_back(effect(c, less));
    }
    Model nothing;
    nothing.numbers = vocabulary_.numbers;
    add_held_out(nothing, report);
    add_refitted(report);
  }

 private:
  /// Used rows of residuals of each channel of the shown recordings, as RMS.
  [[nodiscard]] std::vector<double> errors_of(const Model& model) const {
    const State state = own_ ? model.state_for(training_) : model.state_elsewhere(shown_);
    const auto left = shown_.residuals(state, shown_.outcome(state));
    std::vector<double> out;
    for (std::size_t c = 0; c < left.size(); ++c) {
      double squares = 0.0, rows = 0.0;
      for (std::size_t r = 0; r < left[c].size(); ++r) {
        const std::vector<Index>& used = shown_.channels()[c].used[r];
        squares += left[c][r](used).squaredNorm();
        rows += static_cast<double>(used.size());
      }
      out.push_back(rows > 0.0 ? std::sqrt(squares / rows) : 0.0);
    }
    return out;
  }

  /// The channel in which an effect counts most: where most of the error goes, in floors.
  [[nodiscard]] std::size_t channel_of(const std::vector<double>& before,
                                       const std::vector<double>& after) const {
    std::size_t at = 0;
    double greatest = -1.0;
    for (std::size_t c = 0; c < before.size(); ++c) {
      const double taken =
          (before[c] * before[c] - after[c] * after[c]) / std::pow(shown_.channels()[c].floor, 2);
      if (taken > greatest) {
        greatest = taken;
        at = c;
      }
    }
    return at;
  }

  [[nodiscard]] std::string unit_of(const Channel& channel) const {
    const bool prismatic = plant_.joints[channel.joint].kind == physics::JointKind::kPrismatic;
    if (channel.kind == ChannelKind::kPosition) return prismatic ? "m" : "rad";
    return prismatic ? "N" : "N_m";
  }

  [[nodiscard]] double weight_of(const Model& model) const {
    return std::exp(-0.5 * (model.judgement.score - best_.judgement.score));
  }

  [[nodiscard]] bool holds(const Model& model, const Candidate& candidate) const {
    return std::any_of(model.chosen.begin(), model.chosen.end(), [&](std::size_t c) {
      const Candidate& other = vocabulary_.candidates[c];
      return other.id == candidate.id && other.joint == candidate.joint;
    });
  }

  [[nodiscard]] NamedEffect effect(std::size_t c, const Model& less) const {
    const Candidate& candidate = vocabulary_.candidates[c];
    const std::vector<double> before = errors_of(less);
    const std::vector<double>& after = errors_;
    const std::size_t at = channel_of(before, after);
    const Channel& channel = shown_.channels()[at];
    NamedEffect out;
    out.id = candidate.id;
    out.joint = plant_.joints[candidate.joint].name;
    out.from = candidate.from;
    out.stage = stage_of(channel.kind);
    out.unit = unit_of(channel);
    out.held_out_before = before[at];
    out.held_out_after = after[at];
    out.size = std::sqrt(std::max(0.0, before[at] * before[at] - after[at] * after[at]));
    // Ratio of the likelihoods: a bound on the chance of such data without the effect.
    const double gain = (less.judgement.loss - best_.judgement.loss) / dispersion_;
    out.p_value = std::exp(-0.5 * std::max(0.0, gain));
    out.out_of_tolerance = candidate.wrong_number;
    out.parameters = parameters_of(c);
    double all = 0.0, with_it = 0.0;
    std::set<std::string> instead;
    for (const Model* model : ranked_) {
      const double weight = weight_of(*model);
      all += weight;
      if (holds(*model, candidate)) {
        with_it += weight;
      } else if (model->judgement.score < best_.judgement.score + kMayBe) {
        for (const std::size_t other : model->chosen)
          if (!best_.chosen.contains(other)) instead.insert(vocabulary_.candidates[other].id);
      }
    }
    out.probability = with_it / all;
    instead.erase(candidate.id);
    out.ambiguous_with.assign(instead.begin(), instead.end());
    return out;
  }

  [[nodiscard]] std::vector<NamedParameter> parameters_of(std::size_t c) const {
    const Candidate& candidate = vocabulary_.candidates[c];
    std::vector<NamedParameter> out;
    const std::vector<const Parameter*> free = best_.free();
    const auto add = [&](const Parameter& p, double deviation) {
      out.push_back({p.name,
                     p.value(),
                     p.unit,
                     {p.value() - kNormal95 * deviation, p.value() + kNormal95 * deviation}});
    };
    std::size_t sine = free.size();
    for (std::size_t k = 0; k < free.size(); ++k) {
      const Parameter& p = *free[k];
      const bool mine = candidate.opens ? &p == &best_.numbers[*candidate.opens] : is_of(c, p);
      if (!mine || p.name == "start") continue;
      if (p.name == "sine") sine = k;
      if (p.name == "sine" || p.name == "cosine") continue;
      add(p, deviation_of(k) * p.slope());
    }
    if (sine < free.size()) add_wave(*free[sine], *free[sine + 1], sine, out);
    for (const Parameter& p : held_of(c)) add(p, 0.0);
    return out;
  }

  [[nodiscard]] double deviation_of(std::size_t k) const {
    const auto i = static_cast<Index>(k);
    return std::sqrt(std::max(0.0, best_.judgement.covariance(i, i)));
  }

  void add_wave(const Parameter& sine, const Parameter& cosine, std::size_t k,
                std::vector<NamedParameter>& out) const {
    const auto i = static_cast<Index>(k);
    const Eigen::Vector2d at(sine.value(), cosine.value());
    const double amplitude = std::max(at.norm(), 1e-300);
    const Eigen::Matrix2d covariance =
        best_.judgement.covariance.block<2, 2>(i, i) * sine.scale * cosine.scale;
    const double deviation =
        std::sqrt(std::max(0.0, (at.transpose() * covariance * at).value())) / amplitude;
    out.push_back({"amplitude",
                   amplitude,
                   sine.unit,
                   {amplitude - kNormal95 * deviation, amplitude + kNormal95 * deviation}});
    const double phase = std::atan2(at[1], at[0]);
    out.push_back({"phase", phase, "rad", {phase, phase}});
  }

  [[nodiscard]] bool is_of(std::size_t c, const Parameter& p) const {
    const std::vector<Parameter>& list = best_.effects.at(c);
    return !list.empty() && &p >= list.data() && &p < list.data() + list.size();
  }

  [[nodiscard]] std::vector<Parameter> held_of(std::size_t c) const {
    std::vector<Parameter> out;
    const auto list = best_.effects.find(c);
    if (list == best_.effects.end()) return out;
    for (const Parameter& p : list->second)
      if (p.held) out.push_back(p);
    return out;
  }

  [[nodiscard]] Unexplained unexplained(const Candidate& candidate, const Model& less) const {
    const std::vector<double> before = errors_of(less);
    const std::vector<double>& after = errors_;
    const std::size_t at = channel_of(before, after);
    const Channel& channel = shown_.channels()[at];
    Unexplained out;
    out.joint = plant_.joints[candidate.joint].name;
    out.stage = stage_of(channel.kind);
    out.unit = unit_of(channel);
    const double taken = std::max(0.0, before[at] * before[at] - after[at] * after[at]);
    out.size = std::sqrt(taken);
    out.share_of_excess = before[at] > 0.0 ? taken / (before[at] * before[at]) : 0.0;
    out.depends_on = {candidate.circumstance};
    return out;
  }

  /// The plant as it was given against the plant that is written.
  void add_held_out(const Model& nothing, Report& report) const {
    const std::vector<double> before = errors_of(nothing);
    const std::vector<double>& after = errors_;
    for (std::size_t c = 0; c < before.size(); ++c) {
      const Channel& channel = shown_.channels()[c];
      if (channel.kind == ChannelKind::kLaw) continue;
      HeldOut out;
      out.joint = plant_.joints[channel.joint].name;
      out.metric = channel.kind == ChannelKind::kPosition ? "position_rmse" : "effort_rmse";
      out.unit = unit_of(channel);
      out.before = before[c];
      out.after = after[c];
      out.floor = channel.floor;
      report.held_out.push_back(std::move(out));
    }
  }

  /// Numbers of the plant that moved within their tolerance.
  void add_refitted(Report& report) const {
    const std::vector<const Parameter*> free = best_.free();
    for (std::size_t k = 0; k < best_.numbers.size(); ++k) {
      const Parameter& p = *free[k];
      if (p.recording || plant_.joints[p.joint].find_effect(p.effect) == nullptr) continue;
      const bool opened = std::any_of(best_.chosen.begin(), best_.chosen.end(), [&](std::size_t c) {
        return vocabulary_.candidates[c].opens == k;
      });
      if (opened) continue;
      NamedEffect out;
      out.id = p.effect;
      out.joint = plant_.joints[p.joint].name;
      const double deviation = deviation_of(k) * p.slope();
      out.parameters = {{p.name,
                         p.value(),
                         p.unit,
                         {p.value() - kNormal95 * deviation, p.value() + kNormal95 * deviation}}};
      report.refitted.push_back(std::move(out));
    }
  }

  const physics::Plant& plant_;
  Likelihood& training_;
  Likelihood& shown_;
  bool own_;
  const Vocabulary& vocabulary_;
  double dispersion_;
  std::vector<const Model*> ranked_;
  const Model& best_;
  std::vector<double> errors_;  ///< of the best model
};

}  // namespace

core::Result<Report> explain(const std::vector<Recording>& training,
                             const std::vector<Recording>& held_out, const physics::Plant& plant,
                             const ExplainOptions& options) {
  const double split_s = options.held_out_from_s.value_or(kEver);
  RAVENCAL_ASSIGN_OR_RETURN(std::vector<Track> seen, tracks_of(training, plant, 0.0, split_s));
  std::vector<Track> unseen;
  if (!held_out.empty()) {
    RAVENCAL_ASSIGN_OR_RETURN(unseen, tracks_of(held_out, plant, 0.0, kEver));
  } else if (options.held_out_from_s) {
    RAVENCAL_ASSIGN_OR_RETURN(unseen, tracks_of(training, plant, split_s, kEver));
  }
  Likelihood fitted(plant, std::move(seen));
  std::optional<Likelihood> shown;
  if (!unseen.empty()) shown.emplace(plant, std::move(unseen), &fitted);
  Likelihood* elsewhere = shown ? &*shown : nullptr;
  Vocabulary vocabulary = vocabulary_of(plant, fitted, elsewhere);
  Search search(fitted, elsewhere, vocabulary, options.seed);
  bool stopped = false;
  search.run([&] {
    if (options.look && !options.look(0.5, "models")) stopped = true;
    return !stopped;
  });
  if (stopped) {
    return core::Error{core::ErrorCode::kUsage,
                       "stopped before the diagnosis was complete; nothing was written"};
  }
  if (elsewhere != nullptr) elsewhere->take_noise(fitted);
  Report report;
  Explanation(plant, fitted, elsewhere, vocabulary, search).fill(report);
  return report;
}

}  // namespace ravencal::diagnose
