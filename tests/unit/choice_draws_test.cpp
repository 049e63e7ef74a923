// SPDX-License-Identifier: Apache-2.0
//
// Several draws of random units decide together, and the network pays for one.
#include <random>

#include "choice/condense.hpp"
#include "choice/expected.hpp"
#include "choice/trial.hpp"
#include "choice_sample.hpp"

namespace ravencal::choice {
namespace {

/// Rows [count x 3] of scaled inputs, of which two depend on each other.
Eigen::MatrixXd inputs_of(Eigen::Index count, unsigned seed) {
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal;
  Eigen::MatrixXd scaled(count, 3);
  for (double& value : scaled.reshaped()) value = normal(generator);
  scaled.col(1) = 0.9 * scaled.col(0) + 0.3 * scaled.col(1);
  return scaled;
}

JointRows rows_of(const Eigen::MatrixXd& scaled) {
  JointRows rows;
  rows.scaled = scaled;
  rows.errors = (1.5 * scaled.col(0)).array().sin() * scaled.col(2).array() + 0.3;
  rows.session.assign(static_cast<std::size_t>(scaled.rows()), 0);
  return rows;
}

/// Fits on the draws of `spec`, and their mean.
std::vector<Fit> fits_of(const BasisSpec& spec, const JointRows& rows) {
  std::vector<Fit> fits;
  for (int k = 0; k < spec.draws; ++k) {
    Basis basis = draw(spec, k);
    Eigen::VectorXd readout = fit_readout(basis, 1e-4, rows).weights;
    fits.push_back({std::move(basis), std::move(readout)});
  }
  return fits;
}

Eigen::VectorXd mean_of_fits(const std::vector<Fit>& fits, const Eigen::MatrixXd& scaled) {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(scaled.rows());
  for (const Fit& fit : fits) sum += fit.basis.design(scaled) * fit.readout;
  return sum / static_cast<double>(fits.size());
}

double rms(const Eigen::VectorXd& values) {
  return values.norm() / std::sqrt(static_cast<double>(values.size()));
}

TEST(Condensed, SaysWhatTheMeanOfTheFitsSaysWithUnitsOfOne) {
  const JointRows rows = rows_of(inputs_of(3000, 1));
  const std::vector<Fit> fits = fits_of({{0, 1, 2}, 100, 0.7, 9, 4}, rows);
  const Fit one = condensed(fits, 100, rows.scaled);
  EXPECT_EQ(one.basis.weights.rows(), 100);
  const Eigen::MatrixXd others = inputs_of(2000, 2);
  const Eigen::VectorXd mean = mean_of_fits(fits, others);
  const double of_one = rms(one.basis.design(others) * one.readout - mean);
  const double of_a_draw = rms(fits[0].basis.design(others) * fits[0].readout - mean);
  EXPECT_LT(of_one, 0.3 * of_a_draw) << "a draw differs from the mean by " << of_a_draw;
  // Where the plugin clamps.
  const Eigen::MatrixXd far = 2.0 * others;
  EXPECT_LT(rms(one.basis.design(far) * one.readout - mean_of_fits(fits, far)),
            0.5 * rms(fits[0].basis.design(far) * fits[0].readout - mean_of_fits(fits, far)));
}

TEST(Condensed, OfOneFitIsThatFit) {
  const JointRows rows = rows_of(inputs_of(500, 1));
  const std::vector<Fit> fits = fits_of({{0, 2}, 30, 0.7, 9, 1}, rows);
  const Fit one = condensed(fits, 30, rows.scaled);
  EXPECT_EQ(one.basis.weights, fits[0].basis.weights);
  EXPECT_EQ(one.readout, fits[0].readout);
}

TEST(Draws, OfOneSeedAndOfNeighboursDiffer) {
  const BasisSpec spec{{0, 1}, 20, 0.7, 3, 4};
  EXPECT_EQ(draw(spec, 1).weights, draw(spec, 1).weights);
  EXPECT_NE(draw(spec, 0).weights, draw(spec, 1).weights);
  BasisSpec next = spec;
  next.seed = 4;
  EXPECT_NE(draw(next, 0).weights, draw(spec, 1).weights);
}

TEST(Draws, SayWhatIsLeftToChance) {
  JointRows rows = rows_of(inputs_of(600, 1));
  for (Eigen::Index row = 0; row < 600; ++row) {
    if (row % 2 == 0) continue;
    rows.held_out.lists.resize(1);
    rows.held_out.lists[0].push_back(row);
  }
  rows.held_out.parts = 1;
  const Trial one = try_basis("one", {{0, 1, 2}, 20, 0.7, 9, 1}, rows);
  const Trial four = try_basis("four", {{0, 1, 2}, 20, 0.7, 9, 4}, rows);
  EXPECT_EQ(one.left_to_chance, 0.0);
  EXPECT_GT(four.left_to_chance, 0.0);
  EXPECT_LT(four.inside_rmse, one.inside_rmse);
  const std::vector<Eigen::VectorXd> judged = {four.left[0], 1.1 * four.left[0]};
  const auto known = expected_error(judged, {0.0});
  const auto doubted = expected_error(judged, {0.0}, 10.0 * known.same_homing.high);
  EXPECT_GT(doubted.same_homing.high, 10.0 * known.same_homing.high);
  EXPECT_EQ(doubted.same_homing.rmse, known.same_homing.rmse);
}

}  // namespace
}  // namespace ravencal::choice
