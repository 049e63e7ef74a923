// SPDX-License-Identifier: Apache-2.0
//
// Which joints an error depends on: coupled cables make it depend on others, most pairs of joints
// do not, and inputs that say nothing here may say something wrong elsewhere.
#pragma once

#include <vector>

#include "choice/input_sets.hpp"
#include "choice/trial.hpp"

namespace ravencal::choice {

/// Mean squared error per list of a small model of these inputs, SI. Joints whose effect depends on
/// another joint's position show only in a model that is not linear; a few units are enough to see
/// it.
std::vector<double> probe(const std::vector<Eigen::Index>& columns, const JointRows& rows,
                          UnseenConstant unseen = UnseenConstant::kLeftOut);

/// Two selections, equal ones once; a block counts where it lowers the probe's error beyond the
/// standard error of the difference. Forward: the best set of the joint's own inputs, and then the
/// best block of other joints, as long as one counts. Backward: every input, less the block that
/// counts least, as long as one does not count.
std::vector<InputSet> selected_inputs(const OutputInputs& inputs, const JointRows& rows);

}  // namespace ravencal::choice
