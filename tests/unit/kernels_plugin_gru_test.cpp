// SPDX-License-Identifier: Apache-2.0
//
// A GRU through blob and plugin: what a host sees, tick by tick, against the window in double.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>

#include "model/blob_writer.hpp"
#include "rt/rig.hpp"
#include "unit/kernels_gru.hpp"

namespace ravencal::test {
namespace {

using kernels_test::GruNetwork;
using model::packed::Precision;

constexpr kernels_test::GruShape kShape = {3, 21, 4, 2, 19};
constexpr std::size_t kTicksPerRow = 10;  // make_model: rows of 10 ms
constexpr std::size_t kStride = 2 * kTicksPerRow;
constexpr std::size_t kSpan = 3 * kStride;
constexpr double kOutputScale = 1e-3;

/// The network behind the positions of the three joints.
model::CalibrationModel model_of(const GruNetwork& network) {
  using RowMajor = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  model::CalibrationModel model =
      make_model({plain("jpos.shoulder"), plain("jpos.elbow"), plain("jpos.insertion")}, {4});
  model.output.mean.setZero();
  model.output.scale.setConstant(kOutputScale);
  model.layers.clear();
  for (const kernels::LayerSource& source : kernels_test::gru_sources(network)) {
    model::DenseLayer layer;
    layer.weights = Eigen::Map<const RowMajor>(source.weights, source.outputs, source.inputs);
    layer.biases = Eigen::Map<const Eigen::VectorXf>(source.biases, source.outputs);
    layer.activation = source.activation;
    layer.kind = source.kind;
    layer.window = source.window;
    layer.stride_rows = source.stride_rows;
    model.layers.push_back(layer);
  }
  return model;
}

/// Moves the joints each tick and knows what the network should have seen.
class GruPlugin : public ::testing::Test {
 protected:
  void start(Precision precision) {
    rig_.load(model_, precision);
    ASSERT_FALSE(HasFatalFailure());
    rig_.enable();
  }
  void tick(bool lost = false) {
    std::vector<float> sample(3);
    for (std::size_t j = 0; j < 3; ++j) {
      const auto i = static_cast<Eigen::Index>(j);
      sample[j] = 0.5F * std::sin(0.03F * static_cast<float>(++ticks_) * static_cast<float>(j + 1));
      const double value =
          model_.input.mean[i] + model_.input.scale[i] * static_cast<double>(sample[j]);
      rig_.state.arm[0].jpos_ji[slot_of_[j]] = static_cast<float>(value);
    }
    if (lost) rig_.state.arm[0].jpos_ji[0] = std::numeric_limits<float>::quiet_NaN();
    past_.push_back(sample);
    rig_.tick();
    if (past_.size() > kSpan + 1) past_.pop_front();
  }
  [[nodiscard]] bool warms_up() const {
    return (rig_.output.doubts & RAVENCAL_DOUBT_WARMING_UP) != 0;
  }
  [[nodiscard]] double error() const {
    std::vector<std::vector<float>> window;
    for (std::size_t k = 0; k < kShape.window; ++k) window.push_back(past_[k * kStride]);
    const auto expected = kernels_test::reference_gru(network_, window);
    double worst = 0.0;
    for (std::size_t j = 0; j < 3; ++j) {
      const double seen = static_cast<double>(rig_.output.predicted_ji[j]) / kOutputScale;
      worst = std::max(worst, std::abs(seen - expected[j]));
    }
    return worst;
  }

  const GruNetwork network_ = kernels_test::random_gru(kShape, 1);
  const model::CalibrationModel model_ = model_of(network_);
  static constexpr std::size_t slot_of_[] = {0, 1, 2};
  Rig rig_;
  std::deque<std::vector<float>> past_;
  int ticks_ = 0;
};

TEST_F(GruPlugin, PredictsAsTheWindowInDoubleOnceItIsWhole) {
  start(Precision::kFloat32);
  for (std::size_t i = 0; i < 3 * kSpan; ++i) {
    tick();
    EXPECT_EQ(warms_up(), i < kSpan) << i;
    if (!warms_up()) {
      EXPECT_LT(error(), 1e-4) << i;
    }
  }
}

TEST_F(GruPlugin, PredictsInInt8AsCloselyAsItsWeightsAreRounded) {
  start(Precision::kInt8);
  for (std::size_t i = 0; i < 2 * kSpan; ++i) tick();
  EXPECT_LT(error(), 0.08);
}

TEST_F(GruPlugin, IsInDoubtUntilALostSampleHasLeftTheWindow) {
  start(Precision::kFloat32);
  for (std::size_t i = 0; i < 2 * kSpan; ++i) tick();
  tick(true);
  EXPECT_NE(rig_.output.doubts & RAVENCAL_DOUBT_NOT_FINITE, 0U);
  for (std::size_t i = 0; i < 2 * kSpan; ++i) {
    tick();
    EXPECT_EQ(warms_up(), i < kSpan) << i;
    EXPECT_EQ(rig_.output.doubts & RAVENCAL_DOUBT_NETWORK, 0U);
    if (!warms_up()) {
      EXPECT_LT(error(), 1e-4) << i;
    }
  }
}

TEST_F(GruPlugin, BeginsItsWindowWhenTheOldestInputIsThere) {
  constexpr std::size_t kLagRows = 5;
  model::CalibrationModel lagging = model_;
  lagging.features =
      make_model({lagged("jpos.shoulder", kLagRows), plain("jpos.elbow"), plain("jpos.insertion")},
                 {4})
          .features;
  rig_.load(lagging, Precision::kFloat32);
  ASSERT_FALSE(HasFatalFailure());
  rig_.enable();
  for (std::size_t i = 0; i < kLagRows * kTicksPerRow + 2 * kSpan; ++i) {
    tick();
    EXPECT_EQ(warms_up(), i < kLagRows * kTicksPerRow + kSpan) << i;
  }
}

TEST_F(GruPlugin, ComesBackFromItsBlobAsItWas) {
  const auto path = write_weights(model_, "gru");
  const auto read = model::read_blob(path);
  ASSERT_TRUE(read.ok()) << read.error().message;
  ASSERT_EQ(read->layers.size(), model_.layers.size());
  for (std::size_t l = 0; l < model_.layers.size(); ++l) {
    EXPECT_EQ(read->layers[l].weights, model_.layers[l].weights);
    EXPECT_EQ(read->layers[l].kind, model_.layers[l].kind);
    EXPECT_EQ(read->layers[l].window, model_.layers[l].window);
    EXPECT_EQ(read->layers[l].stride_rows, model_.layers[l].stride_rows);
  }
}

}  // namespace
}  // namespace ravencal::test
