// SPDX-License-Identifier: Apache-2.0
//
// The absolute alarm: what a channel's error still is on rows that no fit saw, against a floor that
// no effect of the vocabulary had a part in.
#pragma once

#include "diagnose/channel/channel.hpp"

namespace ravencal::diagnose {

/// Compares the error with what passes in the same circumstances do not share or, where the
/// recording does not repeat itself, with what its sensors resolve.
void add_error_left(const ChannelFit& fit, ChannelFindings& findings);

}  // namespace ravencal::diagnose
