// SPDX-License-Identifier: Apache-2.0
//
// Shapes without a name: any smooth dependence on one circumstance, the same in both directions or
// turning with the direction of motion as friction does. What such a shape explains and no effect
// of the vocabulary does is real and unknown; what it explains far better than a named effect is
// no proof of that name.
#include <algorithm>

#include "diagnose/effects/effects.hpp"
#include "diagnose/effects/regimes.hpp"
#include "diagnose/effects/shapes.hpp"
#include "diagnose/findings/findings.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr Index kKnots = 7;
/// What happens at a place (a dent, a knot in the cable) is local.
constexpr Index kPlaceKnots = 13;

/// Quantiles of the training rows that move, strictly rising: what friction does while it holds is
/// no shape of anything.
std::vector<double> knots_of(const Series& s, const VectorXd& x, Index count) {
  const double least = 0.1 * s.training_rms(s.motion.v);
  std::vector<double> sorted;
  for (Index i = 0; i < s.rows(); ++i) {
    if (s.trains(i) && std::abs(s.motion.v[i]) > least) sorted.push_back(x[i]);
  }
  std::sort(sorted.begin(), sorted.end());
  std::vector<double> knots;
  for (Index k = 0; k < count && !sorted.empty(); ++k) {
    const auto at =
        (sorted.size() - 1) * static_cast<std::size_t>(k) / static_cast<std::size_t>(count - 1);
    if (knots.empty() || sorted[at] > knots.back()) knots.push_back(sorted[at]);
  }
  return knots;
}

/// Piecewise linear between the knots, level beyond them: one column per knot.
MatrixXd hats(const VectorXd& x, const std::vector<double>& knots) {
  const auto count = static_cast<Index>(knots.size());
  MatrixXd out = MatrixXd::Zero(x.size(), count);
  for (Index i = 0; i < x.size(); ++i) {
    const auto next = std::upper_bound(knots.begin(), knots.end(), x[i]) - knots.begin();
    if (next == 0 || next == count) {
      out(i, next == 0 ? 0 : count - 1) = 1.0;
      continue;
    }
    const auto k = static_cast<std::size_t>(next);
    const double share = (x[i] - knots[k - 1]) / (knots[k] - knots[k - 1]);
    out(i, next - 1) = 1.0 - share;
    out(i, next) = share;
  }
  return out;
}

class Unnamed final : public EffectForm {
 public:
  /// `beside`: one more column; may be empty.
  Unnamed(const RegimeOf& circumstance, bool directed, VectorXd beside = {})
      : EffectForm(unknown_kind(), circumstance.name),
        value_(circumstance.value),
        beside_(std::move(beside)),
        count_(circumstance.name == "position" ? kPlaceKnots : kKnots),
        directed_(directed) {}

  std::string untestable(const Series& s) const override {
    return knots_of(s, value_, count_).size() >= 3 ? "" : from() + " hardly changes";
  }
  MatrixXd columns(const Series& s, const Shape&) const override {
    MatrixXd out = hats(value_, knots_of(s, value_, count_));
    if (directed_) out = direction(s).asDiagonal() * out;
    if (beside_.size() == 0) return out;
    out.conservativeResize(Eigen::NoChange, out.cols() + 1);
    out.rightCols(1) = beside_;
    return out;
  }
  std::vector<FormParameter> parameters(const Series&, const Shape&,
                                        const VectorXd&) const override {
    return {};
  }
  /// What keeps its sign when the motion turns may be a weight.
  std::vector<std::string> look_alikes(const Series& s) const override {
    if (directed_ || s.weight.size() == 0) return {};
    return {"gravity"};
  }
  std::string separate_by() const override { return "vary " + from() + " alone"; }

 private:
  VectorXd value_;
  VectorXd beside_;
  Index count_;
  bool directed_;
};

/// How the positions of two joints act together, up to their squares: an encoder's arm that bends
/// with the posture, a cable that another joint leads round a corner.
class UnnamedInterplay final : public EffectForm {
 public:
  explicit UnnamedInterplay(const RegimeOf& other)
      : EffectForm(unknown_kind(), "position with " + other.name), value_(other.value) {}

  std::string untestable(const Series& s) const override {
    const bool still = s.training_rms(centred(s, value_)) <= 0.0 ||
                       range_of(s, s.motion.q) <= 20.0 * s.rest_width();
    return still ? "one of the two hardly moves" : "";
  }
  MatrixXd columns(const Series& s, const Shape&) const override {
    const VectorXd x = scaled(s, s.motion.q);
    const VectorXd y = scaled(s, value_);
    MatrixXd out(s.rows(), 3);
    out << x.cwiseProduct(y), x.cwiseAbs2().cwiseProduct(y), x.cwiseProduct(y.cwiseAbs2());
    return out;
  }
  std::vector<FormParameter> parameters(const Series&, const Shape&,
                                        const VectorXd&) const override {
    return {};
  }
  std::vector<std::string> look_alikes(const Series& s) const override {
    if (s.weight.size() == 0) return {};
    return {"gravity"};
  }
  std::string separate_by() const override { return "move each of the two alone"; }

 private:
  VectorXd value_;
};

}  // namespace

const EffectKind& unknown_kind() {
  static const EffectKind kind(
      kUnknown, Stage::kDrive,
      {.origin = Origin::kUnnamed,
       .sentence = "the mismatch is real, and no effect of the vocabulary explains it"});
  return kind;
}

Forms unnamed_forms(const Series& series) {
  Forms forms;
  const bool drive = series.stage == Stage::kDrive;
  if (!drive && series.stage != Stage::kTransmission) return forms;
  auto all = circumstances(series);
  all.push_back({"time", "s", series.t_s});
  for (const RegimeOf& c : all) {
    if (c.name == "direction" || c.name == "memory") continue;
    if (c.name == "speed" && !drive) continue;  // a lag of the streams, not of the cable
    const bool plain = c.name != "time" && c.name != "speed" && c.name != "since_reversal";
    const bool other = c.name.starts_with("position of");
    // What another joint's drive leaks into this one turns with that joint's friction too.
    const double turn = other && drive ? 2e-3 * range_of(series, c.value) : 0.0;
    if (other && !drive) forms.push_back(std::make_unique<UnnamedInterplay>(c));
    if (plain)
      forms.push_back(std::make_unique<Unnamed>(
          c, false, turn > 0.0 ? direction_memory(c.value, turn, series.fresh) : VectorXd()));
    if (!other && (drive || !plain) && (drive || c.name != "time"))
      forms.push_back(std::make_unique<Unnamed>(c, true));
  }
  return forms;
}

}  // namespace ravencal::diagnose
