// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace ravencal::core {

/// The 97.5 % quantile of Student's t: half of an interval that holds 95 %, in estimated standard
/// deviations. `degrees` of freedom: 1.96 for very many, 12.7 for one, infinity for none.
double students_t_975(double degrees);

}  // namespace ravencal::core
