// SPDX-License-Identifier: Apache-2.0
#include "conversion/source_check.hpp"

#include <algorithm>
#include <cmath>
#include <random>

#include "conversion/window.hpp"

namespace ravencal::conversion {
namespace {

constexpr Eigen::Index kRows = 512;
constexpr std::uint64_t kSeed = 1;

/// Uniform within the trained range, [rows x features], SI units. Not by std::uniform_*: its
/// numbers depend on the library.
Eigen::MatrixXf random_sample(const model::CalibrationModel& model, std::mt19937_64& random) {
  Eigen::MatrixXf sample(kRows, model.input_min.size());
  for (Eigen::Index row = 0; row < kRows; ++row) {
    for (Eigen::Index i = 0; i < sample.cols(); ++i) {
      const double share = static_cast<double>(random() >> 11U) * 0x1p-53;
      sample(row, i) = static_cast<float>(model.input_min[i] +
                                          share * (model.input_max[i] - model.input_min[i]));
    }
  }
  return sample;
}

/// The sample in the file's units, scaled as the file's training scaled it.
Eigen::MatrixXd for_source(const ScalingFile& scaling, const Eigen::MatrixXf& sample_si) {
  Eigen::MatrixXd values = sample_si.cast<double>();
  for (Eigen::Index i = 0; i < values.cols(); ++i) {
    values.col(i) /= scaling.feature_to_si[i];
    if (!scaling.input) continue;
    values.col(i).array() -= scaling.input->mean[i];
    values.col(i) /= scaling.input->scale[i];
  }
  return values;
}

Eigen::MatrixXd from_source(const ScalingFile& scaling, Eigen::MatrixXd outputs) {
  for (Eigen::Index k = 0; k < outputs.cols(); ++k) {
    if (scaling.output) {
      outputs.col(k) *= scaling.output->scale[k];
      outputs.col(k).array() += scaling.output->mean[k];
    }
    outputs.col(k) *= scaling.output_to_si[k];
  }
  return outputs;
}

}  // namespace

core::Result<SourceCheck> check_source(const ForeignModel& source, const ScalingFile& scaling,
                                       const model::CalibrationModel& model,
                                       const model::CalibrationModel& weights,
                                       const std::vector<std::size_t>& kept_inputs) {
  std::mt19937_64 random(kSeed);
  std::vector<Eigen::MatrixXd> theirs;
  std::vector<Eigen::MatrixXf> ours;
  for (std::size_t k = 0; k < window_of(model); ++k) {
    const Eigen::MatrixXf sample = random_sample(model, random);
    theirs.push_back(for_source(scaling, sample));
    ours.emplace_back(sample(Eigen::all, kept_inputs));
  }
  RAVENCAL_ASSIGN_OR_RETURN(const Eigen::MatrixXd outputs, source.run(theirs));
  if (outputs.rows() != kRows ||
      outputs.cols() != static_cast<Eigen::Index>(model.outputs.size())) {
    return core::Error{core::ErrorCode::kData, "the file gives outputs of another shape"};
  }
  const Eigen::MatrixXd expected = from_source(scaling, outputs);
  const Eigen::MatrixXd computed = predict_packed(weights, ours);
  SourceCheck check;
  check.rows = kRows;
  check.samples = theirs.size();
  for (Eigen::Index k = 0; k < expected.cols(); ++k) {
    const model::OutputSpec& output = model.outputs[static_cast<std::size_t>(k)];
    const double mean = expected.col(k).mean();
    const double spread = std::sqrt((expected.col(k).array() - mean).square().mean());
    const double largest = (expected.col(k) - computed.col(k)).cwiseAbs().maxCoeff();
    check.joints.push_back(
        {output.joint, output.unit, largest, spread, expected.col(k).cwiseAbs().maxCoeff()});
  }
  return check;
}

}  // namespace ravencal::conversion
