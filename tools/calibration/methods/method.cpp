// SPDX-License-Identifier: Apache-2.0
#include "methods/method.hpp"

#include <limits>

namespace ravencal::methods {
namespace {

class ModelPredictor final : public Predictor {
 public:
  ModelPredictor(model::CalibrationModel model, std::vector<Eigen::Index> columns,
                 std::string remark)
      : model_(std::move(model)), columns_(std::move(columns)), remark_(std::move(remark)) {}

  void step(const Series& series, Eigen::Index row,
            Eigen::Ref<Eigen::VectorXd> correction) override {
    correction = model_.predict(series.inputs(row, columns_)).transpose();
  }
  Eigen::MatrixXd predict(const Series& series) override {
    Eigen::MatrixXd result(series.rows(), model_.output.mean.size());
    constexpr Eigen::Index kRows = 4096;
    for (Eigen::Index row = 0; row < series.rows(); row += kRows) {
      const Eigen::Index count = std::min(kRows, series.rows() - row);
      result.middleRows(row, count) =
          model_.predict(series.inputs.middleRows(row, count)(Eigen::all, columns_));
    }
    for (Eigen::Index row = 0; row < series.rows(); ++row) {
      if (!series.usable(row))
        result.row(row).setConstant(std::numeric_limits<double>::quiet_NaN());
    }
    return result;
  }
  [[nodiscard]] std::size_t parameters() const override {
    std::size_t count = 0;
    for (const model::DenseLayer& layer : model_.layers)
      count += static_cast<std::size_t>(layer.weights.size() + layer.biases.size());
    return count;
  }
  [[nodiscard]] const model::CalibrationModel* model() const override { return &model_; }
  [[nodiscard]] std::string remark() const override { return remark_; }

 private:
  model::CalibrationModel model_;
  std::vector<Eigen::Index> columns_;
  std::string remark_;
};

}  // namespace

Eigen::MatrixXd Predictor::predict(const Series& series) {
  Eigen::MatrixXd result = Eigen::MatrixXd::Constant(series.rows(), series.errors.cols(),
                                                     std::numeric_limits<double>::quiet_NaN());
  Eigen::VectorXd correction(series.errors.cols());
  bool fresh = true;
  for (Eigen::Index row = 0; row < series.rows(); ++row) {
    fresh = fresh || series.fresh[static_cast<std::size_t>(row)] != 0;
    if (!series.usable(row)) continue;
    if (fresh) start(series, row);
    fresh = false;
    step(series, row, correction);
    result.row(row) = correction.transpose();
  }
  return result;
}

std::unique_ptr<Predictor> model_predictor(model::CalibrationModel model,
                                           std::vector<Eigen::Index> columns, std::string remark) {
  return std::make_unique<ModelPredictor>(std::move(model), std::move(columns), std::move(remark));
}

core::Error stopped() { return {core::ErrorCode::kUsage, "stopped by the user"}; }

const std::vector<std::unique_ptr<Method>>& all_methods() {
  static const auto methods = [] {
    std::vector<std::unique_ptr<Method>> all;
    for (const auto make :
         {make_raw, make_bias, make_linear, make_ridge, make_polynomial, make_gaussian_process,
          make_bouc_wen, make_kalman, make_gru, make_lstm, make_two_phase, make_ridge_memory,
          make_network, make_chosen, make_physics, make_physics_network}) {
      all.push_back(make());
    }
    return all;
  }();
  return methods;
}

}  // namespace ravencal::methods
