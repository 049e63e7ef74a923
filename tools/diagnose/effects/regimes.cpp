// SPDX-License-Identifier: Apache-2.0
#include "diagnose/effects/regimes.hpp"

#include <algorithm>

#include "diagnose/effects/shapes.hpp"

namespace ravencal::diagnose {
namespace {

Eigen::VectorXd since_reversal(const Series& s, const Eigen::VectorXd& side) {
  Eigen::VectorXd path(s.rows());
  double travelled = 0.0;
  double last = 0.0;
  for (Eigen::Index i = 0; i < s.rows(); ++i) {
    if (s.fresh[static_cast<std::size_t>(i)] != 0) travelled = 0.0;
    if (i > 0) travelled += std::abs(s.motion.q[i] - s.motion.q[i - 1]);
    if (std::abs(side[i]) >= 1.0 && side[i] * last <= 0.0) {
      travelled = 0.0;
      last = side[i];
    }
    path[i] = travelled;
  }
  return path;
}

}  // namespace

std::vector<RegimeOf> circumstances(const Series& s) {
  const std::string q_unit = position_unit(s);
  const Eigen::VectorXd side = direction(s);
  std::vector<RegimeOf> out = {
      {"position", q_unit, s.motion.q},
      {"direction", "1", side},
      {"speed", per(q_unit, "s"), s.motion.v.cwiseAbs()},
      {"since_reversal", q_unit, since_reversal(s, side)},
      {"memory", "1",
       direction_memory(s.motion.q, std::max(s.rest_width(), 0.1 * range_of(s, s.motion.q)),
                        s.fresh)}};
  if (s.weight.size() > 0) out.push_back({"load", effort_unit(s), s.weight});
  for (const Companion& load : s.loads) out.push_back({"load " + load.name, load.unit, load.value});
  for (const Companion& other : s.others) {
    out.push_back({"position of " + other.name, other.unit, other.value});
  }
  return out;
}

}  // namespace ravencal::diagnose
