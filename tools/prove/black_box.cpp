// SPDX-License-Identifier: Apache-2.0
#include "prove/black_box.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <vector>

#include "prove/generator/random.hpp"

namespace ravencal::prove {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr Index kHidden = 24, kBatch = 64;
constexpr int kEpochs = 40;
constexpr double kRate = 3e-3;  // falls linearly to a tenth

/// One column per row of the recording: samples lie side by side.
MatrixXd inputs_of(const Signals& s) {
  const auto others = static_cast<Index>(s.others.size());
  MatrixXd x(5 + others, s.rows());
  x.row(0) = s.q.transpose();
  x.row(1) = s.v.transpose();
  x.row(2) = s.a.transpose();
  x.row(3) = s.side.transpose();
  x.row(4) = s.weight.transpose();
  for (Index i = 0; i < others; ++i)
    x.row(5 + i) = s.others[static_cast<std::size_t>(i)].transpose();
  return x;
}

/// Mean 0 and deviation 1 over the rows that are learned from.
struct Scaling {
  VectorXd mean, deviation;
  explicit Scaling(const MatrixXd& x) : mean(x.rowwise().mean()) {
    deviation = ((x.colwise() - mean).rowwise().squaredNorm() / static_cast<double>(x.cols()))
                    .cwiseSqrt()
                    .cwiseMax(1e-12);
  }
  [[nodiscard]] MatrixXd operator()(const MatrixXd& x) const {
    return deviation.cwiseInverse().asDiagonal() * (x.colwise() - mean);
  }
};

/// Weights of one layer with Adam's two running moments.
struct Layer {
  MatrixXd w, first, second;  ///< last column: bias
  Layer(Index out, Index in, Random& random)
      : w(out, in + 1), first(MatrixXd::Zero(out, in + 1)), second(first) {
    for (double& value : w.reshaped()) value = random.normal() / std::sqrt(static_cast<double>(in));
    w.col(in).setZero();
  }
  [[nodiscard]] MatrixXd forward(const MatrixXd& x) const {
    return (w.leftCols(w.cols() - 1) * x).colwise() + w.col(w.cols() - 1);
  }
  /// Gradient of what is behind; moves the weights.
  MatrixXd backward(const MatrixXd& x, const MatrixXd& gradient, double rate, int step) {
    const MatrixXd behind = w.leftCols(w.cols() - 1).transpose() * gradient;
    MatrixXd g(w.rows(), w.cols());
    g.leftCols(w.cols() - 1) = gradient * x.transpose();
    g.col(w.cols() - 1) = gradient.rowwise().sum();
    g /= static_cast<double>(x.cols());
    constexpr double kFirst = 0.9, kSecond = 0.999;
    first = kFirst * first + (1.0 - kFirst) * g;
    second = kSecond * second + (1.0 - kSecond) * g.cwiseAbs2();
    const double a = rate / (1.0 - std::pow(kFirst, step));
    const double b = 1.0 / (1.0 - std::pow(kSecond, step));
    w.array() -= a * first.array() / ((b * second.array()).sqrt() + 1e-8);
    return behind;
  }
};

class Network {
 public:
  Network(Index inputs, Random& random)
      : layers_{Layer(kHidden, inputs, random), Layer(kHidden, kHidden, random),
                Layer(1, kHidden, random)} {}

  [[nodiscard]] MatrixXd predict(const MatrixXd& x) const {
    const MatrixXd h = layers_[0].forward(x).array().tanh();
    const MatrixXd g = layers_[1].forward(h).array().tanh();
    return layers_[2].forward(g);
  }

  /// One step down the mean squared error of a batch.
  void learn(const MatrixXd& x, const MatrixXd& y, double rate) {
    ++step_;
    const MatrixXd h = layers_[0].forward(x).array().tanh();
    const MatrixXd g = layers_[1].forward(h).array().tanh();
    MatrixXd d = layers_[2].backward(g, layers_[2].forward(g) - y, rate, step_);
    d.array() *= 1.0 - g.array().square();
    d = layers_[1].backward(h, d, rate, step_);
    d.array() *= 1.0 - h.array().square();
    layers_[0].backward(x, d, rate, step_);
  }

 private:
  std::array<Layer, 3> layers_;
  int step_ = 0;
};

}  // namespace

double black_box_rmse(const Signals& fit, const VectorXd& fit_y, const Signals& test,
                      const VectorXd& test_y) {
  Random random(1, "black box");
  const MatrixXd raw = inputs_of(fit);
  const Scaling scale_x(raw), scale_y(fit_y.transpose());
  const MatrixXd x = scale_x(raw), y = scale_y(fit_y.transpose());
  Network network(x.rows(), random);
  std::vector<Index> order(static_cast<std::size_t>(x.cols()));
  std::iota(order.begin(), order.end(), Index{0});
  for (int epoch = 0; epoch < kEpochs; ++epoch) {
    for (std::size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[random.below(i)]);
    const double rate = kRate * (1.0 - 0.9 * epoch / kEpochs);
    for (std::size_t at = 0; at < order.size(); at += kBatch) {
      const std::size_t end = std::min(order.size(), at + kBatch);
      const std::vector<Index> batch(order.begin() + static_cast<std::ptrdiff_t>(at),
                                     order.begin() + static_cast<std::ptrdiff_t>(end));
      network.learn(x(Eigen::all, batch), y(Eigen::all, batch), rate);
    }
  }
  const MatrixXd said =
      (scale_y.deviation[0] * network.predict(scale_x(inputs_of(test)))).array() + scale_y.mean[0];
  return std::sqrt((test_y.transpose() - said).squaredNorm() / static_cast<double>(test_y.size()));
}

}  // namespace ravencal::prove
