// SPDX-License-Identifier: Apache-2.0
#include "methods/forest.hpp"

#include <algorithm>
#include <span>

#include "core/random.hpp"

namespace ravencal::methods {
namespace {

constexpr int kBins = 32;

}  // namespace

class Forest::Grower {
 public:
  Grower(const Eigen::MatrixXd& inputs, const Eigen::MatrixXd& targets, const Options& options,
         std::vector<Eigen::VectorXd>& leaves)
      : targets_(targets.transpose()),
        options_(options),
        leaves_(leaves),
        bins_(inputs.cols(), inputs.rows()),
        edges_(static_cast<std::size_t>(inputs.cols())) {
    for (Eigen::Index c = 0; c < inputs.cols(); ++c) {
      std::vector<double> sorted(inputs.col(c).data(), inputs.col(c).data() + inputs.rows());
      std::sort(sorted.begin(), sorted.end());
      std::vector<double>& edges = edges_[static_cast<std::size_t>(c)];
      for (int b = 1; b < kBins; ++b) {
        const double edge = sorted[sorted.size() * static_cast<std::size_t>(b) / kBins];
        if (edges.empty() || edge > edges.back()) edges.push_back(edge);
      }
      for (Eigen::Index row = 0; row < inputs.rows(); ++row) {
        bins_(c, row) = static_cast<std::uint8_t>(
            std::lower_bound(edges.begin(), edges.end(), inputs(row, c)) - edges.begin());
      }
    }
  }

  std::vector<Node> grow(std::uint64_t seed) {
    random_ = core::Random(seed);
    nodes_.clear();
    std::vector<std::int32_t> rows(static_cast<std::size_t>(targets_.cols()));
    for (auto& row : rows)
      row = static_cast<std::int32_t>(random_.below(static_cast<std::uint64_t>(rows.size())));
    split(rows, 0);
    return std::move(nodes_);
  }

 private:
  struct Best {
    Eigen::Index input = -1;
    int bin = 0;
    double gain = 0.0;
  };

  /// Grows the node of `rows` and everything below; returns its index.
  std::int32_t split(std::span<std::int32_t> rows, std::uint32_t depth) {
    const auto index = static_cast<std::int32_t>(nodes_.size());
    nodes_.emplace_back();
    const Best best = depth < options_.deepest && rows.size() >= 2 * options_.least_leaf
                          ? best_split(rows)
                          : Best{};
    if (best.input < 0) {
      Eigen::VectorXd mean = Eigen::VectorXd::Zero(targets_.rows());
      for (const std::int32_t row : rows) mean += targets_.col(row);
      nodes_.back().left = static_cast<std::int32_t>(leaves_.size());
      leaves_.push_back(mean / static_cast<double>(rows.size()));
      return index;
    }
    const auto middle = std::partition(rows.begin(), rows.end(), [&](std::int32_t row) {
      return bins_(best.input, row) <= best.bin;
    });
    const auto count = static_cast<std::size_t>(middle - rows.begin());
    const std::int32_t left = split(rows.first(count), depth + 1);
    const std::int32_t right = split(rows.subspan(count), depth + 1);
    Node& node = nodes_[static_cast<std::size_t>(index)];
    node.input = static_cast<std::int32_t>(best.input);
    node.threshold =
        edges_[static_cast<std::size_t>(best.input)][static_cast<std::size_t>(best.bin)];
    node.left = left;
    node.right = right;
    return index;
  }

  /// The split that lowers the squared error most, among a third of the inputs.
  Best best_split(std::span<const std::int32_t> rows) {
    std::vector<Eigen::Index> inputs(static_cast<std::size_t>(bins_.rows()));
    for (std::size_t i = 0; i < inputs.size(); ++i) inputs[i] = static_cast<Eigen::Index>(i);
    random_.shuffle(std::span(inputs));
    inputs.resize(std::max<std::size_t>(1, (inputs.size() + 2) / 3));
    Best best;
    Eigen::MatrixXd sums(targets_.rows(), kBins);
    for (const Eigen::Index input : inputs) {
      sums.setZero();
      std::array<int, kBins> counts{};
      for (const std::int32_t row : rows) {
        const int bin = bins_(input, row);
        sums.col(bin) += targets_.col(row);
        ++counts[static_cast<std::size_t>(bin)];
      }
      const Eigen::VectorXd total = sums.rowwise().sum();
      const auto all = static_cast<double>(rows.size());
      Eigen::VectorXd left = Eigen::VectorXd::Zero(targets_.rows());
      int left_count = 0;
      const auto edges = static_cast<int>(edges_[static_cast<std::size_t>(input)].size());
      for (int bin = 0; bin < edges; ++bin) {
        left += sums.col(bin);
        left_count += counts[static_cast<std::size_t>(bin)];
        const int right_count = static_cast<int>(rows.size()) - left_count;
        const auto least = static_cast<int>(options_.least_leaf);
        if (left_count < least || right_count < least) continue;
        const double gain = left.squaredNorm() / left_count +
                            (total - left).squaredNorm() / right_count - total.squaredNorm() / all;
        if (gain > best.gain * (1.0 + 1e-12) + 1e-300) best = {input, bin, gain};
      }
    }
    return best;
  }

  Eigen::MatrixXd targets_;  ///< [outputs x rows]
  Options options_;
  std::vector<Eigen::VectorXd>& leaves_;
  Eigen::Matrix<std::uint8_t, Eigen::Dynamic, Eigen::Dynamic> bins_;  ///< [inputs x rows]
  std::vector<std::vector<double>> edges_;
  std::vector<Node> nodes_;
  core::Random random_{0};
};

Forest::Forest(const Eigen::MatrixXd& inputs, const Eigen::MatrixXd& targets,
               const Options& options, const std::function<bool(double)>& keep_going) {
  Grower grower(inputs, targets, options, leaves_);
  for (std::uint32_t t = 0; t < options.trees; ++t) {
    if (t > 0 && !keep_going(static_cast<double>(t) / options.trees)) return;
    trees_.push_back(grower.grow(options.seed + 1000003ULL * t));
  }
}

Eigen::VectorXd Forest::predict(const Eigen::Ref<const Eigen::VectorXd>& inputs) const {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(leaves_.front().size());
  for (const std::vector<Node>& tree : trees_) {
    const Node* node = tree.data();
    while (node->input >= 0)
      node = &tree[static_cast<std::size_t>(inputs[node->input] <= node->threshold ? node->left
                                                                                   : node->right)];
    sum += leaves_[static_cast<std::size_t>(node->left)];
  }
  return sum / static_cast<double>(trees_.size());
}

std::size_t Forest::parameters() const {
  std::size_t count = leaves_.size() * static_cast<std::size_t>(leaves_.front().size());
  for (const std::vector<Node>& tree : trees_) count += tree.size() / 2;
  return count;
}

}  // namespace ravencal::methods
