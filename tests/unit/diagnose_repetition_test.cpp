// SPDX-License-Identifier: Apache-2.0
//
// What repetition says of the noise, and what the verdict says of an error that is left.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "diagnose/explain/repetition.hpp"
#include "diagnose/findings/verdict.hpp"

namespace ravencal::diagnose {
namespace {

constexpr int kPasses = 40;
constexpr int kRowsPerPass = 100;

/// Passes over one position with noise of one, half of it slow, and a mismatch added to it.
template <typename Mismatch>
Passes passes_with(std::uint64_t seed, const Mismatch& mismatch) {
  std::mt19937_64 engine(seed);
  const auto uniform = [&] { return static_cast<double>(engine() >> 11U) * 0x1p-53; };
  const auto normal = [&] {
    double sum = -6.0;
    for (int k = 0; k < 12; ++k) sum += uniform();
    return sum;
  };
  Passes out{
      Eigen::MatrixXd(2, kPasses * kRowsPerPass), Eigen::VectorXd(kPasses * kRowsPerPass), {}};
  double slow = normal();
  for (int n = 0; n < kPasses * kRowsPerPass; ++n) {
    const int pass = n / kRowsPerPass;
    const double share = static_cast<double>(n % kRowsPerPass) / kRowsPerPass;
    const double x = std::sqrt(3.0) * (pass % 2 == 0 ? 2.0 * share - 1.0 : 1.0 - 2.0 * share);
    const double direction = pass % 2 == 0 ? 1.0 : -1.0;
    slow = 0.9 * slow + std::sqrt(1.0 - 0.81) * normal();
    out.circumstances.col(n) << x, direction;
    out.residual[n] = std::sqrt(0.5) * (slow + normal()) + mismatch(x, direction);
    out.pass.push_back(pass);
  }
  return out;
}

TEST(Repetition, MeasuresTheNoiseWhateverLiesUnderIt) {
  for (const double size : {0.0, 0.5, 2.0, 10.0}) {
    const Passes passes = passes_with(
        3, [size](double x, double direction) { return size * std::sin(4.0 * x + direction); });
    const auto found = repetition_of(passes, 1.0);
    ASSERT_TRUE(found.has_value());
    EXPECT_NEAR(found->differs, 1.0, 0.15) << size;
    EXPECT_NEAR(found->left, 1.0 + 0.5 * size * size, 0.15 * (1.0 + 0.5 * size * size)) << size;
    EXPECT_GT(found->agreement, 0.99);
  }
}

TEST(Repetition, SeesWhatRepeatsAboveTheNoise) {
  const auto found = repetition_of(passes_with(3, [](double x, double) { return 2.0 * x; }), 1.0);
  ASSERT_TRUE(found.has_value());
  EXPECT_NEAR(found->differs, 1.0, 0.15);
  EXPECT_GT(found->left, 4.0 * found->differs);
  EXPECT_GT(found->left - found->differs, 5.0 * found->excess_deviation);
}

TEST(Repetition, TellsLittleWhereCircumstancesDiffer) {
  Passes far = passes_with(3, [](double, double) { return 0.0; });
  for (Eigen::Index i = 0; i < far.circumstances.cols(); ++i)
    far.circumstances(0, i) += 3.0 * far.pass[static_cast<std::size_t>(i)];
  const auto found = repetition_of(far, 1.0);
  ASSERT_TRUE(found.has_value());
  EXPECT_LT(found->agreement, 0.5);
}

Report with_error(double left, bool reached, const std::string& measured_by) {
  Report report;
  report.held_out.push_back({"two", "effort_rmse", "N_m", 0.3134, left, 0.02});
  ErrorLeft e;
  e.joint = "two";
  e.stage = "drive";
  e.unit = "N_m";
  e.before = 0.3134;
  e.left = left;
  e.floor = 0.02;
  e.measured_by = measured_by;
  e.reached = reached;
  report.left.push_back(e);
  return report;
}

TEST(ErrorLeft, StandsInTheFirstSentenceOfAVerdictWithoutAName) {
  Report report = with_error(0.31, false, "repetition");
  decide(report);
  EXPECT_EQ(report.verdict.kind, "unexplained");
  EXPECT_EQ(report.verdict.text.rfind("Joint two, drive: 97.4 % of the squared error is left and "
                                      "has no name: 0.31 N m where repetition gives at most "
                                      "0.02 N m.",
                                      0),
            0U)
      << report.verdict.text;
  ASSERT_EQ(report.effects.size(), 1U);
  EXPECT_EQ(report.effects.front().id, kUnknown);
}

TEST(ErrorLeft, StandsBesideANameThatLeavesMuch) {
  Report report = with_error(0.31, false, "resolution");
  NamedEffect effect;
  effect.id = "viscous_friction";
  effect.joint = "two";
  effect.stage = "drive";
  report.effects.push_back(effect);
  decide(report);
  EXPECT_EQ(report.verdict.kind, "named");
  EXPECT_TRUE(report.unexplained.empty());
  EXPECT_NE(report.verdict.text.find("is left beside what is named: 0.31 N m where the sensors "
                                     "resolve 0.02 N m."),
            std::string::npos)
      << report.verdict.text;
}

TEST(ErrorLeft, SaysWhereThereIsNoFloor) {
  Report report = with_error(0.31, true, "none");
  decide(report);
  EXPECT_EQ(report.verdict.kind, "nothing_left_out");
  EXPECT_NE(report.verdict.text.find("Joint two, drive has no floor to be judged by."),
            std::string::npos)
      << report.verdict.text;
}

}  // namespace
}  // namespace ravencal::diagnose
