// SPDX-License-Identifier: Apache-2.0
//
// Two-phase calibration: a network on most of the data, then a random forest on what it leaves over
// rows that it has not seen (Seita et al., "Fast and reliable autonomous surgical debridement with
// cable-driven robots using a two-phase calibration procedure", ICRA 2018).
#include <fmt/format.h>

#include "methods/blocked.hpp"
#include "methods/forest.hpp"
#include "methods/network.hpp"
#include "methods/scaled_model.hpp"

namespace ravencal::methods {
namespace {

class TwoPhasePredictor final : public Predictor {
 public:
  TwoPhasePredictor(std::unique_ptr<Predictor> network, Forest forest,
                    model::CalibrationModel frame)
      : network_(std::move(network)), forest_(std::move(forest)), frame_(std::move(frame)) {}

  void step(const Series& series, Eigen::Index row,
            Eigen::Ref<Eigen::VectorXd> correction) override {
    network_->step(series, row, correction);
    correction += second(series, row);
  }
  Eigen::MatrixXd predict(const Series& series) override {
    Eigen::MatrixXd result = network_->predict(series);
    for (Eigen::Index row = 0; row < series.rows(); ++row) {
      if (series.usable(row)) result.row(row) += second(series, row).transpose();
    }
    return result;
  }
  [[nodiscard]] std::size_t parameters() const override {
    return network_->parameters() + forest_.parameters();
  }
  [[nodiscard]] std::string remark() const override {
    return "the forest sees the last quarter of the training rows, the network the others";
  }

 private:
  [[nodiscard]] Eigen::VectorXd second(const Series& series, Eigen::Index row) const {
    const Eigen::VectorXd inputs =
        series.inputs.row(row).head(frame_.input.mean.size()).transpose();
    return forest_.predict(inputs).cwiseProduct(frame_.output.scale);
  }

  std::unique_ptr<Predictor> network_;
  Forest forest_;
  model::CalibrationModel frame_;
};

class TwoPhase final : public Method {
 public:
  std::string_view id() const override { return "two_phase"; }
  std::string_view title() const override { return "network, then forest"; }
  std::string_view source() const override { return "Seita et al., ICRA 2018"; }
  std::string why_not_loadable() const override { return "convert has no trees"; }
  core::Result<std::unique_ptr<Predictor>> fit(const Problem& problem,
                                               std::span<const Series> train,
                                               const Settings& settings) const override {
    const Fold parts = make_fold(train, kFolds - 1);
    RAVENCAL_ASSIGN_OR_RETURN(const double penalty,
                              choose_penalty(problem, parts.train, problem.plain, settings));
    RAVENCAL_ASSIGN_OR_RETURN(
        model::CalibrationModel model,
        train_network(problem, stack(parts.train, problem.plain), settings, penalty, 0.5, 0.8));
    model::CalibrationModel frame = model;
    std::unique_ptr<Predictor> network =
        model_predictor(std::move(model), first_columns(problem.plain), {});
    std::vector<Series> residual = parts.held_out;
    for (Series& series : residual) series.errors -= network->predict(series);
    Stack data = stack(residual, problem.plain);
    if (data.errors.rows() == 0)
      return core::Error{core::ErrorCode::kData, "no usable row is left for the second phase"};
    const Eigen::MatrixXd targets = data.errors * frame.output.scale.cwiseInverse().asDiagonal();
    bool stop = false;
    Forest forest(data.inputs, targets,
                  {.trees = settings.trees, .least_leaf = 5, .deepest = 16, .seed = settings.seed},
                  [&](double done) { return !(stop = !settings.keep_going(0.8 + 0.2 * done)); });
    if (stop) return stopped();
    return std::unique_ptr<Predictor>(std::make_unique<TwoPhasePredictor>(
        std::move(network), std::move(forest), std::move(frame)));
  }
};

}  // namespace

std::unique_ptr<Method> make_two_phase() { return std::make_unique<TwoPhase>(); }

}  // namespace ravencal::methods
