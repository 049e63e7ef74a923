// SPDX-License-Identifier: Apache-2.0
//
// What the page draws of each drive and position: errors before and after over everything that
// tells look-alikes apart, a map of where they are, what each part of the model takes away, sizes
// by circumstance, and stretches of the recordings.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "diagnose/explain/view.hpp"
#include "diagnose/findings/findings.hpp"
#include "physics/plant.hpp"

namespace ravencal::diagnose {

/// The model as it grows: the given plant with its numbers refitted, then one more effect each.
struct Growth {
  std::string name;  ///< of what was added
  physics::Plant plant;
};

/// The improved plant without one of its effects; its other numbers stay.
struct Without {
  std::string id, joint, from;
  physics::Plant plant;
};

/// `first_recording`: place of the view's first recording in Report::recordings. Fills in the
/// invariance spread of the effects too.
void add_plots(const View& view, const std::vector<Growth>& growth,
               const std::vector<Without>& without, std::size_t first_recording, Report& report);

}  // namespace ravencal::diagnose
