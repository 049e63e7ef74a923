// SPDX-License-Identifier: Apache-2.0
//
// When a drive is at rest, as far as friction's law is concerned.
#pragma once

#include <vector>

#include "diagnose/series/series.hpp"

namespace ravencal::diagnose {

/// Rows [1 where at rest] that say nothing about friction's law. A joint that sticks, below a
/// fiftieth of its usual speed, may carry any effort up to its friction. One whose command stands
/// still settles, below a tenth of the speed at which it is moved: it sheds friction, because the
/// loop's own vibration takes it away (dither; Armstrong-Helouvry et al., Automatica 1994), until
/// it has moved far enough to forget that. `desired` [rows] may be empty; speeds are of the
/// training rows.
std::vector<char> rows_at_rest(const Series& series, const Eigen::VectorXd& desired);

}  // namespace ravencal::diagnose
