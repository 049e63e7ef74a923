// SPDX-License-Identifier: Apache-2.0
#include "conversion/scaling_file.hpp"
#include "fuzz/inputs.hpp"

namespace ravencal::fuzz {

void try_json(Bytes bytes) {
  const auto path = scratch_file("fuzz.json", bytes);
  const auto file = conversion::read_scaling_file(path);
  if (!read_or_words(file, path.string())) return;
  const auto inputs = static_cast<Eigen::Index>(file->features.size());
  const auto outputs = static_cast<Eigen::Index>(file->outputs.size());
  promise(file->feature_to_si.size() == inputs && file->output_to_si.size() == outputs,
          "a unit for each value");
  promise((file->feature_to_si.array() > 0.0).all(), "a unit is above zero");
  if (file->input) promise((file->input->scale.array() > 0.0).all(), "a scale is above zero");
  if (file->output) promise((file->output->scale.array() > 0.0).all(), "a scale is above zero");
  promise(file->row_period_s > 0.0, "rows have a period");
}

}  // namespace ravencal::fuzz
