// SPDX-License-Identifier: Apache-2.0
#include "choice/selection.hpp"

#include <algorithm>
#include <optional>

namespace ravencal::choice {
namespace {

std::vector<Eigen::Index> with(const std::vector<Eigen::Index>& columns, const InputSet& block) {
  std::vector<Eigen::Index> all = columns;
  all.insert(all.end(), block.columns.begin(), block.columns.end());
  std::sort(all.begin(), all.end());
  return all;
}

/// Joints whose effect depends on another joint's position show only in a model that is not linear;
/// a few gentle units are enough to see it.
constexpr Eigen::Index kProbeUnits = 60;
constexpr double kProbeSteepness = 0.3;

std::vector<double> probe(const std::vector<Eigen::Index>& columns, const JointRows& rows) {
  const Eigen::Index units = std::min(kProbeUnits, rows.errors.size() / 8);
  return mean_squares(try_basis({}, {columns, units, kProbeSteepness, 1}, rows).left);
}

}  // namespace

InputSet selected_inputs(const OutputInputs& inputs, const JointRows& rows) {
  InputSet selected = inputs.own;
  std::vector<InputSet> blocks = inputs.others;
  std::vector<double> squares = probe(selected.columns, rows);
  while (!blocks.empty()) {
    std::vector<std::vector<double>> candidates = {squares};
    std::optional<std::size_t> best;
    for (std::size_t b = 0; b < blocks.size(); ++b) {
      std::vector<double> of_block = probe(with(selected.columns, blocks[b]), rows);
      if (simplest_of_best({squares, of_block}) == 0) continue;
      if (best && simplest_of_best({of_block, candidates.back()}) == 0) continue;
      best = b;
      candidates.push_back(std::move(of_block));
    }
    if (!best) return selected;
    selected.columns = with(selected.columns, blocks[*best]);
    squares = candidates.back();
    blocks.erase(blocks.begin() + static_cast<std::ptrdiff_t>(*best));
  }
  return selected;
}

}  // namespace ravencal::choice
