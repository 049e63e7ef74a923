// SPDX-License-Identifier: Apache-2.0
//
// Rows that a fit must treat apart, whatever the effect: a joint at rest, where friction is a
// constraint and no law, and the few rows where something else happened than ever again.
#pragma once

#include <optional>
#include <string>

#include "diagnose/channel/channel.hpp"

namespace ravencal::diagnose {

/// Drive: at rest a drive need not carry the friction of its last motion; vibration and the slow
/// end of the motion let it settle. Estimates the share that remains from training rows at rest,
/// which no other fit uses, and applies it to the prediction of all rows at rest. Empty where
/// friction or rest are missing.
std::optional<double> settle_at_rest(ChannelFit& fit);

/// Where a few short stretches (at most four, 1.5 % of the rows) hold a large part of what no
/// effect explains, each row being beyond eight deviations: fits and cross-validation see them at
/// two deviations (Huber's modified residuals, Robust Statistics 1981, 7.8), held-out figures in
/// full. Returns a sentence for the report; empty if there are none.
std::string temper_gross_rows(ChannelModel& model);

}  // namespace ravencal::diagnose
