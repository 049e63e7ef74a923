// SPDX-License-Identifier: Apache-2.0
//
// What the page draws of each drive and position: errors before and after over everything that
// tells look-alikes apart, a map of where they are, what each part of the model takes away, sizes
// by circumstance, and stretches of the recordings.
#pragma once

#include <cstddef>

#include "diagnose/explain/models.hpp"
#include "diagnose/findings/findings.hpp"

namespace ravencal::diagnose {

/// `first_recording`: place of the view's first recording in Report::recordings. Fills in the
/// invariance spread of the effects too.
void add_plots(const View& view, const Growth& growth, std::size_t first_recording, Report& report);

}  // namespace ravencal::diagnose
