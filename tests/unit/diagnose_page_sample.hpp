// SPDX-License-Identifier: Apache-2.0
//
// A diagnosis made up by hand, with something of everything that a page shows.
#pragma once

#include "diagnose/findings/findings.hpp"

namespace ravencal::diagnose {

/// Three joints, two recordings (one held out): a payload that three drives feel, a gain error with
/// a rival, friction of two kinds, a joint that became worse, a joint that was not recorded.
Report sample_diagnosis();

/// The same recordings with nothing found.
Report sample_of_nothing();

}  // namespace ravencal::diagnose
