// SPDX-License-Identifier: Apache-2.0
//
// What other rooms need of single effects: those that a channel finds without a form, and forms
// that a channel fits outside of its search.
#pragma once

#include <memory>

#include "diagnose/effects/effect_form.hpp"
#include "diagnose/effects/nominal.hpp"

namespace ravencal::diagnose {

const EffectKind& homing_offset_kind();
const EffectKind& payload_kind();
const EffectKind& slip_kind();
const EffectKind& lost_counts_kind();
const EffectKind& controller_gain_kind();
const EffectKind& input_disturbance_kind();
const EffectKind& unknown_kind();

std::unique_ptr<EffectForm> homing_offset();
/// A drive's constant as dry friction that differs between the directions.
std::unique_ptr<EffectForm> level_difference();
std::unique_ptr<EffectForm> payload();
/// `needed`: effort that the plant as it is asks of the drive, as the residual shows it.
std::unique_ptr<EffectForm> saturation(const Series& series, const Eigen::VectorXd& needed);

/// The nominal term beyond its tolerance; `term` must outlive the form.
std::unique_ptr<EffectForm> tolerance_form(const NominalTerm& term, std::size_t index);

/// Candidates for one series; `nominal` must outlive them. `further_load`: effort of a load that
/// was found beside the plant's; may be empty.
Forms forms_for(const Series& series, const Nominal& nominal,
                const Eigen::VectorXd& further_load = {});

/// Any smooth shape over one circumstance, for what no effect of the vocabulary explains: kind
/// unknown, `from` names the circumstance.
Forms unnamed_forms(const Series& series);

}  // namespace ravencal::diagnose
