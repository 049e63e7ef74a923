// SPDX-License-Identifier: Apache-2.0
#include "study/compare_seeds.hpp"

namespace ravencal::study {

learn::SharedSeeds shared_with_tests(const CompareData& data) {
  std::vector<const record::Recording*> tested;
  for (const auto& [name, set] : data.sets) tested.insert(tested.end(), set.begin(), set.end());
  return learn::shared_seeds(learn::seeds_of(data.train), tested);
}

}  // namespace ravencal::study
