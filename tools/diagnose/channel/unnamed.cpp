// SPDX-License-Identifier: Apache-2.0
//
// What the chosen effects leave, against shapes that have no name; and effects that such a shape
// beats by far, which are proxies of something that the vocabulary does not hold.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "diagnose/channel/channel.hpp"
#include "diagnose/effects/effects.hpp"
#include "diagnose/findings/policy.hpp"
#include "diagnose/fit/derived_seed.hpp"
#include "diagnose/fit/spectral_line.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// The model with the shapes as its only candidates, the chosen effects aside.
ChannelModel probe_of(const ChannelModel& model, const Forms& shapes) {
  ChannelModel probe = model;
  probe.candidates.clear();
  for (Chosen& chosen : probe.chosen) {
    probe.candidates.push_back(model.candidates[chosen.candidate]);
    chosen.candidate = probe.candidates.size() - 1;
  }
  for (const auto& form : shapes) {
    auto candidate = std::make_shared<FormCandidate>();
    candidate->form = form.get();
    candidate->untestable = form->untestable(*model.series);
    if (candidate->untestable.empty()) {
      candidate->shapes = {{}};
      candidate->columns = {model.blocks.gather(seen_columns(*form, *model.series, {}))};
    }
    probe.candidates.push_back(std::move(candidate));
  }
  return probe;
}

bool counts(const TestedCandidate& t, const ChannelModel& model, const Gates& gates,
            double least_size) {
  const Evidence& e = t.evidence;
  const Series& s = *model.series;
  const EffectForm& form = *model.candidates[t.candidate]->form;
  const double left = model.rms_of(t.errors);
  // Each link's weight is off within its own tolerance, and together they make shapes; the cable
  // shows what they stretch.
  const double per_effort = s.stage == Stage::kTransmission ? s.cable.compliance : 1.0;
  const double weight = form.look_alikes(s).empty()
                            ? 0.0
                            : kUnstatedTolerance * per_effort * s.training_rms(s.weight);
  const bool large =
      e.size >= std::max(gates.unnamed_per_floor * left, std::hypot(least_size, weight));
  // What fades is not repeated in every block, and noise estimated with it inside is no noise; but
  // a curve of a few knots that halves the error of blocks that it never saw is no chance.
  if (form.from() == "time") return e.share >= kLeastTimeShare && large;
  return repeats(gates, e.z, e.block_p) && e.p_value <= gates.alpha &&
         e.share >= kLeastUnnamedShare && large;
}

/// True if the shape says what the effect said, and much more.
bool is_proxy(const ChannelModel& with_shape, std::size_t effect, double with_effect) {
  const double both = held_out_errors(with_shape).sum();
  const double shape_alone = held_out_errors(with_shape.without(effect)).sum();
  ChannelModel neither = with_shape;
  neither.chosen.pop_back();
  const double none = held_out_errors(neither.without(effect)).sum();
  const double own = shape_alone - both;
  return own < kOwnGain * (none - with_effect) &&
         with_effect - shape_alone > kMoreThanName * (none - shape_alone);
}

}  // namespace

double least_remainder(const ChannelFit& fit) {
  VectorXd prediction = fit.model.blocks.gather(fit.nominal->prediction);
  if (prediction.size() == 0) return 0.0;
  prediction.array() -= prediction.mean();
  double squares = kModelForm * kModelForm * prediction.squaredNorm();
  for (const NominalTerm& term : fit.nominal->terms) {
    if (term.variation > 0.0)
      squares +=
          (kKnownVariation * term.variation * fit.model.blocks.gather(term.column)).squaredNorm();
  }
  return std::sqrt(squares / static_cast<double>(prediction.size()));
}

std::optional<UnnamedShape> likeliest_shape(const ChannelFit& fit, const ChannelOptions& options) {
  const Series& s = *fit.model.series;
  const Forms shapes = unnamed_forms(s);
  if (shapes.empty()) return std::nullopt;
  ChannelModel probe = probe_of(fit.model, shapes);
  // A null that still holds what is looked for would hide it.
  probe.noise = saturated_noise(probe);
  const ScreenResult result = screen(probe, options.gates, derived_seed(options.seed, "unnamed"));
  const double least_size = least_remainder(fit);
  const TestedCandidate* best = nullptr;
  for (const TestedCandidate& t : result.tested) {
    if (!counts(t, probe, options.gates, least_size)) continue;
    if (best == nullptr || t.errors.sum() < best->errors.sum()) best = &t;
  }
  if (best == nullptr) return std::nullopt;
  UnnamedShape found;
  found.what = {s.joint,
                std::string(stage_word(s.stage)),
                best->evidence.share,
                best->evidence.size,
                s.unit,
                {probe.candidates[best->candidate]->form->from()}};
  ChannelModel with = probe;
  with.chosen.push_back(best->best);
  for (std::size_t i = 0; i < fit.model.chosen.size(); ++i)
    if (is_proxy(with, i, result.errors.sum())) found.says_more_than.push_back(i);
  return found;
}

void add_tone(const ChannelFit& fit, const ChannelOptions& options, ChannelFindings& findings) {
  const Series& s = *fit.model.series;
  const auto& rows = fit.model.blocks.rows;
  // The filter that efforts are seen through would take the tone away.
  const VectorXd& measured = s.recorded.size() > 0 ? s.recorded : s.y;
  const bool asked = s.tracking_error.size() > 0;
  VectorXd t_s(static_cast<Index>(rows.size())), rest(t_s.size()), motion(t_s.size());
  for (std::size_t n = 0; n < rows.size(); ++n) {
    const auto i = static_cast<Index>(n);
    if (n > 0 && s.recording[static_cast<std::size_t>(rows[n])] !=
                     s.recording[static_cast<std::size_t>(rows[n - 1])])
      return;
    t_s[i] = s.t_s[rows[n]];
    rest[i] = measured[rows[n]] - fit.prediction[rows[n]];
    motion[i] = s.motion.q[rows[n]];
    // A tone in the effort shakes the joint as well: what it was asked for has no part in that.
    if (asked && std::isfinite(s.tracking_error[rows[n]])) motion[i] += s.tracking_error[rows[n]];
  }
  const auto line = find_line(t_s, rest, motion, options.gates.alpha);
  if (!line || line->share < kLeastUnnamedShare) return;
  const double left = line->rms * std::sqrt(std::max(0.0, 1.0 / line->share - 1.0));
  if (line->rms < std::max(options.gates.unnamed_per_floor * left, least_remainder(fit))) return;
  findings.unexplained.push_back({findings.joint,
                                  std::string(stage_word(findings.stage)),
                                  line->share,
                                  line->rms,
                                  findings.unit,
                                  {fmt::format("time, at {:.3g} Hz", line->hz)}});
}

}  // namespace ravencal::diagnose
