// SPDX-License-Identifier: Apache-2.0
//
// The report's charts as Vega specifications.
#pragma once

#include <span>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "report/joint_view.hpp"
#include "report/report.hpp"

namespace ravencal::report {

/// Cells of an error map with fewer samples than this count as untested: the RMS of fewer says
/// little about the cell (10 samples = 0.1 s of a 100 Hz recording).
inline constexpr std::uint64_t kLeastCellSamples = 10;
/// Cells along each side of an error map.
inline constexpr std::size_t kMapCells = 14;

/// Truth, raw and corrected over the whole length, errors below.
nlohmann::json trace_chart(const JointView& view);
/// The same over one window, with the bias-removed error.
nlohmann::json window_chart(const JointView& view, IndexRange range,
                            const std::string& description);
/// Number of samples by error: raw, bias removed and corrected.
nlohmann::json histogram_chart(const JointView& view);
/// Share of the samples within a magnitude of error: raw, bias removed and corrected.
nlohmann::json quantile_chart(const JointView& view);
/// RMS error by cell of the workspace: raw, bias removed and corrected for each direction of
/// motion.
nlohmann::json map_chart(const JointView& view, const MapAxes& axes);
/// Training and validation loss over epochs, all runs.
nlohmann::json loss_chart(std::span<const LossCurve> losses, const std::string& unit);
/// Number of samples by duration on two logarithmic axes; `period_ns` is marked where it is in
/// range.
nlohmann::json duration_chart(std::span<const DurationBin> bins, const std::string& what,
                              double period_ns);

}  // namespace ravencal::report
