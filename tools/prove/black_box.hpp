// SPDX-License-Identifier: Apache-2.0
//
// A black box on the same recordings: a small network learns the residual from position, speed,
// acceleration, direction and the other joints. It names nothing; the error that it removes on the
// held-out run is its only figure.
#pragma once

#include "prove/generator/term_library.hpp"

namespace ravencal::prove {

/// RMS of `test_y` minus the network's prediction, trained on `fit`. Two hidden layers of 24 tanh
/// units, Adam (Kingma and Ba 2015), 40 epochs; same seed every time, so the same figure.
double black_box_rmse(const Signals& fit, const Eigen::VectorXd& fit_y, const Signals& test,
                      const Eigen::VectorXd& test_y);

}  // namespace ravencal::prove
