// SPDX-License-Identifier: Apache-2.0
//
// The trust region: that it finds what the rows are like, trusts them, and doubts what is unlike.
#include "model/trust_region.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "model/blob_writer.hpp"
#include "model/trust_fit.hpp"
#include "unit/blob_sample.hpp"

namespace ravencal::test {
namespace {

using model::FeatureMatrix;
using model::TrustRegion;

struct Training {
  FeatureMatrix rows;
  model::Standardiser scaling;
};

/// Rows of [a, 2a + noise, a - b + noise, 7 (constant), b]: two motions seen by four inputs.
Training training_rows(int count, unsigned seed, double noise = 0.02) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  Eigen::MatrixXd rows(count, 5);
  for (int row = 0; row < count; ++row) {
    const double a = normal(random);
    const double b = normal(random);
    rows.row(row) << a, 2.0 * a + noise * normal(random), a - b + noise * normal(random), 7.0, b;
  }
  Training training{rows.cast<float>(), {}};
  const Eigen::MatrixXd seen = training.rows.cast<double>();
  training.scaling.mean = seen.colwise().mean().transpose();
  training.scaling.mean[3] = 7.0;
  const Eigen::MatrixXd centred = seen.rowwise() - training.scaling.mean.transpose();
  training.scaling.scale = (centred.colwise().squaredNorm() / count).cwiseSqrt().transpose();
  training.scaling.scale[3] = 1.0;
  return training;
}

Eigen::MatrixXf scaled(const Training& training, const FeatureMatrix& rows) {
  const Eigen::MatrixXd values = rows.cast<double>().transpose();
  return ((values.colwise() - training.scaling.mean).array().colwise() /
          training.scaling.scale.array())
      .matrix()
      .cast<float>();
}

double share_below(const Eigen::VectorXf& values, float limit) {
  return static_cast<double>((values.array() < limit).count()) / static_cast<double>(values.size());
}

TEST(TrustRegion, HasOrthonormalDirectionsThatHoldTheMotionsAndLeaveConstantsOut) {
  const Training training = training_rows(5000, 1);
  const TrustRegion region = fit_trust_region(training.scaling, training.rows);
  ASSERT_EQ(region.directions.rows(), 2);
  const Eigen::MatrixXf gram = region.directions * region.directions.transpose();
  EXPECT_LT((gram - Eigen::MatrixXf::Identity(2, 2)).cwiseAbs().maxCoeff(), 1e-6F);
  EXPECT_LT(region.directions.col(3).cwiseAbs().maxCoeff(), 1e-6F);
  // Four inputs of variance 1 are two motions: the directions hold all of it but the noise.
  EXPECT_NEAR(region.inverse_variance.cwiseInverse().sum(), 4.0F, 0.01F);
  EXPECT_LE(region.inverse_variance[0], region.inverse_variance[1]);
  EXPECT_LE(region.inverse_variance[1], region.inverse_residual_variance);
  EXPECT_FLOAT_EQ(region.inverse_residual_variance, 1000.0F) << "the noise is below the floor";
}

TEST(TrustRegion, DoubtsNoMoreTrainingRowsThanStatedAndFewOfTheSameKind) {
  for (const int count : {100, 3000, 20000}) {
    const Training training = training_rows(count, 2, 0.2);
    const TrustRegion region = fit_trust_region(training.scaling, training.rows);
    const Eigen::VectorXf distances = region.distances(scaled(training, training.rows));
    const auto beyond = (distances.array() > region.full_distance).count();
    EXPECT_LE(static_cast<double>(beyond), model::kDoubtedShare * count);
    const Eigen::VectorXf fresh =
        region.distances(scaled(training, training_rows(20000, 3, 0.2).rows));
    EXPECT_GT(share_below(fresh, region.full_distance), count < 1000 ? 0.95 : 0.997);
    EXPECT_EQ(share_below(fresh, region.none_distance), 1.0);
    // The residual has the variance that the rows have: on average a row is at distance 1.
    EXPECT_NEAR(distances.mean(), 0.8F, 0.1F) << "four of five inputs vary";
  }
}

TEST(TrustRegion, DoubtsARowWhoseInputsContradictEachOtherWithinTheirRanges) {
  const Training training = training_rows(5000, 4);
  const TrustRegion region = fit_trust_region(training.scaling, training.rows);
  FeatureMatrix rows(2, 5);
  rows << 1.0F, 2.0F, 0.5F, 7.0F, 0.5F,  // as in training
      1.0F, -2.0F, 0.5F, 7.0F, 0.5F;     // the second input says that the first is -1
  const Eigen::VectorXf distances = region.distances(scaled(training, rows));
  EXPECT_EQ(region.confidence(distances[0]), 1.0F);
  EXPECT_EQ(region.confidence(distances[1]), 0.0F);
}

TEST(TrustRegion, ConfidenceFallsFromOneToZeroBetweenItsDistances) {
  TrustRegion region;
  region.full_distance = 4.0F;
  region.none_distance = 16.0F;
  EXPECT_EQ(region.confidence(0.0F), 1.0F);
  EXPECT_EQ(region.confidence(4.0F), 1.0F);
  EXPECT_EQ(region.confidence(10.0F), 0.5F);
  EXPECT_EQ(region.confidence(16.0F), 0.0F);
  EXPECT_EQ(region.confidence(std::numeric_limits<float>::infinity()), 0.0F);
  EXPECT_EQ(region.confidence(std::numeric_limits<float>::quiet_NaN()), 0.0F);
}

TEST(TrustRegion, OfConstantRowsTrustsThemAndNoOthers) {
  Training training = training_rows(50, 5);
  training.rows.rowwise() = Eigen::RowVectorXf(training.rows.row(0));
  training.scaling.mean = training.rows.row(0).transpose().cast<double>();
  training.scaling.scale.setOnes();
  const TrustRegion region = fit_trust_region(training.scaling, training.rows);
  FeatureMatrix rows(2, 5);
  rows.row(0) = training.rows.row(0);
  rows.row(1) = training.rows.row(0).array() + 1.0F;
  const Eigen::VectorXf distances = region.distances(scaled(training, rows));
  EXPECT_EQ(region.confidence(distances[0]), 1.0F);
  EXPECT_EQ(region.confidence(distances[1]), 0.0F);
}

// d2 of the marginal must be the Mahalanobis distance in the covariance's own sub-matrix.
TEST(TrustRegion, MarginalIsTheGaussianOfTheInputsThatAreKept) {
  const Training training = training_rows(5000, 6, 0.3);
  const TrustRegion region = fit_trust_region(training.scaling, training.rows);
  const Eigen::MatrixXd v = region.directions.cast<double>();
  const double residual = 1.0 / static_cast<double>(region.inverse_residual_variance);
  const Eigen::VectorXd beyond =
      region.inverse_variance.cast<double>().cwiseInverse().array() - residual;
  const Eigen::MatrixXd covariance =
      v.transpose() * beyond.asDiagonal() * v + residual * Eigen::MatrixXd::Identity(5, 5);
  for (const std::vector<std::size_t>& kept :
       {std::vector<std::size_t>{0, 2, 4}, {1}, {0, 1, 2, 3, 4}}) {
    const TrustRegion part = marginal(region, kept);
    const std::vector<Eigen::Index> columns(kept.begin(), kept.end());
    const Eigen::MatrixXd inverse = covariance(columns, columns).inverse();
    const Eigen::MatrixXf rows =
        scaled(training, training_rows(50, 7, 1.0).rows)(columns, Eigen::all);
    const Eigen::VectorXf distances = part.distances(rows);
    for (Eigen::Index row = 0; row < 50; ++row) {
      const Eigen::VectorXd x = rows.col(row).cast<double>();
      const double wanted = x.dot(inverse * x) / static_cast<double>(kept.size());
      EXPECT_NEAR(static_cast<double>(distances[row]), wanted, 1e-4 * (1.0 + wanted));
    }
  }
}

TEST(TrustRegion, OfManyInputsPassesTheBlobsOwnChecks) {
  std::mt19937 random(8);
  std::normal_distribution<float> normal;
  constexpr int kInputs = 300;
  const Eigen::MatrixXf mixing =
      Eigen::MatrixXf::NullaryExpr(40, kInputs, [&] { return normal(random); });
  const FeatureMatrix rows =
      Eigen::MatrixXf::NullaryExpr(2000, 40, [&] { return normal(random); }) * mixing;
  model::CalibrationModel model = golden_model();
  model.features.assign(kInputs, model.features[0]);
  model.input.mean = rows.colwise().mean().transpose().cast<double>();
  model.input.scale = ((rows.rowwise() - rows.colwise().mean()).colwise().squaredNorm() / 2000.0F)
                          .cwiseSqrt()
                          .transpose()
                          .cast<double>();
  model.input_min = rows.colwise().minCoeff().transpose().cast<double>();
  model.input_max = rows.colwise().maxCoeff().transpose().cast<double>();
  model.layers[0].weights = Eigen::MatrixXf::Constant(2, kInputs, 0.01F);
  model.trust = fit_trust_region(model.input, rows);
  EXPECT_EQ(model.trust->directions.rows(), 16);
  const auto bytes = model::encode_blob(model);
  EXPECT_TRUE(bytes.ok()) << bytes.error().message;
}

}  // namespace
}  // namespace ravencal::test
