// SPDX-License-Identifier: Apache-2.0
//
// Common methods on the same recordings: selections over a library of terms, with statistics that
// take neighbouring samples for independent, and a network. They get the same input as the tool:
// recordings and plant.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "prove/generator/term_library.hpp"

namespace ravencal::prove {

/// Indices of the chosen groups.
std::vector<std::size_t> bic_forward(const TermLibrary& library);
/// Sequentially thresholded least squares (Brunton, Proctor, Kutz, PNAS 2016).
std::vector<std::size_t> stlsq(const TermLibrary& library);
/// The lasso by coordinate descent, its penalty by BIC over a path (Zou, Hastie, Tibshirani 2007).
std::vector<std::size_t> lasso(const TermLibrary& library);

/// {"bic_forward"|"stlsq"|"lasso"|"everything"|"black_box": {"named": [{"id","joint"}],
/// "held_out": [{"joint","metric","before","after"}]}}, figures on `held_out`. The black box names
/// nothing: its "named" is null.
nlohmann::ordered_json run_baselines(const record::Recording& recording,
                                     const record::Recording& held_out, const NominalRobot& plant);

}  // namespace ravencal::prove
