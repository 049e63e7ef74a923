// SPDX-License-Identifier: Apache-2.0
#include "diagnose/boosted_trees.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr int kBins = 32;
constexpr int kTrees = 60;
constexpr int kDepth = 3;
constexpr double kRate = 0.15;
constexpr std::size_t kMostRows = 4000;

/// Features as bin numbers by quantiles, [f][rows].
std::vector<std::vector<std::uint8_t>> binned(const Eigen::MatrixXd& features) {
  std::vector<std::vector<std::uint8_t>> bins(static_cast<std::size_t>(features.cols()));
  for (Index f = 0; f < features.cols(); ++f) {
    std::vector<double> sorted(features.col(f).data(), features.col(f).data() + features.rows());
    std::sort(sorted.begin(), sorted.end());
    std::vector<double> edges;
    for (int b = 1; b < kBins; ++b) {
      edges.push_back(sorted[sorted.size() * static_cast<std::size_t>(b) / kBins]);
    }
    auto& column = bins[static_cast<std::size_t>(f)];
    for (Index i = 0; i < features.rows(); ++i) {
      const auto edge = std::upper_bound(edges.begin(), edges.end(), features(i, f));
      column.push_back(static_cast<std::uint8_t>(edge - edges.begin()));
    }
  }
  return bins;
}

struct Split {
  int feature = -1;
  int bin = 0;  ///< rows with a bin <= this go left
};

/// A complete tree of kDepth levels; leaves by path.
struct Tree {
  std::array<Split, (1U << kDepth) - 1> splits;
  std::array<double, 1U << kDepth> leaves{};

  [[nodiscard]] double predict(const std::vector<std::vector<std::uint8_t>>& bins,
                               std::size_t row) const {
    std::size_t node = 0;
    for (int d = 0; d < kDepth; ++d) {
      const Split& split = splits[node];
      const bool right =
          split.feature >= 0 && bins[static_cast<std::size_t>(split.feature)][row] > split.bin;
      node = 2 * node + (right ? 2 : 1);
    }
    return leaves[node - splits.size()];
  }
};

class Grower {
 public:
  Grower(const std::vector<std::vector<std::uint8_t>>& bins, std::vector<double>& importance)
      : bins_(bins), importance_(importance) {}

  Tree grow(const std::vector<std::size_t>& rows, const VectorXd& residual) {
    Tree tree;
    grow_node(tree, 0, rows, residual);
    return tree;
  }

 private:
  void grow_node(Tree& tree, std::size_t node, const std::vector<std::size_t>& rows,
                 const VectorXd& residual) {
    if (node >= tree.splits.size()) {
      double sum = 0.0;
      for (const std::size_t row : rows) sum += residual[static_cast<Index>(row)];
      tree.leaves[node - tree.splits.size()] =
          rows.empty() ? 0.0 : kRate * sum / static_cast<double>(rows.size());
      return;
    }
    tree.splits[node] = best_split(rows, residual);
    std::vector<std::size_t> left;
    std::vector<std::size_t> right;
    const Split& split = tree.splits[node];
    for (const std::size_t row : rows) {
      const bool goes_right =
          split.feature >= 0 && bins_[static_cast<std::size_t>(split.feature)][row] > split.bin;
      (goes_right ? right : left).push_back(row);
    }
    grow_node(tree, 2 * node + 1, left, residual);
    grow_node(tree, 2 * node + 2, right, residual);
  }

  Split best_split(const std::vector<std::size_t>& rows, const VectorXd& residual) {
    Split best;
    double best_gain = 0.0;
    const double least = std::max(10.0, static_cast<double>(rows.size()) / 50.0);
    for (std::size_t f = 0; f < bins_.size(); ++f) {
      std::array<double, kBins> sum{};
      std::array<double, kBins> count{};
      for (const std::size_t row : rows) {
        sum[bins_[f][row]] += residual[static_cast<Index>(row)];
        count[bins_[f][row]] += 1.0;
      }
      double total = 0.0;
      for (const double value : sum) total += value;
      const auto all = static_cast<double>(rows.size());
      double left_sum = 0.0;
      double left_count = 0.0;
      for (int b = 0; b + 1 < kBins; ++b) {
        left_sum += sum[static_cast<std::size_t>(b)];
        left_count += count[static_cast<std::size_t>(b)];
        if (left_count < least || all - left_count < least) continue;
        const double right_sum = total - left_sum;
        const double gain = left_sum * left_sum / left_count +
                            right_sum * right_sum / (all - left_count) - total * total / all;
        if (gain > best_gain) {
          best_gain = gain;
          best = {static_cast<int>(f), b};
        }
      }
    }
    if (best.feature >= 0) importance_[static_cast<std::size_t>(best.feature)] += best_gain;
    return best;
  }

  const std::vector<std::vector<std::uint8_t>>& bins_;
  std::vector<double>& importance_;
};

}  // namespace

HeldOutPrediction boosted_held_out(const Blocks& blocks, const Eigen::MatrixXd& features,
                                   const VectorXd& target) {
  HeldOutPrediction out;
  out.value = VectorXd::Zero(target.size());
  out.importance.assign(static_cast<std::size_t>(features.cols()), 0.0);
  const auto bins = binned(features);
  const std::size_t stride =
      std::max<std::size_t>(1, static_cast<std::size_t>(target.size()) / kMostRows);
  Grower grower(bins, out.importance);
  for (int fold = 0; fold < kFolds; ++fold) {
    std::vector<std::size_t> learn;
    std::vector<std::size_t> ask;
    for (std::size_t b = 0; b < blocks.count(); ++b) {
      for (Index i = blocks.first(b); i < blocks.first(b) + blocks.size(b); ++i) {
        const auto row = static_cast<std::size_t>(i);
        if (blocks.fold[b] == fold) {
          ask.push_back(row);
        } else if (row % stride == 0) {
          learn.push_back(row);
        }
      }
    }
    if (learn.empty()) continue;
    double mean = 0.0;
    for (const std::size_t row : learn)
      mean += target[static_cast<Index>(row)] / static_cast<double>(learn.size());
    VectorXd residual = target.array() - mean;
    for (const std::size_t row : ask) out.value[static_cast<Index>(row)] = mean;
    for (int t = 0; t < kTrees; ++t) {
      const Tree tree = grower.grow(learn, residual);
      for (const std::size_t row : learn)
        residual[static_cast<Index>(row)] -= tree.predict(bins, row);
      for (const std::size_t row : ask)
        out.value[static_cast<Index>(row)] += tree.predict(bins, row);
    }
  }
  double sum = 1e-300;
  for (const double value : out.importance) sum += value;
  for (double& value : out.importance) value /= sum;
  return out;
}

}  // namespace ravencal::diagnose
