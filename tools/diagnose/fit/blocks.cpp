// SPDX-License-Identifier: Apache-2.0
#include "diagnose/fit/blocks.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace ravencal::diagnose {
namespace {

using Eigen::Index;

constexpr Index kShortest = 8;  ///< rows of a block
/// Signs of eight equal gains are chance once in 128; an event is cut into some more parts.
constexpr double kFewBlocks = 8.0;
constexpr double kEventParts = 10.0;

/// The reversal of motion nearest to `cut`, if one lies within `reach` entries.
Index at_reversal(const Series& series, const std::vector<Index>& rows, Index cut, Index reach) {
  const auto moves_up = [&](Index n) {
    return series.motion.v[rows[static_cast<std::size_t>(n)]] > 0.0;
  };
  const auto count = static_cast<Index>(rows.size());
  for (Index d = 0; d <= reach; ++d) {
    for (const Index n : {cut - d, cut + d}) {
      if (n > 0 && n < count && moves_up(n) != moves_up(n - 1)) return n;
    }
  }
  return cut;
}

/// Interleaved within one recording, and within several that each have something of their own to be
/// fitted. Other recordings are held out whole; many short episodes in runs of neighbours, since
/// repeats of one condition must not lie on both sides of the cut.
void assign_folds(const Series& series, std::size_t stretches, Blocks& blocks) {
  const std::size_t count = blocks.begin.size();
  const auto folds = static_cast<std::size_t>(kFolds);
  const auto recording_of = [&](std::size_t b) {
    const Index row = blocks.rows[static_cast<std::size_t>(blocks.begin[b])];
    return static_cast<std::size_t>(series.recording[static_cast<std::size_t>(row)]);
  };
  const bool by_recording =
      count > 0 && !series.each_homed && recording_of(count - 1) - recording_of(0) >= 2;
  for (std::size_t b = 0; b < count; ++b) {
    std::size_t fold = b % folds;
    if (by_recording) {
      fold = recording_of(b) % folds;
    } else if (stretches >= 2 * folds) {
      fold = b * folds / count;
    }
    blocks.fold.push_back(static_cast<int>(fold));
  }
}

/// Blocks that hold an event, were it in equal parts. `begin` without the end.
double blocks_of(const Eigen::VectorXd& energy, const std::vector<Index>& begin) {
  double squares = 0.0;
  for (std::size_t b = 0; b < begin.size(); ++b) {
    const Index last = b + 1 < begin.size() ? begin[b + 1] : energy.size();
    squares += std::pow(energy.segment(begin[b], last - begin[b]).sum(), 2);
  }
  return squares > 0.0 ? std::pow(energy.sum(), 2) / squares : kEventParts;
}

/// Cuts where an event's energy reaches another part of the whole.
void cut_event(const Eigen::VectorXd& energy, std::vector<Index>& begin) {
  const double part = energy.sum() / kEventParts;
  double sum = 0.0;
  double next = part;
  for (Index n = 0; n < energy.size(); ++n) {
    if (sum >= next) {
      begin.push_back(n);
      next = sum + part;
    }
    sum += energy[n];
  }
  std::sort(begin.begin(), begin.end());
  const auto too_near = [last = -kShortest](Index n) mutable {
    if (n - last < kShortest) return true;
    last = n;
    return false;
  };
  std::erase_if(begin, too_near);
}

}  // namespace

std::vector<std::pair<Index, Index>> stretches_of(const Series& series,
                                                  const std::vector<Index>& rows) {
  std::vector<std::pair<Index, Index>> stretches;
  for (std::size_t n = 0; n < rows.size(); ++n) {
    bool starts = n == 0;
    for (Index row = n == 0 ? rows[0] : rows[n - 1] + 1; row <= rows[n] && !starts; ++row) {
      starts = series.fresh[static_cast<std::size_t>(row)] != 0;
    }
    if (starts) stretches.emplace_back(static_cast<Index>(n), static_cast<Index>(n));
    stretches.back().second = static_cast<Index>(n) + 1;
  }
  return stretches;
}

Eigen::MatrixXd Blocks::gather(const Eigen::MatrixXd& full) const {
  Eigen::MatrixXd out(static_cast<Index>(rows.size()), full.cols());
  for (Index c = 0; c < full.cols(); ++c) {
    for (std::size_t n = 0; n < rows.size(); ++n) out(static_cast<Index>(n), c) = full(rows[n], c);
  }
  return out;
}

Blocks make_blocks(const Series& series, double correlation_rows,
                   const std::vector<Eigen::VectorXd>& events) {
  Blocks blocks;
  for (Index i = 0; i < series.rows(); ++i) {
    if (series.trains(i)) blocks.rows.push_back(i);
  }
  const auto total = static_cast<double>(blocks.rows.size());
  const double wanted =
      std::clamp(total / std::max(1.0, 5.0 * correlation_rows), static_cast<double>(kFewestBlocks),
                 static_cast<double>(kMostBlocks));
  const Index length = std::max<Index>(kShortest, static_cast<Index>(total / wanted));
  Index open_rows = 0;  // rows of short stretches that wait to fill a block
  for (const auto& [first, last] : stretches_of(series, blocks.rows)) {
    if (last - first < length && open_rows > 0 && open_rows < length) {
      open_rows += last - first;
      continue;
    }
    const Index parts = std::max<Index>(1, (last - first + length / 2) / length);
    for (Index part = 0; part < parts; ++part) {
      const Index cut = first + (last - first) * part / parts;
      blocks.begin.push_back(part == 0 ? cut : at_reversal(series, blocks.rows, cut, length / 4));
    }
    open_rows = parts == 1 ? last - first : length;
  }
  for (const Eigen::VectorXd& energy : events) {
    if (blocks_of(energy, blocks.begin) < kFewBlocks) cut_event(energy, blocks.begin);
  }
  assign_folds(series, stretches_of(series, blocks.rows).size(), blocks);
  blocks.begin.push_back(static_cast<Index>(blocks.rows.size()));
  return blocks;
}

double correlation_length(const Series& series, const Blocks& blocks,
                          const Eigen::VectorXd& residual) {
  const auto same_stretch = [&](Index a, Index b) {
    for (Index row = blocks.rows[static_cast<std::size_t>(a)] + 1;
         row <= blocks.rows[static_cast<std::size_t>(b)]; ++row) {
      if (series.fresh[static_cast<std::size_t>(row)] != 0) return false;
    }
    return true;
  };
  const Index count = residual.size();
  const double power = residual.squaredNorm() / static_cast<double>(std::max<Index>(1, count));
  if (power <= 0.0) return 1.0;
  double length = 1.0;
  // Lags grow by a tenth: the sum becomes an integral over unequal steps.
  for (Index lag = 1, previous = 0; lag < count / 8;) {
    double sum = 0.0;
    double pairs = 0.0;
    const Index stride = std::max<Index>(1, count / 4000);
    for (Index n = 0; n + lag < count; n += stride) {
      if (lag < 500 && !same_stretch(n, n + lag)) continue;
      sum += residual[n] * residual[n + lag];
      pairs += 1.0;
    }
    const double rho = pairs > 0.0 ? sum / pairs / power : 0.0;
    if (rho <= 0.05) break;
    length += 2.0 * rho * static_cast<double>(lag - previous);
    previous = lag;
    lag = std::max(lag + 1, lag + lag / 10);
  }
  return length;
}

}  // namespace ravencal::diagnose
