// SPDX-License-Identifier: Apache-2.0
//
// What every calibration method is given: the same inputs, the same joint errors, the same rows. A
// Series is one recording; a Problem says what its columns are. SI units; an error is truth -
// estimate, which is what a correction adds. Not for real time; any thread.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"
#include "model/calibration_model.hpp"
#include "model/feature_spec.hpp"
#include "record/recording.hpp"

namespace ravencal::methods {

/// What the order of a recording's rows says.
enum class Order {
  kTime,      ///< samples of a motion, close enough for its dynamics
  kSequence,  ///< poses one after the other: memory of the path, no dynamics
  kPoses      ///< poses in no order
};
std::string_view name_of(Order order);

/// Rows farther apart than this do not show a cable's dynamics.
inline constexpr double kDynamicsPeriodS = 0.1;

struct Problem {
  std::vector<model::FeatureSpec> features;  ///< columns of Series::inputs; the plain ones first
  Eigen::Index plain = 0;                    ///< how many are channels as they are; then plays
  std::vector<model::OutputSpec> outputs;
  std::vector<record::Channel> channels;  ///< of the recordings
  double row_period_s = 0.01;
  Order order = Order::kTime;
};

struct Series {
  Eigen::MatrixXd inputs;    ///< [rows x features]; NaN where lost
  Eigen::MatrixXd errors;    ///< [rows x outputs]; NaN where unknown
  Eigen::MatrixXd estimate;  ///< [rows x outputs], what the robot believes
  Eigen::MatrixXd effort;    ///< [rows x outputs], drive torque or input; NaN where not recorded
  Eigen::VectorXd t_s;
  std::vector<double> homings_s;  ///< times of homings on the clock of t_s
  std::vector<char> fresh;        ///< 1 where an episode starts, the first row always
  /// Every other channel that is not truth, by name, for methods that read a plant's terms.
  std::map<std::string, Eigen::VectorXd> channels;
  std::string source;

  [[nodiscard]] Eigen::Index rows() const { return inputs.rows(); }
  /// Row whose inputs are all known.
  [[nodiscard]] bool usable(Eigen::Index row) const { return inputs.row(row).allFinite(); }
  /// The same, with every error known.
  [[nodiscard]] bool trains(Eigen::Index row) const {
    return usable(row) && errors.row(row).allFinite();
  }
};

/// Errors (kData, kUsage): features or joints that a recording lacks.
core::Result<Problem> make_problem(const record::Recording& recording, std::string_view features,
                                   std::span<const float> play,
                                   std::span<const std::string> joints);
core::Result<Series> make_series(const Problem& problem, const record::Recording& recording);

/// `all` in order up to its `count`-th row that trains, cut inside a series where that falls.
std::vector<Series> first_rows(std::span<const Series> all, Eigen::Index count);
/// How many rows of `series` hold its first `count` rows that train; 0 for none, all for too many.
Eigen::Index row_after(const Series& series, Eigen::Index count);
/// Rows [from, from + count) of a series, which begin an episode.
Series slice(const Series& series, Eigen::Index from, Eigen::Index count);
Eigen::Index count_rows(std::span<const Series> all);
Eigen::Index count_training_rows(std::span<const Series> all);

/// Training rows of all series, stacked: inputs (the first `columns`), errors.
struct Stack {
  Eigen::MatrixXd inputs;
  Eigen::MatrixXd errors;
};
Stack stack(std::span<const Series> all, Eigen::Index columns);

}  // namespace ravencal::methods
