// SPDX-License-Identifier: Apache-2.0
//
// From which size on the search would have named what the best model lacks.
#pragma once

#include <cstddef>
#include <vector>

#include "diagnose/search/search.hpp"

namespace ravencal::diagnose {

struct Limit {
  std::size_t candidate = 0;
  double size = 0.0;  ///< of its first parameter, in that parameter's unit
  /// False: whatever its size, the model's own parameters can make nearly all of what it changes.
  bool apart = true;
};

/// Of every candidate with a name that the best model lacks, at the start where it is seen least: a
/// size that is named nine times in ten.
std::vector<Limit> limits(const Search& search, const Likelihood& training,
                          const Vocabulary& vocabulary);

}  // namespace ravencal::diagnose
