// SPDX-License-Identifier: Apache-2.0
#include "core/students_t.hpp"

#include <boost/math/distributions/students_t.hpp>

namespace ravencal::core {

double students_t_975(double degrees) {
  return boost::math::quantile(boost::math::students_t(degrees), 0.975);
}

}  // namespace ravencal::core
