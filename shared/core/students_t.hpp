// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

namespace ravencal::core {

/// The 97.5 % quantile of Student's t: half of an interval that holds 95 %, in estimated standard
/// deviations. `degrees` of freedom: 1.96 for very many, 12.7 for one, infinity for none.
double students_t_975(double degrees);

/// How far one more value may lie from the mean of those that are known, all normal of one unknown
/// mean and spread.
struct OneMore {
  double deviation = 0.0;  ///< standard deviation; 0 beside fewer than two values
  double half95 = 0.0;     ///< half of the interval that holds it in 95 %; 0 likewise
};
OneMore one_more(std::span<const double> values);

}  // namespace ravencal::core
