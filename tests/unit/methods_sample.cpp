// SPDX-License-Identifier: Apache-2.0
#include "unit/methods_sample.hpp"

#include <cmath>
#include <fstream>

#include "core/random.hpp"

namespace ravencal::test {

using methods::Series;

methods::Problem sample_problem() {
  methods::Problem problem;
  for (const char* channel : {"elbow.estimate", "wrist.estimate", "elbow.effort", "wrist.effort"})
    problem.features.push_back(model::FeatureSpec::parse(channel).value());
  problem.plain = 4;
  using record::Role;
  problem.channels = {{"elbow.estimate", "rad", Role::kJointEstimate, "elbow"},
                      {"wrist.estimate", "rad", Role::kJointEstimate, "wrist"},
                      {"elbow.effort", "N_m", Role::kDriveTorque, "elbow"},
                      {"wrist.effort", "N_m", Role::kDriveTorque, "wrist"}};
  problem.outputs = {{"elbow", "elbow.estimate", "rad"}, {"wrist", "wrist.estimate", "rad"}};
  problem.row_period_s = 0.01;
  problem.order = methods::Order::kTime;
  return problem;
}

Series sample_series(Eigen::Index rows, std::uint64_t seed, const SampleError& error) {
  Series s;
  core::Random random(seed);
  const double phase = 6.28 * random.uniform();
  s.inputs.resize(rows, 4);
  s.errors.resize(rows, 2);
  s.t_s.resize(rows);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const double t = 0.01 * static_cast<double>(i);
    const double grown = 0.3 + 0.7 * static_cast<double>(i) / static_cast<double>(rows);
    s.t_s[i] = t;
    s.inputs.row(i) << grown * std::sin(2.1 * t + phase), grown * std::sin(1.3 * t + 2.0 * phase),
        2.0 * random.uniform() - 1.0, 2.0 * random.uniform() - 1.0;
  }
  s.estimate = s.inputs.leftCols(2);
  s.effort = s.inputs.rightCols(2);
  s.channels = {{"position of elbow", s.inputs.col(0)}, {"position of wrist", s.inputs.col(1)},
                {"elbow.estimate", s.inputs.col(0)},    {"wrist.estimate", s.inputs.col(1)},
                {"elbow.effort", s.inputs.col(2)},      {"wrist.effort", s.inputs.col(3)}};
  s.fresh.assign(static_cast<std::size_t>(rows), 0);
  s.fresh.front() = 1;
  for (Eigen::Index i = 0; i < rows; ++i) s.errors.row(i) = error(s, i).transpose();
  return s;
}

Eigen::Vector2d linear_error(const Series& s, Eigen::Index row) {
  const double e = 0.02 + 0.1 * s.inputs(row, 0) + 0.03 * s.inputs(row, 2);
  return {e, 0.5 * e};
}

methods::Settings quick_settings() {
  methods::Settings settings;
  settings.hidden = {12};
  settings.activation = model::Activation::kTanh;
  settings.epochs = 60;
  settings.batch = 64;
  settings.learning_rate = 5e-3;
  settings.penalty_scale = 0.01;
  settings.gru_units = 8;
  settings.gru_dense = 8;
  settings.gru_epochs = 1;
  settings.gru_iterations = 600;
  settings.lstm_units = 8;
  settings.lstm_iterations = 400;
  settings.inducing = 64;
  settings.trees = 20;
  return settings;
}

std::filesystem::path sample_diagnosis(const std::string& name, double width_rad) {
  const std::filesystem::path folder = std::filesystem::temp_directory_path() / name;
  std::filesystem::create_directories(folder);
  std::ofstream plant(folder / "plant_improved.toml");
  plant << "[robot]\nname = \"sample\"\ngravity_m_per_s2 = [0.0, 0.0, 0.0]\n"
           "tool_joints_rad = [0.0, 0.0, 0.0, 0.0]\n";
  for (const char* joint : {"elbow", "wrist"}) {
    plant << "[[joint]]\nname = \"" << joint
          << "\"\nkind = \"revolute\"\nmotor_inertia_kg_m2 = 1e-5\ngearbox_ratio = 1.0\n"
             "reduction = 1.0\njoint_encoder_resolution_rad = 1e-5\n";
    if (std::string(joint) == "elbow")
      plant << "[[joint.effect]]\nid = \"gain_error\"\nratio = 0.1\n";
    else
      plant << "[[joint.effect]]\nid = \"joint_friction\"\nstretch_rad = 0.05\nwidth_rad = "
            << width_rad << "\n";
  }
  return folder;
}

const methods::Method& method(std::string_view id) {
  for (const auto& candidate : methods::all_methods()) {
    if (candidate->id() == id) return *candidate;
  }
  std::abort();
}

double rmse_left(methods::Predictor& predictor, const Series& test, Eigen::Index output) {
  const Eigen::MatrixXd left = test.errors - predictor.predict(test);
  return std::sqrt(left.col(output).squaredNorm() / static_cast<double>(left.rows()));
}

}  // namespace ravencal::test
