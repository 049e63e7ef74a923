// SPDX-License-Identifier: Apache-2.0
//
// The drawings of report.html, one channel each.
#pragma once

#include <string>

#include "diagnose/findings/findings.hpp"

namespace ravencal::diagnose {

/// Maps of the residual over position and signed speed, before and after; too little data hatched.
std::string where_figure(const ChannelPlot& plot);

/// Residual over position, load, speed and time at rest: before above, after below.
std::string look_alike_figure(const ChannelPlot& plot);

/// Held-out error as the model grows, down to the floor.
std::string waterfall_figure(const ChannelPlot& plot);

/// Each effect's size in parts of the data, one where it is what the whole data say.
std::string invariance_figure(const ChannelPlot& plot);

/// Measured, plant and improved plant on rows that no fit saw.
std::string trace_figure(const ChannelPlot& plot);

/// Pattern that the page needs once for untested cells.
std::string figure_definitions();

}  // namespace ravencal::diagnose
