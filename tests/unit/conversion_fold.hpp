// SPDX-License-Identifier: Apache-2.0
//
// A small network worked out by hand, and the comparison of what a reader makes of its file.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <optional>
#include <vector>

#include "conversion/assemble.hpp"
#include "conversion/window.hpp"
#include "unit/conversion_models.hpp"

namespace ravencal::test {

using Values = std::vector<double>;

inline Values dense(const Values& x) {
  return {2.0 * x[0] - x[1] + 0.25, 0.5 * x[0] + 3.0 * x[1] - 1.0};
}
inline Values leak(const Values& x, double first, double second) {
  return {x[0] < 0.0 ? first * x[0] : x[0], x[1] < 0.0 ? second * x[1] : x[1]};
}
/// Scale 1.5 and -2, offset 0.5 and 4, mean 3 and -1, deviation sqrt(3.75 + 0.25), sqrt(0 + 0.25).
inline Values normalised(const Values& x) {
  return {1.5 * (x[0] - 3.0) / 2.0 + 0.5, -2.0 * (x[1] + 1.0) / 0.5 + 4.0};
}

/// That the file's own run and the folded weights both give `expected` of some inputs.
inline void expect_answers(const core::Result<conversion::ForeignModel>& source,
                           const std::function<Values(const Values&)>& expected,
                           const std::optional<conversion::FileScaling>& of_inputs = {}) {
  ASSERT_TRUE(source.ok()) << source.error().message;
  conversion::ScalingFile scaling = plain_scaling(*source, 1.0);
  scaling.features.resize(2);
  scaling.feature_to_si = Eigen::VectorXd::Ones(2);
  scaling.input_min = Eigen::VectorXd::Constant(2, -1e4);
  scaling.input_max = Eigen::VectorXd::Constant(2, 1e4);
  const Eigen::VectorXd zeros = Eigen::VectorXd::Zero(2);
  const Eigen::VectorXd ones = Eigen::VectorXd::Ones(2);
  scaling.input = of_inputs ? *of_inputs : conversion::FileScaling{zeros, ones};
  scaling.output = conversion::FileScaling{zeros, ones};
  const auto model = conversion::assemble(*source, scaling, {});
  ASSERT_TRUE(model.ok()) << model.error().message;
  for (const Values& x : {Values{0.0, 0.0}, {1.0, -2.0}, {-3.5, 0.75}, {40.0, 7.0}, {-9.0, -0.5}}) {
    const Eigen::RowVector2d row(x[0], x[1]);
    const Values scaled = {(x[0] - scaling.input->mean[0]) / scaling.input->scale[0],
                           (x[1] - scaling.input->mean[1]) / scaling.input->scale[1]};
    const Values y = expected(scaled);
    const std::vector<Eigen::MatrixXd> inputs = {Eigen::RowVector2d(scaled[0], scaled[1])};
    const auto run = source->run(inputs);
    ASSERT_TRUE(run.ok()) << run.error().message;
    const std::vector<Eigen::MatrixXf> samples = {row.cast<float>()};
    const Eigen::MatrixXd exact = conversion::predict_exact(*model, samples);
    const Eigen::MatrixXd packed = conversion::predict_packed(*model, samples);
    for (Eigen::Index k = 0; k < 2; ++k) {
      const double answer = y[static_cast<std::size_t>(k)];
      EXPECT_NEAR((*run)(0, k), answer, 1e-6 * (1.0 + std::abs(answer))) << x[0];
      EXPECT_NEAR(exact(0, k), answer, 1e-5 * (1.0 + std::abs(answer))) << x[0];
      EXPECT_NEAR(packed(0, k), answer, 1e-4 * (1.0 + std::abs(answer))) << x[0];
    }
  }
}

}  // namespace ravencal::test
