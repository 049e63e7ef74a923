// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>

#include "learn/evaluate.hpp"
#include "learn/trainer.hpp"
#include "report/report.hpp"

namespace ravencal::learn {

/// The report's data from an evaluation, in display units: table, series, maps over the first two
/// revolute joints if there are two, provenance of the model, and the loss curve if there is one.
report::CalibrationReport make_report(const model::CalibrationModel& model,
                                      const Evaluation& evaluation, const std::string& table_title,
                                      std::span<const EpochReport> epochs = {},
                                      std::uint32_t kept_epoch = 0);

}  // namespace ravencal::learn
