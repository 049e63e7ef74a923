// SPDX-License-Identifier: Apache-2.0
//
// A network with fewer inputs and units that does nearly what a large one does: each layer keeps
// the few inputs that reproduce nearly all of its sums, and its weights are fitted anew to give the
// outputs of the large layer. Works where the units of a layer repeat each other, as those of a
// regularised network do. Not real time.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "model/calibration_model.hpp"
#include "model/unit_ranking.hpp"

namespace ravencal::model {

/// Inputs of every layer, then the outputs, each [units x rows], in the network's scaling.
std::vector<Eigen::MatrixXd> layer_values(const CalibrationModel& model,
                                          const Eigen::MatrixXd& scaled_inputs);

/// Largest root mean square difference of an output, [outputs x rows].
double largest_difference(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);

/// Leaves only these inputs in everything but the layers; `kept` ascends.
void keep_inputs(CalibrationModel& model, const std::vector<Eigen::Index>& kept);

class UnitReduction {
 public:
  struct Result {
    CalibrationModel model;
    std::vector<Eigen::Index> kept_inputs;
    double difference = 0.0;  ///< of the scaled outputs from the large network's, over the rows
  };

  /// `scaled_inputs` [inputs x rows] is what the network sees in training.
  UnitReduction(const CalibrationModel& model, Eigen::MatrixXd scaled_inputs);

  /// To first order each layer changes the outputs by `level`, root mean square over the rows.
  [[nodiscard]] Result reduce(double level) const;

  /// The smallest network of reduce() that changes no output by more than `budget`; the model as it
  /// is if there is none.
  [[nodiscard]] Result within(double budget) const;

 private:
  const CalibrationModel& model_;
  std::vector<Eigen::MatrixXd> values_;
  std::vector<UnitRanking> rankings_;  ///< of each layer's inputs
};

}  // namespace ravencal::model
