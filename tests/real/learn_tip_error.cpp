// SPDX-License-Identifier: Apache-2.0
//
// Mean distance between the true tip of a dVRK arm and where its joints put it, before and after
// calibration: learn_tip_error RECORDING.csv PROFILE MODEL.onnx...
// Joints without a model keep their estimate. Kinematics: modified DH of the patient-side arm as in
// BerkeleyAutomation/dvrkCalibration (Hwang et al., RA-L 2020).
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "learn/evaluate.hpp"
#include "learn/onnx_file.hpp"
#include "record/load.hpp"

namespace {

using namespace ravencal;
using Joints = std::array<double, 6>;  ///< q1, q2, q4, q5, q6 in rad, q3 in m

/// Craig's transform from frame i to i-1.
Eigen::Isometry3d link(double a_m, double alpha_rad, double d_m, double theta_rad) {
  Eigen::Isometry3d transform = Eigen::Isometry3d::Identity();
  transform.rotate(Eigen::AngleAxisd(alpha_rad, Eigen::Vector3d::UnitX()));
  transform.translate(Eigen::Vector3d(a_m, 0.0, 0.0));
  transform.rotate(Eigen::AngleAxisd(theta_rad, Eigen::Vector3d::UnitZ()));
  transform.translate(Eigen::Vector3d(0.0, 0.0, d_m));
  return transform;
}

Eigen::Vector3d tip_m(const Joints& q) {
  constexpr double kL1 = 0.4318, kL2 = 0.4162, kL3 = 0.0091, kL4 = 0.0102;
  constexpr double kQuarter = std::numbers::pi / 2.0;
  const Eigen::Isometry3d pose =
      link(0, kQuarter, 0, q[0] + kQuarter) * link(0, -kQuarter, 0, q[1] - kQuarter) *
      link(0, kQuarter, q[2] - kL1 + kL2, 0) * link(0, 0, 0, q[3]) *
      link(0, -kQuarter, 0, q[4] - kQuarter) * link(kL3, -kQuarter, 0, q[5] - kQuarter) *
      link(0, -kQuarter, kL4, 0);
  return pose.translation();
}

core::Status run(int argc, char** argv) {
  record::LoadOptions options;
  options.profile = argv[2];
  RAVENCAL_ASSIGN_OR_RETURN(const record::Recording recording,
                            record::load_recording(argv[1], options));
  std::array<std::vector<double>, 6> truth, raw, corrected;
  for (std::size_t k = 0; k < 6; ++k) {
    const std::string joint = fmt::format("q{}", k + 1);
    const auto t = recording.column(record::Role::kJointTruth, joint);
    const auto e = recording.column(record::Role::kJointEstimate, joint);
    if (!t || !e) return core::Error{core::ErrorCode::kData, "joint " + joint + " is missing"};
    for (Eigen::Index row = 0; row < recording.rows(); ++row) {
      truth[k].push_back(recording.samples(row, *t));
      raw[k].push_back(recording.samples(row, *e));
    }
    corrected[k] = raw[k];
  }
  const record::Recording* const recordings[] = {&recording};
  for (int i = 3; i < argc; ++i) {
    RAVENCAL_ASSIGN_OR_RETURN(const model::CalibrationModel model, learn::read_onnx(argv[i]));
    RAVENCAL_ASSIGN_OR_RETURN(const learn::Evaluation evaluation,
                              learn::evaluate(model, recordings));
    for (const learn::JointEvaluation& joint : evaluation.joints) {
      const auto k = static_cast<std::size_t>(joint.joint.back() - '1');
      if (joint.corrected.size() != raw[k].size()) {
        return core::Error{core::ErrorCode::kData, joint.joint + ": some rows are not usable"};
      }
      corrected[k] = joint.corrected;
    }
  }
  double before_m = 0.0, after_m = 0.0;
  const std::size_t rows = truth[0].size();
  for (std::size_t row = 0; row < rows; ++row) {
    Joints t{}, r{}, c{};
    for (std::size_t k = 0; k < 6; ++k) {
      t[k] = truth[k][row];
      r[k] = raw[k][row];
      c[k] = corrected[k][row];
    }
    before_m += (tip_m(r) - tip_m(t)).norm();
    after_m += (tip_m(c) - tip_m(t)).norm();
  }
  fmt::print("mean tip error of {} samples: {:.2f} mm raw, {:.2f} mm calibrated\n", rows,
             1e3 * before_m / static_cast<double>(rows), 1e3 * after_m / static_cast<double>(rows));
  return {};
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4) {
    fmt::print(stderr, "learn_tip_error RECORDING.csv PROFILE MODEL.onnx...\n");
    return 2;
  }
  const core::Status status = run(argc, argv);
  if (status.ok()) return 0;
  fmt::print(stderr, "learn_tip_error: {}\n", status.error().message);
  return 3;
}
