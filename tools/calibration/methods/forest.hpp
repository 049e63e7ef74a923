// SPDX-License-Identifier: Apache-2.0
//
// A random forest for regression (Breiman, Machine Learning 45, 2001) with vector-valued leaves.
// Own code: dlib's is one output at a time and its Debian package pulls in OpenCV and X11. Splits
// are sought among 32 quantiles of a third of the inputs. Same seed, same forest.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <vector>

namespace ravencal::methods {

class Forest {
 public:
  struct Options {
    std::uint32_t trees = 100;
    std::uint32_t least_leaf = 5;  ///< rows
    std::uint32_t deepest = 16;
    std::uint64_t seed = 3;
  };

  /// inputs [rows x inputs], targets [rows x outputs], both finite, at least one row. Stops early,
  /// with the trees there are, when `keep_going` (called per tree with the share done) says no.
  Forest(const Eigen::MatrixXd& inputs, const Eigen::MatrixXd& targets, const Options& options,
         const std::function<bool(double)>& keep_going);

  [[nodiscard]] Eigen::VectorXd predict(const Eigen::Ref<const Eigen::VectorXd>& inputs) const;
  /// Thresholds and leaf values.
  [[nodiscard]] std::size_t parameters() const;

 private:
  struct Node {
    std::int32_t input = -1;  ///< -1: a leaf
    std::int32_t left = 0;    ///< of a leaf: index into leaves_
    std::int32_t right = 0;
    double threshold = 0.0;  ///< left if input <= threshold
  };
  class Grower;

  std::vector<std::vector<Node>> trees_;
  std::vector<Eigen::VectorXd> leaves_;
};

}  // namespace ravencal::methods
