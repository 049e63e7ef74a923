// SPDX-License-Identifier: Apache-2.0
#include "diagnose/effects/effect_form.hpp"

namespace ravencal::diagnose {

Eigen::MatrixXd seen_columns(const EffectForm& form, const Series& series, const Shape& shape) {
  Eigen::MatrixXd columns = form.columns(series, shape);
  if (form.as_seen_already()) return columns;
  for (Eigen::Index c = 0; c < columns.cols(); ++c) columns.col(c) = series.as_seen(columns.col(c));
  return columns;
}

}  // namespace ravencal::diagnose
