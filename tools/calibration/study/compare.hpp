// SPDX-License-Identifier: Apache-2.0
//
// Runs calibration methods on the same split and keeps their results. Finished methods are files in
// the output folder; an interrupted run continues with the others. Same inputs, settings and seed:
// same errors; times are measured. One thread but for what a method starts itself.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"
#include "methods/method.hpp"
#include "record/recording.hpp"
#include "study/compare_result.hpp"

namespace ravencal::study {

struct CompareOptions {
  std::filesystem::path out;
  std::string title;
  std::string features;                            ///< as `train --features`
  std::map<std::string, std::string> features_of;  ///< per joint, in place of `features`
  std::vector<float> play;
  std::vector<std::string> joints;
  std::vector<std::string> methods;                 ///< ids; empty: all
  std::vector<double> shares = {0.125, 0.25, 0.5};  ///< of the learning curve, below 1
  bool poses = false;                               ///< rows are in no order
  bool same_seed = false;  ///< tests may share run seeds with the training; the tables say so
  methods::Settings settings;
  double loop_budget_us = 500.0;
  std::vector<std::pair<std::string, std::string>> facts;
  /// Measures a model in the 1 kHz loop; empty: not measured. Errors say why it could not.
  std::function<core::Result<LoopFitness>(const model::CalibrationModel&)> measure;
  std::string why_not_measured;  ///< without `measure`
  /// Share done and what is being done; false stops.
  std::function<bool(double, std::string_view)> look = [](double, std::string_view) {
    return true;
  };
};

/// Recordings by use; `sets` holds "test" and perhaps "load" and "homing".
struct CompareData {
  std::vector<const record::Recording*> train;
  std::map<std::string, std::vector<const record::Recording*>> sets;
};

/// True in `interrupted` if `look` stopped it: the comparison then holds the methods that are done.
struct CompareOutcome {
  Comparison comparison;
  bool interrupted = false;
};
core::Result<CompareOutcome> compare(const CompareData& data, const CompareOptions& options);

/// compare.json, compare.csv, compare.md, compare.tex and compare.html in `folder`. Errors: kIo.
core::Status write_comparison(const Comparison& comparison, const std::filesystem::path& folder);

}  // namespace ravencal::study
