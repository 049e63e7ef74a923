// SPDX-License-Identifier: Apache-2.0
//
// Small problems whose answer is known: two joints that swing, and an error that a test chooses.
#pragma once

#include <filesystem>
#include <functional>

#include "methods/method.hpp"

namespace ravencal::test {

/// Joints "elbow" and "wrist" (rad), 100 Hz, sines of two periods and slowly growing amplitude;
/// inputs are both positions and two efforts of white noise in [-1, 1].
methods::Problem sample_problem();

/// `error` gives truth - estimate of both joints from the series and a row; called in order.
using SampleError = std::function<Eigen::Vector2d(const methods::Series&, Eigen::Index)>;
methods::Series sample_series(Eigen::Index rows, std::uint64_t seed, const SampleError& error);

/// 0.02 + 0.1 position + 0.03 effort; the wrist half of it.
Eigen::Vector2d linear_error(const methods::Series& series, Eigen::Index row);

/// Networks and forests as small as tests need.
methods::Settings quick_settings();

/// A folder with the diagnosis of a wrist whose friction element is `width_rad` wide, and an elbow
/// with a gain error.
std::filesystem::path sample_diagnosis(const std::string& name, double width_rad);

const methods::Method& method(std::string_view id);

/// RMSE that the method leaves of joint `output` on `test`.
double rmse_left(methods::Predictor& predictor, const methods::Series& test, Eigen::Index output);

}  // namespace ravencal::test
