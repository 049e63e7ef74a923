// SPDX-License-Identifier: Apache-2.0
//
// Which other joints an error depends on: coupled cables do, most pairs of joints do not, and
// inputs that say nothing here may say something wrong elsewhere.
#pragma once

#include "choice/input_sets.hpp"
#include "choice/trial.hpp"

namespace ravencal::choice {

/// The output's own inputs, and the blocks of other joints that lower the error of a small model on
/// held-out rows beyond the standard error of the difference: greedily, the best block first.
InputSet selected_inputs(const OutputInputs& inputs, const JointRows& rows);

}  // namespace ravencal::choice
