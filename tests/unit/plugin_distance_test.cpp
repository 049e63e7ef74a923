// SPDX-License-Identifier: Apache-2.0
//
// Inputs that are each in range but together unlike the training set: the correction fades with
// their distance.
#include <gtest/gtest.h>

#include <Eigen/QR>
#include <cmath>
#include <limits>
#include <random>

#include "core/catalogue.hpp"
#include "plugin_host/robot_state.hpp"
#include "rt/rig.hpp"

namespace ravencal::test {
namespace {

/// Joint and motor of the elbow were always equal in training, up to a tenth of their spread.
model::CalibrationModel make_model_of_a_line() {
  model::CalibrationModel model = make_model({plain("jpos.elbow"), plain("jpos.shoulder")}, {});
  model.input.mean.setConstant(0.25);
  model.input.scale.setConstant(0.25);
  model.input_min.setConstant(-0.25);
  model.input_max.setConstant(0.75);
  model::TrustRegion region;
  region.directions = Eigen::RowVector2f(std::sqrt(0.5F), std::sqrt(0.5F));
  region.inverse_variance = Eigen::VectorXf::Constant(1, 0.5F);
  region.inverse_residual_variance = 100.0F;
  region.full_distance = 4.0F;
  region.none_distance = 9.0F;
  model.trust = region;
  return model;
}

class Distance : public ::testing::Test {
 protected:
  void SetUp() override {
    model = make_model_of_a_line();
    rig.load(model);
    place(0.0, 0.0);
    rig.enable();
    ASSERT_TRUE(rig.tick_until(RAVENCAL_STATE_ACTIVE));
  }

  /// Along and across the line, in spreads of the inputs.
  void place(double along, double across) {
    const double r = std::sqrt(0.5);
    rig.state.arm[0].jpos_ji[1] = static_cast<float>(0.25 + 0.25 * r * (along + across));
    rig.state.arm[0].jpos_ji[0] = static_cast<float>(0.25 + 0.25 * r * (along - across));
  }

  model::CalibrationModel model;
  Rig rig;
};

TEST_F(Distance, LeavesTheCorrectionWholeNearTheTrainingSet) {
  place(1.5, 0.1);  // d2 = (1.125 + 1) / 2
  for (int i = 0; i < 1000; ++i) rig.tick();
  EXPECT_EQ(rig.output.confidence, 1.0F);
  EXPECT_EQ(rig.output.correction_ji[0], rig.output.predicted_ji[0]);
}

TEST_F(Distance, FadesTheCorrectionWithIt) {
  // across^2 * 100 / 2 = 6.5: half of the way from 4 to 9.
  place(0.0, std::sqrt(0.13));
  for (int i = 0; i < 2000; ++i) rig.tick();
  EXPECT_EQ(rig.output.state, RAVENCAL_STATE_ACTIVE);
  EXPECT_EQ(rig.output.doubts, 0U);
  EXPECT_NEAR(rig.output.confidence, 0.5, 1e-4);
  for (int j = 0; j < RAVENCAL_JOINTS; ++j) {
    // The constant part, the model's output mean, is not in doubt.
    const auto constant = static_cast<float>(model.output.mean[j]);
    EXPECT_NEAR(rig.output.correction_ji[j],
                constant + rig.output.confidence * (rig.output.predicted_ji[j] - constant), 1e-8);
  }
}

TEST_F(Distance, EndsTheCorrectionFarFromTheTrainingSetThoughEachInputIsInRange) {
  place(0.0, 0.5);  // d2 = 12.5, each input a third of its range from the middle
  rig.tick();
  EXPECT_EQ(rig.output.doubts, RAVENCAL_DOUBT_DISTANCE);
  EXPECT_EQ(rig.output.confidence, 0.0F);
  EXPECT_TRUE(rig.tick_until(RAVENCAL_STATE_CONSTANT));
  place(0.0, 0.0);
  EXPECT_TRUE(rig.tick_until(RAVENCAL_STATE_ACTIVE));
}

TEST_F(Distance, OfWhatIsNoNumberIsNotTrusted) {
  place(0.0, std::numeric_limits<double>::quiet_NaN());
  rig.tick();
  EXPECT_EQ(rig.output.confidence, 0.0F);
  EXPECT_EQ(rig.output.doubts, RAVENCAL_DOUBT_NOT_FINITE);
}

/// Channels that a state holds as floats, the first `count` of them.
std::vector<model::FeatureSpec> float_channels(std::size_t count) {
  using core::RavenField;
  std::vector<model::FeatureSpec> features;
  for (const core::CatalogueEntry& entry : core::catalogue()) {
    const bool is_float = entry.field == RavenField::kJpos || entry.field == RavenField::kMpos ||
                          entry.field == RavenField::kMvel || entry.field == RavenField::kTau ||
                          entry.field == RavenField::kOri || entry.field == RavenField::kMposD ||
                          entry.field == RavenField::kJvel || entry.field == RavenField::kJposD;
    if (is_float && features.size() < count) features.push_back(plain(entry.name));
  }
  return features;
}

model::TrustRegion any_region(Eigen::Index inputs, Eigen::Index rank, std::mt19937& random) {
  std::normal_distribution<float> normal;
  const Eigen::MatrixXf any =
      Eigen::MatrixXf::NullaryExpr(inputs, rank, [&] { return normal(random); });
  const Eigen::HouseholderQR<Eigen::MatrixXf> basis(any);
  model::TrustRegion region;
  region.directions = (basis.householderQ() * Eigen::MatrixXf::Identity(inputs, rank)).transpose();
  region.inverse_variance = Eigen::VectorXf::LinSpaced(rank, 0.3F, 2.0F);
  region.inverse_residual_variance = 20.0F;
  region.full_distance = 1e-6F;
  region.none_distance = 20.0F;
  return region;
}

TEST(DistanceOf, EveryRankAndNumberOfInputsIsThatOfTheModel) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(-0.9, 0.9);
  for (const std::size_t inputs : {1U, 15U, 16U, 37U, 100U}) {
    for (const Eigen::Index rank : {1, 3, 16}) {
      const auto n = static_cast<Eigen::Index>(inputs);
      if (rank > n) continue;
      model::CalibrationModel model = make_model(float_channels(inputs), {});
      model.trust = any_region(n, rank, random);
      Rig rig;
      rig.load(model);
      for (int i = 0; i < 20; ++i) {
        plugin_host::CatalogueValues values{};
        Eigen::MatrixXf scaled(n, 1);
        for (Eigen::Index c = 0; c < n; ++c) {
          const auto& channel = model.features[static_cast<std::size_t>(c)].channel;
          const double x = uniform(random);
          scaled(c, 0) = static_cast<float>(x);
          values[*core::catalogue_index_of(channel)] =
              model.input.mean[c] + model.input.scale[c] * x;
        }
        plugin_host::fill_state(values, rig.state.t_ns, true, rig.state);
        rig.api().observe_cycle_end(rig.instance.get(), &rig.state);
        rig.tick();
        const float expected = model.trust->confidence(model.trust->distances(scaled)[0]);
        EXPECT_GT(expected, 0.0F);
        EXPECT_NEAR(rig.output.confidence, expected, 1e-5) << inputs << " inputs, rank " << rank;
      }
    }
  }
}

}  // namespace
}  // namespace ravencal::test
