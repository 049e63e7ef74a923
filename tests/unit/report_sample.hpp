// SPDX-License-Identifier: Apache-2.0
//
// A report with every part filled, for tests: three joints that zig-zag through their workspace
// with slack, a bias and a little noise. Same on every run.
#pragma once

#include <cstddef>

#include "report/report.hpp"

namespace ravencal::report {

/// `samples` per joint at 100 Hz.
CalibrationReport sample_report(std::size_t samples);

}  // namespace ravencal::report
