// SPDX-License-Identifier: Apache-2.0
#include "core/students_t.hpp"

#include <boost/math/distributions/students_t.hpp>
#include <limits>

namespace ravencal::core {

double students_t_975(double degrees) {
  if (!(degrees > 0.0)) return std::numeric_limits<double>::infinity();
  return boost::math::quantile(boost::math::students_t(degrees), 0.975);
}

}  // namespace ravencal::core
