// SPDX-License-Identifier: Apache-2.0
//
// The models of tests/golden/models and what their makers say that they compute; make_models.py
// there tells how they were made.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "conversion/foreign_model.hpp"
#include "conversion/scaling_file.hpp"

namespace ravencal::test {

inline const std::filesystem::path kModels =
    std::filesystem::path(RAVENCAL_SOURCE_DIR) / "tests/golden/models";

struct Expected {
  std::string file;
  std::vector<Eigen::MatrixXd> samples;  ///< of the window, oldest first, [rows x inputs]
  Eigen::MatrixXd outputs;               ///< [rows x outputs]
};

inline std::vector<Expected> expected_models() {
  std::ifstream stream(kModels / "expected.json");
  const auto json = nlohmann::json::parse(stream, nullptr, false);
  std::vector<Expected> all;
  for (const auto& [file, values] : json.items()) {
    Expected expected;
    expected.file = file;
    const auto& inputs = values["inputs"];
    const bool has_window = inputs[0][0].is_array();
    const std::size_t window = has_window ? inputs[0].size() : 1;
    const auto rows = static_cast<Eigen::Index>(inputs.size());
    const auto fill = [](Eigen::MatrixXd& matrix, Eigen::Index row, const nlohmann::json& numbers) {
      matrix.conservativeResize(Eigen::NoChange, static_cast<Eigen::Index>(numbers.size()));
      for (std::size_t i = 0; i < numbers.size(); ++i) {
        matrix(row, static_cast<Eigen::Index>(i)) = numbers[i].get<double>();
      }
    };
    expected.samples.assign(window, Eigen::MatrixXd(rows, 0));
    expected.outputs.resize(rows, 0);
    for (std::size_t r = 0; r < inputs.size(); ++r) {
      const auto row = static_cast<Eigen::Index>(r);
      for (std::size_t k = 0; k < window; ++k) {
        fill(expected.samples[k], row, has_window ? inputs[r][k] : inputs[r]);
      }
      fill(expected.outputs, row, values["outputs"][r]);
    }
    all.push_back(std::move(expected));
  }
  EXPECT_EQ(all.size(), 6U) << "expected.json is not what make_models.py writes";
  return all;
}

inline core::Result<conversion::ForeignModel> read_foreign(const std::filesystem::path& path) {
  return path.extension() == ".onnx" ? conversion::read_foreign_onnx(path.string())
                                     : conversion::read_keras(path.string());
}

/// Four inputs and two outputs in SI units, scaled by the file only where the graph does not.
inline conversion::ScalingFile plain_scaling(const conversion::ForeignModel& source, double scale) {
  conversion::ScalingFile file;
  file.features = {{"jpos.shoulder"}, {"jpos.elbow"}, {"jpos.insertion"}, {"mpos.elbow"}};
  file.feature_to_si = Eigen::VectorXd::Ones(4);
  file.outputs = {{"shoulder", "jpos.shoulder", "rad"}, {"insertion", "jpos.insertion", "m"}};
  file.output_to_si = Eigen::VectorXd::Ones(2);
  file.input_min = Eigen::VectorXd::Constant(4, -1e4);
  file.input_max = Eigen::VectorXd::Constant(4, 1e4);
  const auto scaling = [](Eigen::Index size, double by) {
    return conversion::FileScaling{Eigen::VectorXd::Zero(size),
                                   Eigen::VectorXd::Constant(size, by)};
  };
  if (source.network.input.gain.size() == 0) file.input = scaling(4, scale);
  if (source.network.output.gain.size() == 0) file.output = scaling(2, 1.0);
  return file;
}

}  // namespace ravencal::test
