// SPDX-License-Identifier: Apache-2.0
#include "diagnose/fit/boosted_trees.hpp"

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

/// Features as bin numbers by quantiles, a row's side by side.
class Bins {
 public:
  explicit Bins(const Eigen::MatrixXd& features)
      : features_(static_cast<std::size_t>(features.cols())),
        bin_(static_cast<std::size_t>(features.size())) {
    for (std::size_t f = 0; f < features_; ++f) {
      const auto column = features.col(static_cast<Index>(f));
      std::vector<double> sorted(column.data(), column.data() + column.size());
      std::sort(sorted.begin(), sorted.end());
      std::vector<double> edges;
      for (int b = 1; b < kBins; ++b)
        edges.push_back(sorted[sorted.size() * static_cast<std::size_t>(b) / kBins]);
      for (Index i = 0; i < column.size(); ++i) {
        const auto edge = std::upper_bound(edges.begin(), edges.end(), column[i]);
        bin_[static_cast<std::size_t>(i) * features_ + f] =
            static_cast<std::uint8_t>(edge - edges.begin());
      }
    }
  }

  [[nodiscard]] std::size_t features() const { return features_; }
  [[nodiscard]] const std::uint8_t* row(std::size_t i) const { return &bin_[i * features_]; }

 private:
  std::size_t features_;
  std::vector<std::uint8_t> bin_;
};

struct Split {
  std::size_t feature = 0;
  int bin = kBins;  ///< rows with a bin <= this go left; all of them where nothing is gained
};

/// A complete tree of kDepth levels; leaves by path.
struct Tree {
  std::array<Split, (1U << kDepth) - 1> splits;
  std::array<double, 1U << kDepth> leaves{};

  [[nodiscard]] double predict(const std::uint8_t* bins) const {
    std::size_t node = 0;
    for (int d = 0; d < kDepth; ++d) {
      const Split& split = splits[node];
      node = 2 * node + (bins[split.feature] > split.bin ? 2 : 1);
    }
    return leaves[node - splits.size()];
  }
};

class Grower {
 public:
  Grower(const Bins& bins, std::vector<double>& importance)
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
    for (const std::size_t row : rows)
      (bins_.row(row)[split.feature] > split.bin ? right : left).push_back(row);
    grow_node(tree, 2 * node + 1, left, residual);
    grow_node(tree, 2 * node + 2, right, residual);
  }

  /// What each bin of each feature holds.
  struct Histogram {
    std::array<double, kBins> sum{};
    std::array<double, kBins> count{};
  };

  [[nodiscard]] std::vector<Histogram> histograms_of(const std::vector<std::size_t>& rows,
                                                     const VectorXd& residual) const {
    std::vector<Histogram> histograms(bins_.features());
    for (const std::size_t row : rows) {
      const std::uint8_t* bins = bins_.row(row);
      const double value = residual[static_cast<Index>(row)];
      for (std::size_t f = 0; f < histograms.size(); ++f) {
        histograms[f].sum[bins[f]] += value;
        histograms[f].count[bins[f]] += 1.0;
      }
    }
    return histograms;
  }

  Split best_split(const std::vector<std::size_t>& rows, const VectorXd& residual) {
    Split best;
    double best_gain = 0.0;
    const double least = std::max(10.0, static_cast<double>(rows.size()) / 50.0);
    const std::vector<Histogram> histograms = histograms_of(rows, residual);
    for (std::size_t f = 0; f < histograms.size(); ++f) {
      const auto& [sum, count] = histograms[f];
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
          best = {f, b};
        }
      }
    }
    importance_[best.feature] += best_gain;
    return best;
  }

  const Bins& bins_;
  std::vector<double>& importance_;
};

}  // namespace

HeldOutPrediction boosted_held_out(const Blocks& blocks, const Eigen::MatrixXd& features,
                                   const VectorXd& target) {
  HeldOutPrediction out;
  out.value = VectorXd::Zero(target.size());
  out.importance.assign(static_cast<std::size_t>(features.cols()), 0.0);
  const Bins bins(features);
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
        residual[static_cast<Index>(row)] -= tree.predict(bins.row(row));
      for (const std::size_t row : ask)
        out.value[static_cast<Index>(row)] += tree.predict(bins.row(row));
    }
  }
  double sum = 1e-300;
  for (const double value : out.importance) sum += value;
  for (double& value : out.importance) value /= sum;
  return out;
}

}  // namespace ravencal::diagnose
