// SPDX-License-Identifier: Apache-2.0
//
// What an effect is worth beyond the stretches and positions that it was fitted to.
#pragma once

#include "diagnose/selection/selection.hpp"

namespace ravencal::diagnose {

/// True if the last effect of `with`, which `without` lacks, gains in long stretches that the fit
/// has not seen (a drift is followed between blocks, not over them) and over such ranges of
/// position (what holds only where it was fitted does not predict another motion).
bool predicts_beyond(const ChannelModel& with, const ChannelModel& without);

}  // namespace ravencal::diagnose
