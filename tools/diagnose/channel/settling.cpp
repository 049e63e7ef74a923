// SPDX-License-Identifier: Apache-2.0
#include "diagnose/channel/settling.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/median.hpp"
#include "diagnose/findings/policy.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

bool is_friction(std::string_view id) { return settles_at_rest(traits_of(id).friction); }

/// Friction's part of the prediction, all rows.
VectorXd friction_of(const ChannelFit& fit) {
  const Series& s = *fit.model.series;
  VectorXd part = VectorXd::Zero(s.rows());
  for (std::size_t t = 0; t < fit.nominal->terms.size(); ++t) {
    const NominalTerm& term = fit.nominal->terms[t];
    const double change = fit.coefficients[static_cast<Index>(t) + 1];
    if (is_friction(term.id)) part += (term.form_only ? change : 1.0 + change) * term.column;
  }
  for (std::size_t i = 0; i < fit.model.chosen.size(); ++i) {
    const Chosen& chosen = fit.model.chosen[i];
    const EffectForm& form = *fit.model.candidates[chosen.candidate]->form;
    if (is_friction(form.id()))
      part += seen_columns(form, s, chosen.shape) * coefficients_of(fit, i);
  }
  return part;
}

struct Gross {
  std::vector<Index> rows;  ///< indices into the training rows
  std::size_t stretches = 0;
  double share = 0.0;
};

Gross gross_rows(const ChannelModel& model, double deviation) {
  const auto apart = static_cast<Index>(std::max(4.0, 2.0 * model.correlation_rows));
  Gross gross;
  double energy = 0.0;
  for (Index n = 0; n < model.noise.size(); ++n) {
    if (std::abs(model.noise[n]) < kGross * deviation) continue;
    if (gross.rows.empty() || n - gross.rows.back() > apart) ++gross.stretches;
    gross.rows.push_back(n);
    energy += model.noise[n] * model.noise[n];
  }
  gross.share = energy / std::max(model.noise.squaredNorm(), 1e-300);
  return gross;
}

}  // namespace

std::optional<double> settle_at_rest(ChannelFit& fit) {
  constexpr double kLeastRows = 50.0;
  const Series& s = *fit.model.series;
  if (s.stage != Stage::kDrive || s.at_rest.empty()) return std::nullopt;
  const VectorXd friction = friction_of(fit);
  double along = 0.0, energy = 0.0, count = 0.0;
  for (Index i = 0; i < s.rows(); ++i) {
    const auto n = static_cast<std::size_t>(i);
    if (s.at_rest[n] == 0 || s.valid[n] == 0 || s.held_out[n] != 0) continue;
    along += friction[i] * (s.y[i] - fit.prediction[i] + friction[i]);
    energy += friction[i] * friction[i];
    count += 1.0;
  }
  if (count < kLeastRows || energy <= 0.0) return std::nullopt;
  const double share = std::clamp(along / energy, 0.0, 1.0);
  for (Index i = 0; i < s.rows(); ++i) {
    if (s.at_rest[static_cast<std::size_t>(i)] != 0)
      fit.prediction[i] -= (1.0 - share) * friction[i];
  }
  return share;
}

std::string temper_gross_rows(ChannelModel& model) {
  const Series& s = *model.series;
  if (s.stage != Stage::kTransmission && s.stage != Stage::kTracking) return {};
  std::string sentence;
  for (int round = 0; round < 2; ++round) {
    const double deviation = core::normal_deviation(model.noise);
    const Gross gross = gross_rows(model, deviation);
    const auto most = kMostGrossRows * static_cast<double>(model.noise.size());
    if (gross.rows.empty() || gross.stretches > kMostGrossStretches ||
        gross.share < kLeastGrossShare || static_cast<double>(gross.rows.size()) > most)
      return sentence;
    if (sentence.empty()) {
      sentence = fmt::format(
          "joint {} ({}): {} rows in {} stretches, the first at {:.1f} s, hold {:.0f} % of what "
          "nothing explains; fits take them as {:.0f} deviations, held-out figures as they are",
          s.joint, stage_word(s.stage), gross.rows.size(), gross.stretches,
          s.t_s[model.blocks.rows[static_cast<std::size_t>(gross.rows.front())]],
          100.0 * gross.share, kTempered);
    }
    for (const Index n : gross.rows) {
      const double excess = model.noise[n] - std::copysign(kTempered * deviation, model.noise[n]);
      model.target[n] -= excess;
      model.free_target[n] -= excess;
    }
    model.noise = saturated_noise(model);
    model.correlation_rows = noise_memory(model, model.noise);
    model.floor = std::sqrt(model.noise.squaredNorm() / static_cast<double>(model.noise.size()));
  }
  return sentence;
}

}  // namespace ravencal::diagnose
