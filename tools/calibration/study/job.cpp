// SPDX-License-Identifier: Apache-2.0
#include "study/job.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "model/hook_view.hpp"
#include "study/test_noise.hpp"

namespace ravencal::study {
namespace {

using record::Recording;

constexpr std::size_t kMapCells = 14;  // as the report's maps

/// A test recording as the network sees it, with what it is judged by.
struct TestData {
  const Recording* recording = nullptr;
  model::FeatureMatrix inputs;
  std::vector<double> t_s;     ///< since the first row
  Eigen::MatrixXd raw_errors;  ///< estimate - truth; NaN where a truth or a feature is lost
  Eigen::MatrixXd truth;
};

core::Result<TestData> test_data(const model::CalibrationModel& model, const Recording& recording) {
  TestData data;
  data.recording = &recording;
  RAVENCAL_ASSIGN_OR_RETURN(data.inputs, model::inputs_of(model, recording));
  const auto outputs = static_cast<Eigen::Index>(model.outputs.size());
  data.raw_errors.resize(recording.rows(), outputs);
  data.truth.resize(recording.rows(), outputs);
  for (Eigen::Index k = 0; k < outputs; ++k) {
    const model::OutputSpec& output = model.outputs[static_cast<std::size_t>(k)];
    const auto truth = recording.column(record::Role::kJointTruth, output.joint);
    const auto estimate = recording.column(output.estimate_channel);
    if (!truth || !estimate) {
      return core::Error{core::ErrorCode::kData,
                         fmt::format("{}: has no {} of joint {}", recording.source,
                                     truth ? "estimate" : "truth", output.joint)};
    }
    data.truth.col(k) = recording.samples.col(*truth);
    data.raw_errors.col(k) = recording.samples.col(*estimate) - recording.samples.col(*truth);
  }
  for (Eigen::Index row = 0; row < recording.rows(); ++row) {
    const auto since_ns = recording.t_ns[static_cast<std::size_t>(row)] - recording.t_ns.front();
    data.t_s.push_back(static_cast<double>(since_ns) * 1e-9);
    if (!data.inputs.row(row).allFinite()) {
      data.raw_errors.row(row).setConstant(std::numeric_limits<double>::quiet_NaN());
    }
  }
  return data;
}

/// Errors after the model's correction for these inputs, [rows x outputs].
Eigen::MatrixXd corrected_errors(const model::CalibrationModel& model, const TestData& data,
                                 const model::FeatureMatrix& inputs) {
  Eigen::MatrixXd errors = data.raw_errors;
  constexpr Eigen::Index kRows = 4096;  // bounds the memory of the hidden layers
  for (Eigen::Index row = 0; row < inputs.rows(); row += kRows) {
    const Eigen::Index count = std::min(kRows, inputs.rows() - row);
    errors.middleRows(row, count) += model.predict(inputs.middleRows(row, count).cast<double>());
  }
  return errors;
}

std::span<const double> column(const Eigen::MatrixXd& matrix, Eigen::Index index) {
  return {matrix.col(index).data(), static_cast<std::size_t>(matrix.rows())};
}

/// Grows a job's result row by row.
class Tester {
 public:
  Tester(const model::CalibrationModel& model, std::vector<TestData> tests, NoiseFrom noise_from,
         JobResult& result)
      : model_(model), tests_(std::move(tests)), noise_from_(noise_from), result_(result) {
    for (const model::OutputSpec& output : model.outputs) {
      result_.joints.push_back({output.joint, output.unit});
    }
    find_grid();
  }

  void test_untrained() {
    std::vector<Eigen::MatrixXd> raw;
    std::vector<Eigen::MatrixXd> unbiased;
    for (const TestData& test : tests_) {
      raw.push_back(test.raw_errors);
      unbiased.push_back(test.raw_errors.rowwise() + model_.output.mean.transpose());
    }
    keep(kRaw, raw, true);
    keep(kBias, unbiased, true);
  }

  void test(const Variant& variant, std::uint64_t seed) {
    std::vector<Eigen::MatrixXd> errors;
    for (std::size_t i = 0; i < tests_.size(); ++i) {
      const TestData& data = tests_[i];
      if (variant.noise == Noise::kNone) {
        errors.push_back(corrected_errors(model_, data, data.inputs));
        continue;
      }
      const auto columns = columns_of(model_, data.recording->channels, variant.terms);
      if (columns.empty()) return;  // nothing of this set is among the network's inputs
      const model::FeatureMatrix inputs =
          spoil(data.inputs, ranges(), columns, variant.noise, seed * 1000 + i);
      errors.push_back(corrected_errors(model_, data, inputs));
      if (variant.into == NoiseInto::kBelievedAsWell) {
        add_to_believed_angles(data, inputs, errors.back());
      }
    }
    keep(variant.id, errors, variant.noise == Noise::kNone);
  }

 private:
  /// Of every input; most networks are tested without noise and need none.
  const ColumnRanges& ranges() {
    if (!ranges_ && noise_from_ == NoiseFrom::kTraining) ranges_ = ranges_of_training(model_);
    if (!ranges_) {
      std::vector<const model::FeatureMatrix*> inputs;
      for (const TestData& test : tests_) inputs.push_back(&test.inputs);
      ranges_ = ranges_of_tests(inputs);
    }
    return *ranges_;
  }

  /// The noise of the inputs is in the believed angles that the correction is added to.
  void add_to_believed_angles(const TestData& data, const model::FeatureMatrix& inputs,
                              Eigen::MatrixXd& errors) const {
    for (std::size_t k = 0; k < model_.outputs.size(); ++k) {
      const model::OutputSpec& output = model_.outputs[k];
      if (output.unit != "rad") continue;
      for (std::size_t f = 0; f < model_.features.size(); ++f) {
        const model::FeatureSpec& feature = model_.features[f];
        if (feature.channel != output.estimate_channel ||
            feature.transform != model::Transform::kValue || feature.lag_rows != 0) {
          continue;
        }
        const auto column = static_cast<Eigen::Index>(f);
        errors.col(static_cast<Eigen::Index>(k)) +=
            (inputs.col(column) - data.inputs.col(column)).cast<double>();
      }
    }
  }

  void find_grid() {
    if (result_.joints.size() < 2) return;
    std::vector<double> x;
    std::vector<double> y;
    for (const TestData& test : tests_) {
      const auto first = column(test.truth, 0);
      const auto second = column(test.truth, 1);
      x.insert(x.end(), first.begin(), first.end());
      y.insert(y.end(), second.begin(), second.end());
    }
    result_.grid = report::grid_over(x, y, kMapCells);
    x_ = std::move(x);
    y_ = std::move(y);
  }

  void keep(std::string_view id, const std::vector<Eigen::MatrixXd>& errors, bool with_map) {
    RowErrors row{std::string(id), {}};
    RowMap map{std::string(id), {}};
    for (std::size_t joint = 0; joint < result_.joints.size(); ++joint) {
      const auto index = static_cast<Eigen::Index>(joint);
      std::vector<double> together;
      row.joints.emplace_back();
      for (std::size_t i = 0; i < tests_.size(); ++i) {
        const auto own = column(errors[i], index);
        row.joints.back().push_back(blocks_of(tests_[i].t_s, own));
        together.insert(together.end(), own.begin(), own.end());
      }
      if (!result_.grid) continue;
      const std::vector<std::int8_t> any(together.size(), 0);
      map.joints.push_back(report::error_map(*result_.grid, x_, y_, together, any, 0));
    }
    result_.rows.push_back(std::move(row));
    if (with_map && result_.grid) result_.maps.push_back(std::move(map));
  }

  const model::CalibrationModel& model_;
  std::vector<TestData> tests_;
  NoiseFrom noise_from_;
  JobResult& result_;
  std::optional<ColumnRanges> ranges_;
  std::vector<double> x_;  ///< truth of the map's axes, all tests end to end
  std::vector<double> y_;
};

core::Result<std::vector<const Recording*>> all_of(RecordingStore& store,
                                                   const std::vector<std::string>& paths) {
  std::vector<const Recording*> recordings;
  for (const std::string& path : paths) {
    RAVENCAL_ASSIGN_OR_RETURN(const Recording* const recording, store.get(path));
    recordings.push_back(recording);
  }
  return recordings;
}

}  // namespace

core::Result<std::optional<JobResult>> run_job(const Plan& plan, const Job& job,
                                               RecordingStore& recordings, unsigned threads,
                                               const JobProgress& progress) {
  const Condition& condition = plan.conditions[job.condition];
  RAVENCAL_ASSIGN_OR_RETURN(const auto training, all_of(recordings, condition.train));
  RAVENCAL_ASSIGN_OR_RETURN(const auto testing, all_of(recordings, condition.test));
  const double epochs = plan.settings.epochs;
  bool stopped = false;
  RAVENCAL_ASSIGN_OR_RETURN(
      const learn::TrainResult trained,
      learn::train_model(training, {}, train_options(plan, job, threads),
                         [&](const learn::EpochReport& epoch) {
                           stopped = !progress(static_cast<double>(epoch.epoch) / epochs);
                           return !stopped;
                         }));
  if (stopped) return std::optional<JobResult>();
  std::optional<JobResult> result(std::in_place);
  if (!trained.epochs.empty()) result->final_loss = trained.epochs.back().training;
  std::vector<TestData> tests;
  for (const Recording* recording : testing) {
    RAVENCAL_ASSIGN_OR_RETURN(TestData data, test_data(trained.model, *recording));
    tests.push_back(std::move(data));
  }
  Tester tester(trained.model, std::move(tests), plan.settings.noise_from, *result);
  if (job.tests != TestSet::kPlain) tester.test_untrained();
  for (const Variant& variant : variants_of(job.tests)) {
    tester.test(variant, job.seed);
    if (!progress(1.0)) return std::optional<JobResult>();
  }
  return result;
}

}  // namespace ravencal::study
