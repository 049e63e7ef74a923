// SPDX-License-Identifier: Apache-2.0
//
// What others would do with the same recordings: the usual selections over a library of terms, with
// the usual statistics that take neighbouring samples for independent. They see what the tool
// sees: recordings and plant.
#pragma once

#include <Eigen/Core>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "prove/generator/nominal.hpp"
#include "record/recording.hpp"

namespace ravencal::prove {

/// A linear problem: which of the groups explain y? Columns of `nuisance` are always in.
struct TermLibrary {
  struct Group {
    std::string id;
    Eigen::MatrixXd columns;
  };
  Eigen::VectorXd y;
  Eigen::MatrixXd nuisance;
  std::vector<Group> groups;
  double smallest = 0.0;  ///< RMS below which a term is not worth a name (STLSQ's threshold)
};

/// Indices of the chosen groups.
std::vector<std::size_t> bic_forward(const TermLibrary& library);
/// Sequentially thresholded least squares (Brunton, Proctor, Kutz, PNAS 2016).
std::vector<std::size_t> stlsq(const TermLibrary& library);
/// The lasso by coordinate descent, its penalty by BIC over a path (Zou, Hastie, Tibshirani 2007).
std::vector<std::size_t> lasso(const TermLibrary& library);

/// {"bic_forward"|"stlsq"|"lasso"|"everything": {"named": [{"id","joint"}], "held_out": [{"joint",
/// "metric","before","after"}]}}, figures on `held_out`.
nlohmann::ordered_json run_baselines(const record::Recording& recording,
                                     const record::Recording& held_out, const NominalRobot& plant);

}  // namespace ravencal::prove
