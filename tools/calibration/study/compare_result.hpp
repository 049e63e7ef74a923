// SPDX-License-Identifier: Apache-2.0
//
// What a comparison keeps of one method, and of all of them together: compare.json in memory.
// Figures are in display units (deg, mm), times in s, steps in microseconds.
#pragma once

#include <filesystem>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "core/result.hpp"
#include "learn/shared_seeds.hpp"
#include "study/error_blocks.hpp"

namespace ravencal::study {

inline constexpr int kCompareSchema = 1;  ///< of compare.json

/// Error of one joint on one set of recordings.
struct CompareFigure {
  double rmse = std::numeric_limits<double>::quiet_NaN();
  double rmse_low = std::numeric_limits<double>::quiet_NaN();  ///< 95 % block bootstrap
  double rmse_high = std::numeric_limits<double>::quiet_NaN();
  double peak = std::numeric_limits<double>::quiet_NaN();
  double peak_low = std::numeric_limits<double>::quiet_NaN();
  double peak_high = std::numeric_limits<double>::quiet_NaN();
  double samples = 0.0;
  double effective_samples = 0.0;
};

struct CompareJoint {
  std::string joint;
  std::string unit;
  std::map<std::string, CompareFigure> sets;  ///< "test", and "load", "homing" where given
  /// Of set "test", for paired intervals: [recording].
  std::vector<ErrorBlocks> blocks;
};

/// RMSE by cell of CompareGrid, display units.
struct CompareMap {
  std::string joint, unit;
  std::vector<double> rmse;  ///< row-major from the lower left; NaN where nobody was
};

struct StepTime {
  double p50_us = std::numeric_limits<double>::quiet_NaN();
  double p99_us = std::numeric_limits<double>::quiet_NaN();
  double p999_us = std::numeric_limits<double>::quiet_NaN();
};

/// Whether the method can run in the robot's loop.
struct LoopFitness {
  bool loadable = false;         ///< convert and the plugin take it
  std::string why_not;           ///< if not
  bool measured = false;         ///< in the host's 1 kHz loop; else `step` is the method's own
  std::string why_not_measured;  ///< if loadable and not measured
  bool real_time = false;        ///< the host ran at SCHED_FIFO
  StepTime step;
};

struct CurvePoint {
  double share = 1.0;
  double minutes = 0.0;
  std::vector<double> rmse;  ///< per joint, display units
};

/// Cells over the estimates of two joints, display units.
struct CompareGrid {
  struct Axis {
    std::string joint, unit;
    std::vector<double> edges;  ///< empty: there are no maps
  };
  Axis x, y;
};

enum class CompareStatus { kDone, kUnsuited, kFailed };

struct MethodResult {
  std::string id, title, source;
  bool ours = false;
  CompareStatus status = CompareStatus::kDone;
  std::string reason;  ///< why there are no figures
  std::string remark;
  std::vector<CompareJoint> joints;
  std::vector<CompareMap> maps;
  std::vector<CurvePoint> curve;  ///< rising shares; the last is everything
  double training_s = 0.0;
  std::size_t parameters = 0;
  StepTime own_step;  ///< one prediction by the method's own code
  LoopFitness loop;
  std::string model_file;  ///< below the output folder; empty if there is none to load

  /// Least minutes of the curve with a mean error (geometric, over joints) within 1.1 times the
  /// last one's.
  [[nodiscard]] double minutes_needed() const;
};

/// Geometric mean over joints, as one figure of merit for joints of different units.
double overall(const std::vector<double>& rmse);

struct RivalVerdict {
  std::string joint, unit;
  std::string ours, rival;  ///< ids of the best
  double ours_rmse = 0.0, rival_rmse = 0.0;
  double ratio = 0.0, ratio_low = 0.0, ratio_high = 0.0;  ///< ours / rival, paired resamples
  [[nodiscard]] std::string text() const;                 ///< "better", "not told apart", "worse"
};

struct Comparison {
  std::string title;
  std::vector<std::pair<std::string, std::string>> facts;  ///< recordings and hashes, settings
  double training_minutes = 0.0;
  std::string order;
  std::vector<MethodResult> methods;
  std::vector<RivalVerdict> verdicts;
  CompareGrid map;
  double loop_budget_us = 500.0;
  learn::SharedSeeds shared;  ///< of all sets
};

/// Keeps a method's result, with its blocks, as that of the job `description`. Errors: kIo.
core::Status write_method(const MethodResult& result, const std::string& description,
                          const std::filesystem::path& folder);
/// The job's result if it is there. Errors: kIo, kData if it is damaged.
core::Result<std::optional<MethodResult>> read_method(const std::string& description,
                                                      const std::filesystem::path& folder);

/// As compare.json has it, or with the blocks.
nlohmann::ordered_json method_json(const MethodResult& result, bool with_blocks);
/// From compare.json: what recommend() needs. Errors: kIo, kData.
core::Result<Comparison> read_comparison(const std::filesystem::path& path);

}  // namespace ravencal::study
