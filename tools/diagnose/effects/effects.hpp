// SPDX-License-Identifier: Apache-2.0
//
// The effects that diagnose can name, one file each, and the vocabulary with what is left out.
#pragma once

#include <memory>
#include <span>
#include <string_view>

#include "diagnose/effects/effect_form.hpp"
#include "diagnose/effects/nominal.hpp"

namespace ravencal::diagnose {

std::unique_ptr<EffectForm> homing_offset();
std::unique_ptr<EffectForm> gain_error();
std::unique_ptr<EffectForm> coupling(const std::string& from);
std::unique_ptr<EffectForm> compliance();
std::unique_ptr<EffectForm> backlash();
std::unique_ptr<EffectForm> joint_friction();
std::unique_ptr<EffectForm> hysteresis(const std::string& from);
std::unique_ptr<EffectForm> creep();
std::unique_ptr<EffectForm> eccentricity();
std::unique_ptr<EffectForm> delay();
std::unique_ptr<EffectForm> thermal_drift();
std::unique_ptr<EffectForm> coulomb_friction();
std::unique_ptr<EffectForm> viscous_friction();
std::unique_ptr<EffectForm> stribeck_friction();
std::unique_ptr<EffectForm> presliding();
std::unique_ptr<EffectForm> asymmetric_friction();
/// `further`: effort of a load that was found beside the plant's; may be empty.
std::unique_ptr<EffectForm> load_dependent_friction(Eigen::VectorXd further = {});
/// `needed`: effort that the plant as it is asks of the drive, as the residual shows it; must
/// outlive the form.
std::unique_ptr<EffectForm> torque_constant(const Eigen::VectorXd& needed);
std::unique_ptr<EffectForm> payload();
std::unique_ptr<EffectForm> torque_ripple();
std::unique_ptr<EffectForm> gravity();
/// `needed` as for torque_constant(), which need not outlive it.
std::unique_ptr<EffectForm> saturation(const Series& series, const Eigen::VectorXd& needed);
std::unique_ptr<EffectForm> flexible_mode();
std::unique_ptr<EffectForm> quantisation();

/// The nominal term beyond its tolerance; `term` must outlive the form.
std::unique_ptr<EffectForm> tolerance_form(const NominalTerm& term, std::size_t index);

/// Candidates for one series; `nominal` must outlive them. `further_load`: see
/// load_dependent_friction().
Forms forms_for(const Series& series, const Nominal& nominal,
                const Eigen::VectorXd& further_load = {});

/// Any smooth shape over one circumstance, for what no effect of the vocabulary explains: id
/// "unknown", `from` names the circumstance.
Forms unnamed_forms(const Series& series);

/// An id of the vocabulary and the stage in which it belongs.
struct VocabularyEntry {
  std::string_view id;
  Stage stage;
};
std::span<const VocabularyEntry> vocabulary();

}  // namespace ravencal::diagnose
