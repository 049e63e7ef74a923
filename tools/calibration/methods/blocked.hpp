// SPDX-License-Identifier: Apache-2.0
//
// Choosing a setting on training data alone: the rows are cut into contiguous blocks, each is held
// out in turn (neighbouring rows resemble each other, so rows drawn at random would flatter), and
// the setting with the least geometric mean of RMSE over outputs wins. Published splits stay what
// they are: no test row is ever seen.
#pragma once

#include <functional>
#include <vector>

#include "methods/method.hpp"

namespace ravencal::methods {

inline constexpr int kFolds = 4;

/// Training and held-out part of fold `fold`: equal numbers of rows that train.
struct Fold {
  std::vector<Series> train;
  std::vector<Series> held_out;
};
Fold make_fold(std::span<const Series> all, int fold);

/// Geometric mean over outputs of the RMSE that `predictor` leaves on `series`.
double score(Predictor& predictor, std::span<const Series> series);

/// Index of the best of `count` candidates; `fit` makes one from training series.
using FitCandidate =
    std::function<core::Result<std::unique_ptr<Predictor>>(std::size_t, std::span<const Series>)>;
core::Result<std::size_t> choose(std::span<const Series> train, std::size_t count,
                                 const FitCandidate& fit);

}  // namespace ravencal::methods
