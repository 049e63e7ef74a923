// SPDX-License-Identifier: Apache-2.0
//
// The form that an effect takes in a series of its own stage, and one that takes any column.
#pragma once

#include <cstdint>
#include <memory>
#include <random>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "diagnose/effects/effects.hpp"

namespace ravencal::generator {

/// `nominal` must outlive the form.
inline std::shared_ptr<const diagnose::EffectForm> form_of(std::string_view id,
                                                           diagnose::Series series,
                                                           const diagnose::Nominal& nominal,
                                                           const Eigen::VectorXd& further_load) {
  const diagnose::EffectKind& kind = diagnose::effect_kind(id);
  series.stage = kind.stage();
  diagnose::Forms forms;
  kind.add_forms({series, nominal, further_load}, forms);
  return forms.at(0);
}

inline std::shared_ptr<const diagnose::EffectForm> form_of(std::string_view id,
                                                           diagnose::Series series = {}) {
  static const diagnose::Nominal kNothing;
  return form_of(id, std::move(series), kNothing, {});
}

/// Even between -1 and 1.
inline Eigen::VectorXd noise(Eigen::Index count, std::uint64_t seed) {
  std::mt19937_64 engine(seed);
  Eigen::VectorXd x(count);
  for (Eigen::Index i = 0; i < count; ++i)
    x[i] = static_cast<double>(engine() >> 11U) * 0x1.0p-52 - 1.0;
  return x;
}

/// A column of numbers under a name.
class Given final : public diagnose::EffectForm {
 public:
  Given(std::string_view id, Eigen::VectorXd column, bool ordinary = false)
      : EffectForm(diagnose::effect_kind(id)), column_(std::move(column)), ordinary_(ordinary) {}
  bool ordinary(const diagnose::Series&) const override { return ordinary_; }
  Eigen::MatrixXd columns(const diagnose::Series&, const diagnose::Shape&) const override {
    return column_;
  }
  std::vector<diagnose::FormParameter> parameters(const diagnose::Series&, const diagnose::Shape&,
                                                  const Eigen::VectorXd&) const override {
    return {};
  }
  std::string separate_by() const override { return ""; }

 private:
  Eigen::VectorXd column_;
  bool ordinary_;
};

}  // namespace ravencal::generator
