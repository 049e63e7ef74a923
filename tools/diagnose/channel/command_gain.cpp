// SPDX-License-Identifier: Apache-2.0
#include "diagnose/channel/command_gain.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <utility>

#include "diagnose/channel/control_law.hpp"
#include "diagnose/effects/effects.hpp"
#include "diagnose/findings/policy.hpp"
#include "diagnose/findings/quantiles.hpp"
#include "diagnose/fit/sign_flip.hpp"
#include "diagnose/selection/posterior.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Stretches of time as observations: more patterns of signs than any share of the report's error
/// rate asks for, 2^23.
constexpr Index kSegments = 24;

/// Rows of a segment per row that a difference spans: neighbours share its noise.
constexpr Index kRowsPerLag = 3;

/// Ratios beyond this are no limit: gains are set to some digits, not to their order.
constexpr double kMostOffset = 64.0;

/// Segments of time that say equally much: by how much each pulls the ratio up, and its share of
/// what a ratio too low pulls.
struct Segments {
  VectorXd pull, share;
  [[nodiscard]] Index count() const { return pull.size(); }
  /// Chance of these pulls if the ratio were lower by `offset` than what was found.
  [[nodiscard]] double chance_at(double offset) const {
    return exact_sign_flip_p(pull + offset * share);
  }
};

Segments segments_of(const ControlLaw& law, double nominal) {
  const double all = law.worth.sum();
  double to_come = law.worth.cwiseMax(0.0).sum();
  std::vector<double> pull, share;
  double so_far = 0.0, pulls = 0.0, worth = 0.0;
  Index rows = 0;
  for (Index i = 0; i < law.pull.size() && all > 0.0; ++i) {
    pulls += law.pull[i] / (nominal * all);
    worth += law.worth[i] / all;
    so_far += std::max(0.0, law.worth[i]);
    ++rows;
    const bool last = i + 1 == law.pull.size();
    const auto missing = static_cast<double>(kSegments) - static_cast<double>(pull.size());
    // A single row may be worth several segments: the others share what is to come. Rows that are
    // worth nothing are no observation, however many they are.
    const bool enough = so_far > 0.0 && missing > 0.0 && so_far * missing >= to_come;
    const bool full = enough && rows >= kRowsPerLag * law.lag;
    if (!full && !last) continue;
    if (full || pull.empty()) {
      pull.push_back(pulls);
      share.push_back(worth);
    } else {  // what is left over at the end
      pull.back() += pulls;
      share.back() += worth;
    }
    to_come -= so_far;
    so_far = pulls = worth = 0.0;
    rows = 0;
  }
  const auto count = static_cast<Index>(pull.size());
  return {Eigen::Map<const VectorXd>(pull.data(), count),
          Eigen::Map<const VectorXd>(share.data(), count)};
}

/// Levels of a stretch at the usable rows, without what a controller may add to its law: a constant
/// and, of an arm, the weight of its links.
class Levels {
 public:
  Levels(const Series& s, const CommandStretch& stretch, const std::vector<char>& usable) {
    for (Index i = stretch.first; i < stretch.last; ++i) {
      if (usable[static_cast<std::size_t>(i)] != 0) rows_.push_back(i);
    }
    fed_forward_ = MatrixXd::Ones(count(), s.weight.size() > 0 ? 2 : 1);
    for (Index r = 0; r < count() && fed_forward_.cols() > 1; ++r)
      fed_forward_(r, 1) = s.weight[rows_[static_cast<std::size_t>(r)]];
    if (count() > 0) solver_.compute(fed_forward_);
  }
  [[nodiscard]] Index count() const { return static_cast<Index>(rows_.size()); }
  [[nodiscard]] VectorXd of(const VectorXd& full) const {
    VectorXd x(count());
    for (Index r = 0; r < count(); ++r) x[r] = full[rows_[static_cast<std::size_t>(r)]];
    return x - fed_forward_ * solver_.solve(x);
  }

 private:
  std::vector<Index> rows_;
  MatrixXd fed_forward_;
  Eigen::ColPivHouseholderQR<MatrixXd> solver_;
};

double rms_of(const VectorXd& x) {
  return x.norm() / std::sqrt(std::max(1.0, static_cast<double>(x.size())));
}

class GainStudy {
 public:
  GainStudy(const Series& s, const CommandStretch& stretch, const std::vector<char>& usable,
            const GainQuestion& question)
      : series_(s),
        stretch_(stretch),
        ask_(question),
        law_(fit_law(s, stretch.first, stretch.last, Disturbance::kNone)),
        segments_(segments_of(law_, question.nominal)),
        ratio_(law_.gains[0] / question.nominal) {
    const Levels levels(s, stretch, usable);
    left_ = levels.of(law_.residual);
    asked_ = question.nominal * levels.of(s.position_error);
    const double whole = rms_of(left_ + levels.of(s.y - law_.residual));
    const double level = 1.0 - std::pow(rms_of(left_) / std::max(whole, 1e-300), 2);
    explained_ = std::clamp(level, 0.0, law_.explained);
    // No repetition averages out that a converter that cuts towards zero takes half a step off each
    // command, or that inputs which are not the controller's own pull a gain towards zero by the
    // share of the changes that they leave (errors in variables: Fuller 1987). Steps are left too.
    const double mean = s.y.segment(stretch.first, stretch.last - stretch.first).cwiseAbs().mean();
    bend_ = std::max(0.5 * resolution_of(s) / std::max(mean, 1e-300), 1.0 - law_.explained);
    const auto count = static_cast<double>(std::max<Index>(2, segments_.count()));
    deviation_ = segments_.pull.norm() * std::sqrt(count / (count - 1.0));
    half_width_ = kNormal95 * student_per_normal95(count - 1.0) * deviation_;
  }

  [[nodiscard]] GainAnswer answer() const {
    GainAnswer answer;
    answer.untestable = untestable();
    if (!answer.untestable.empty()) return answer;
    if (named()) {
      answer.effect = effect();
    } else if (ask_.details) {
      answer.limit = limit();
      if (!answer.limit) answer.untestable = "stretches of its command disagree about the gain";
    }
    return answer;
  }

 private:
  [[nodiscard]] std::string untestable() const {
    if (explained_ < kLeastExplained) return unexplained(explained_);
    if (least_exact_p(segments_.count()) > ask_.chance)
      return fmt::format("the position error moves the command in {} stretches of time only",
                         segments_.count());
    if (bend_ >= 1.0) return "its command is not larger than the converter's steps";
    return "";
  }

  /// How far the ratio is off beyond what its tolerance and what bends it account for.
  [[nodiscard]] double beyond() const {
    return std::abs(ratio_ - 1.0) - ask_.tolerance - bend_ * std::abs(ratio_);
  }
  /// Chance of what was found if the ratio were that much nearer to 1.
  [[nodiscard]] double chance(double offset) const {
    return segments_.chance_at(ratio_ > 1.0 ? offset : -offset);
  }
  /// RMS that the law leaves with the plant's gain, were the ratio `offset` beyond it.
  [[nodiscard]] double left_by_plant(double offset) const {
    return rms_of(left_ + offset * asked_);
  }

  [[nodiscard]] bool named() const {
    return beyond() > 0.0 && chance(beyond()) <= ask_.chance &&
           rms_of(left_) < kMostLeftOfGain * left_by_plant(ratio_ - 1.0);
  }

  /// True if a ratio is named which was found so far beyond its tolerance, to the side where it is
  /// seen less well.
  [[nodiscard]] bool seen(double beyond) const {
    const double off = off_by(beyond);
    const auto shows = [&](double side) {
      return segments_.chance_at(side * beyond) <= ask_.chance &&
             rms_of(left_) < kMostLeftOfGain * left_by_plant(side * off);
    };
    return shows(1.0) && shows(-1.0);
  }
  /// What bends a gain grows with it.
  [[nodiscard]] double off_by(double beyond) const {
    return (ask_.tolerance + bend_ + beyond) / (1.0 - bend_);
  }

  [[nodiscard]] std::optional<double> limit() const {
    double low = half_width_;
    double high = std::max(low, 1e-3 * ask_.tolerance);
    for (; !seen(high); high *= 2.0) {
      if (high > kMostOffset) return std::nullopt;
      low = high;
    }
    for (int halving = 0; halving < 10; ++halving) {
      const double middle = 0.5 * (low + high);
      (seen(middle) ? high : low) = middle;
    }
    return off_by(high + kNineInTen * deviation_);
  }

  [[nodiscard]] NamedEffect effect() const {
    NamedEffect effect;
    effect.id = controller_gain_kind().id();
    effect.joint = series_.joint;
    effect.stage = stage_word(series_.stage);
    const double error = half_width_ + std::max(bend_, kGainTolerance) * std::abs(ratio_);
    const std::string which =
        stretch_.number == 0 ? "" : fmt::format("_recording_{}", stretch_.number);
    effect.parameters = {{"ratio" + which, ratio_, "1", {ratio_ - error, ratio_ + error}}};
    effect.unit = series_.unit;
    effect.held_out_after = rms_of(left_);
    effect.held_out_before = left_by_plant(ratio_ - 1.0);
    effect.p_value = chance(beyond());
    effect.probability = probability_at(effect.p_value);
    effect.size = std::abs(ratio_ - 1.0) * rms_of(asked_);
    effect.separate_by = "read the gain from the controller's configuration";
    return effect;
  }

  const Series& series_;
  const CommandStretch& stretch_;
  const GainQuestion& ask_;
  ControlLaw law_;
  Segments segments_;
  double ratio_;             ///< to the plant's gain
  double explained_ = 0.0;   ///< share of the command and of its changes
  double bend_ = 0.0;        ///< share of the gain that converter and inputs may take
  double deviation_ = 0.0;   ///< of the ratio, by chance
  double half_width_ = 0.0;  ///< of its 95 %, by chance
  VectorXd left_;            ///< by the law, at its rows
  VectorXd asked_;           ///< by the plant's gain there
};

}  // namespace

GainAnswer judge_gain(const Series& series, const CommandStretch& stretch,
                      const std::vector<char>& usable, const GainQuestion& question) {
  return GainStudy(series, stretch, usable, question).answer();
}

}  // namespace ravencal::diagnose
