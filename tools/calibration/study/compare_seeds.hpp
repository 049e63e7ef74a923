// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "learn/shared_seeds.hpp"
#include "study/compare.hpp"

namespace ravencal::study {

/// What the recordings of all sets share with the training.
learn::SharedSeeds shared_with_tests(const CompareData& data);

}  // namespace ravencal::study
