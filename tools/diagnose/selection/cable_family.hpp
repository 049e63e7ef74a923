// SPDX-License-Identifier: Apache-2.0
//
// Effects of one cable that hide each other: where the selection, which takes effects one by one,
// names none of them, small sets are fitted together and compared.
#pragma once

#include "diagnose/selection/selection.hpp"

namespace ravencal::diagnose {

/// Adds the set of the cable's effects that explains best for its cost, the smaller one where
/// held-out errors cannot tell, if it gains far more than a search through all sets would by
/// chance. The model keeps the others (`compared`).
void settle_cable(ChannelModel& model, const Gates& gates);

}  // namespace ravencal::diagnose
