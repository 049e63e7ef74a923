// SPDX-License-Identifier: Apache-2.0
//
// One joint as the charts see it: its errors on one continuous time axis. Errors are
// estimate - truth in the joint's unit.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "report/reduce.hpp"
#include "report/report.hpp"

namespace ravencal::report {

/// Refers to the series it was made from, which must live as long.
struct JointView {
  const JointSeries& series;
  Timeline timeline;
  std::vector<double> raw_error;
  std::vector<double> bias_removed_error;
  std::vector<double> corrected_error;
  std::vector<std::int8_t> direction;  ///< -1, 0 (at rest), +1
};

JointView view_of(const JointSeries& series);

/// The two joints whose truth spans the error maps. Views of the report's series.
struct MapAxes {
  const JointSeries& x;
  const JointSeries& y;
  MapGrid grid;
};

}  // namespace ravencal::report
