// SPDX-License-Identifier: Apache-2.0
//
// Blocks of training rows: the unit in which evidence is counted. Neighbouring samples repeat each
// other, so every statistic of this folder treats one block, never one sample, as one observation.
#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

#include "diagnose/series/series.hpp"

namespace ravencal::diagnose {

struct Blocks {
  std::vector<Eigen::Index> rows;   ///< training rows in order of time
  std::vector<Eigen::Index> begin;  ///< first entry of `rows` per block, and rows.size() at the end
  std::vector<int> fold;            ///< of each block

  [[nodiscard]] std::size_t count() const { return fold.size(); }
  [[nodiscard]] Eigen::Index first(std::size_t block) const { return begin[block]; }
  [[nodiscard]] Eigen::Index size(std::size_t block) const {
    return begin[block + 1] - begin[block];
  }

  /// Training rows of a full column, or of each column of a matrix.
  [[nodiscard]] Eigen::MatrixXd gather(const Eigen::MatrixXd& full) const;
};

/// Stretches of training rows without a new start inside: [first, last) as indices into `rows`.
std::vector<std::pair<Eigen::Index, Eigen::Index>> stretches_of(
    const Series& series, const std::vector<Eigen::Index>& rows);

inline constexpr int kFolds = 6;
inline constexpr std::size_t kMostBlocks = 60;
inline constexpr std::size_t kFewestBlocks = 12;

/// Cuts the training rows into blocks that never reach across a recording or episode and, as far as
/// lengths allow, begin at a reversal. `correlation_rows`: rows over which the residual resembles
/// itself; a block spans at least five of those where kFewestBlocks permit. Folds are
/// interleaved, or whole recordings, or runs of episodes where there are several.
///
/// `events`: energies per training row of what may have acted in a single block, which no other
/// block can then repeat. Where so few blocks hold one that a gain could not be repeated, it is cut
/// into parts. Noise may last as long as the event and is then seen once; but of an effect far
/// above the noise the parts say whether it holds throughout.
Blocks make_blocks(const Series& series, double correlation_rows,
                   const std::vector<Eigen::VectorXd>& events = {});

/// Sum of autocorrelations 1 + 2 sum rho(k) up to the first negative one, in rows, of `residual`
/// given per training row.
double correlation_length(const Series& series, const Blocks& blocks,
                          const Eigen::VectorXd& residual);

}  // namespace ravencal::diagnose
