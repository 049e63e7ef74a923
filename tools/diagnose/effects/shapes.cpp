// SPDX-License-Identifier: Apache-2.0
#include "diagnose/effects/shapes.hpp"

namespace ravencal::diagnose {

int reversals(const Series& s) {
  const Eigen::VectorXd side = direction(s);
  int count = 0;
  double last = 0.0;
  for (Eigen::Index i = 0; i < s.rows(); ++i) {
    const auto n = static_cast<std::size_t>(i);
    if (s.fresh[n] != 0) last = 0.0;
    if (s.held_out[n] != 0 || s.valid[n] == 0 || std::abs(side[i]) < 1.0) continue;
    if (last * side[i] < 0.0) ++count;
    last = side[i];
  }
  return count;
}

}  // namespace ravencal::diagnose
