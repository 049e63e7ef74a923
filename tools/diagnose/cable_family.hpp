// SPDX-License-Identifier: Apache-2.0
//
// Which of the cable's effects are at work: after the selection has looked at them one by one,
// small sets of the family are fitted together and compared.
#pragma once

#include "diagnose/selection.hpp"

namespace ravencal::diagnose {

/// Replaces the chosen members of the cable's family by the set that explains best for its cost:
/// the smaller one where held-out errors cannot tell. Names in sets as good as the one kept stand
/// in its `tied_with`. Where no member is chosen yet, a set must gain far more than its cost.
void settle_cable(ChannelModel& model, const Gates& gates);

}  // namespace ravencal::diagnose
