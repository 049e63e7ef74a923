// SPDX-License-Identifier: Apache-2.0
#include <array>

#include "diagnose/effects/effects.hpp"
#include "diagnose/effects/shapes.hpp"

namespace ravencal::diagnose {
namespace {

constexpr std::array<VocabularyEntry, 30> kVocabulary = {{
    {"homing_offset", Stage::kTransmission},
    {"gain_error", Stage::kTransmission},
    {"coupling", Stage::kTransmission},
    {"compliance", Stage::kTransmission},
    {"backlash", Stage::kTransmission},
    {"joint_friction", Stage::kTransmission},
    {"hysteresis", Stage::kTransmission},
    {"creep", Stage::kTransmission},
    {"eccentricity", Stage::kTransmission},
    {"slip", Stage::kTransmission},
    {"coulomb_friction", Stage::kDrive},
    {"viscous_friction", Stage::kDrive},
    {"stribeck_friction", Stage::kDrive},
    {"presliding", Stage::kDrive},
    {"asymmetric_friction", Stage::kDrive},
    {"load_dependent_friction", Stage::kDrive},
    {"torque_constant", Stage::kDrive},
    {"torque_ripple", Stage::kDrive},
    {"saturation", Stage::kDrive},
    {"controller_gain", Stage::kCommand},
    {"inertia_error", Stage::kDrive},
    {"gravity", Stage::kDrive},
    {"payload", Stage::kDrive},
    {"flexible_mode", Stage::kDrive},
    {"delay", Stage::kTransmission},
    {"lost_counts", Stage::kTransmission},
    {"quantisation", Stage::kTransmission},
    {"thermal_drift", Stage::kTransmission},
    {"input_disturbance", Stage::kCommand},
    {"unknown", Stage::kDrive},
}};

void add_transmission(const Series& series, Forms& forms) {
  forms.push_back(gain_error());
  for (const Companion& other : series.others) forms.push_back(coupling(other.name));
  forms.push_back(compliance());
  forms.push_back(backlash());
  forms.push_back(joint_friction());
  forms.push_back(hysteresis({}));
  for (const Companion& other : series.others) forms.push_back(hysteresis(other.name));
  forms.push_back(creep());
  forms.push_back(eccentricity());
  forms.push_back(delay());
  forms.push_back(thermal_drift());
  forms.push_back(quantisation());
  if (!weighs_by_stretch(series)) return;
  forms.push_back(payload());
  if (series.weight.size() == 0) forms.push_back(gravity());
}

void add_drive(const Series& series, const Eigen::VectorXd& needed,
               const Eigen::VectorXd& further_load, Forms& forms) {
  forms.push_back(coulomb_friction());
  forms.push_back(viscous_friction());
  forms.push_back(stribeck_friction());
  forms.push_back(presliding());
  forms.push_back(asymmetric_friction());
  forms.push_back(load_dependent_friction(further_load));
  forms.push_back(torque_constant(needed));
  forms.push_back(torque_ripple());
  forms.push_back(saturation(series, needed));
  forms.push_back(flexible_mode());
  forms.push_back(payload());
  // A plant with links knows the shape of their weight; the posture's shape is then no candidate.
  if (series.weight.size() == 0) forms.push_back(gravity());
  if (series.cable.compliance > 0.0) forms.push_back(joint_friction());
}

/// A servo's error in proportion to position is posture's load, not a ratio: the same encoder
/// measures and is controlled.
void add_tracking(Forms& forms) {
  forms.push_back(coulomb_friction());
  forms.push_back(hysteresis({}));
  forms.push_back(delay());
  forms.push_back(gravity());
}

}  // namespace

int reversals(const Series& s) {
  const Eigen::VectorXd side = direction(s);
  int count = 0;
  double last = 0.0;
  for (Eigen::Index i = 0; i < s.rows(); ++i) {
    const auto n = static_cast<std::size_t>(i);
    if (s.fresh[n] != 0) last = 0.0;
    if (s.held_out[n] != 0 || s.valid[n] == 0 || std::abs(side[i]) < 1.0) continue;
    if (last * side[i] < 0.0) ++count;
    last = side[i];
  }
  return count;
}

std::span<const VocabularyEntry> vocabulary() { return kVocabulary; }

Forms forms_for(const Series& series, const Nominal& nominal, const Eigen::VectorXd& further_load) {
  Forms forms;
  switch (series.stage) {
    case Stage::kTransmission:
      add_transmission(series, forms);
      break;
    case Stage::kDrive:
      add_drive(series, nominal.prediction, further_load, forms);
      break;
    case Stage::kTracking:
      add_tracking(forms);
      break;
    case Stage::kCommand:
      break;
  }
  return forms;
}

}  // namespace ravencal::diagnose
