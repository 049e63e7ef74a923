// SPDX-License-Identifier: Apache-2.0
//
// Whether a cable follows the links or the drives of the joints that move it, where the plant does
// not say: how the nominal model of a transmission holds both, as shares between none (drives) and
// all (links) of what links pass on.
#pragma once

#include <Eigen/Core>
#include <string_view>

#include "diagnose/effects/nominal.hpp"

namespace ravencal::diagnose {

/// Parameters of the forms: stretch of the cable of joint `from` that reaches this joint, and load
/// that the cable of joint `from` puts on this one's.
inline constexpr std::string_view kStretchShare = "stretch_share";
inline constexpr std::string_view kLoadShare = "load_share";

/// The sum; a part may be empty.
inline Eigen::VectorXd with(const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
  if (a.size() == 0) return b;
  return b.size() == 0 ? a : Eigen::VectorXd(a + b);
}

/// The joint whose cable's way the share depends on; empty: no such form. `joint`: of the channel.
inline std::string_view routed_joint(const NominalTerm& term, std::string_view joint) {
  if (!term.form_only || term.from.empty() || term.value != 0.5) return {};
  if (term.parameter == kStretchShare) return joint;
  return term.parameter == kLoadShare ? std::string_view(term.from) : std::string_view();
}

}  // namespace ravencal::diagnose
