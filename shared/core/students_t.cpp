// SPDX-License-Identifier: Apache-2.0
#include "core/students_t.hpp"

#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <limits>
#include <numeric>

namespace ravencal::core {

double students_t_975(double degrees) {
  if (!(degrees > 0.0)) return std::numeric_limits<double>::infinity();
  return boost::math::quantile(boost::math::students_t(degrees), 0.975);
}

OneMore one_more(std::span<const double> values) {
  if (values.size() < 2) return {};
  const auto n = static_cast<double>(values.size());
  const double mean = std::accumulate(values.begin(), values.end(), 0.0) / n;
  double squares = 0.0;
  for (const double value : values) squares += (value - mean) * (value - mean);
  const double deviation = std::sqrt(squares / (n - 1.0) * (1.0 + 1.0 / n));
  return {deviation, students_t_975(n - 1.0) * deviation};
}

}  // namespace ravencal::core
