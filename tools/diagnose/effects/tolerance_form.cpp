// SPDX-License-Identifier: Apache-2.0
//
// A parameter that the plant has, set free beyond its tolerance: it competes with physics that the
// plant lacks, so that neither takes the other's part.
#include <algorithm>
#include <cmath>

#include "diagnose/effects/effects.hpp"
#include "diagnose/effects/shapes.hpp"

namespace ravencal::diagnose {
namespace {

class ToleranceForm final : public EffectForm {
 public:
  ToleranceForm(const NominalTerm& term, std::size_t index)
      : EffectForm(effect_kind(term.id), term.from), term_(term), index_(index) {}

  Eigen::MatrixXd columns(const Series&, const Shape&) const override { return term_.column; }
  std::optional<std::size_t> nominal_term() const override { return index_; }
  bool as_seen_already() const override { return true; }
  std::vector<FormParameter> parameters(const Series&, const Shape&,
                                        const Eigen::VectorXd& b) const override {
    return {{term_.parameter, term_.value * (1.0 + b[0]), term_.unit}};
  }
  std::string inconsistency(const Series&, const Shape&, const Eigen::VectorXd& b) const override {
    // A number that its owner has wrong by more than a factor of three stands for something else.
    constexpr double kMostFactor = 3.0;
    const double factor = 1.0 + b[0];
    return factor > 1.0 / kMostFactor && factor < kMostFactor
               ? ""
               : "the number would be wrong by more than a factor of three";
  }
  std::string separate_by() const override { return "check the plant's number against its source"; }

 private:
  const NominalTerm& term_;
  std::size_t index_;
};

}  // namespace

std::unique_ptr<EffectForm> tolerance_form(const NominalTerm& term, std::size_t index) {
  return std::make_unique<ToleranceForm>(term, index);
}

}  // namespace ravencal::diagnose
