// SPDX-License-Identifier: Apache-2.0
//
// What `train` does without a method, on the inputs that it offers itself.
#include <cmath>
#include <limits>

#include "choice/choose.hpp"
#include "methods/method.hpp"
#include "model/feature_matrix.hpp"

namespace ravencal::methods {
namespace {

/// The recording that a series was made from, with what a series keeps of it.
record::Recording recording_of(const Problem& problem, const Series& series) {
  record::Recording recording;
  recording.source = series.source;
  std::vector<Eigen::VectorXd> columns;
  for (const record::Channel& channel : problem.channels) {
    if (record::tells_truth(channel.role)) continue;
    const auto values = series.channels.find(channel.name);
    if (values == series.channels.end()) continue;
    recording.channels.push_back(channel);
    columns.push_back(values->second);
  }
  for (std::size_t k = 0; k < problem.outputs.size(); ++k) {
    const auto output = static_cast<Eigen::Index>(k);
    recording.channels.push_back({"truth." + problem.outputs[k].joint, problem.outputs[k].unit,
                                  record::Role::kJointTruth, problem.outputs[k].joint});
    columns.emplace_back(series.estimate.col(output) + series.errors.col(output));
  }
  recording.samples.resize(series.rows(), static_cast<Eigen::Index>(columns.size()));
  for (std::size_t c = 0; c < columns.size(); ++c)
    recording.samples.col(static_cast<Eigen::Index>(c)) = columns[c];
  for (Eigen::Index row = 0; row < series.rows(); ++row) {
    recording.t_ns.push_back(std::llround(series.t_s[row] * 1e9));
    if (series.fresh[static_cast<std::size_t>(row)] != 0)
      recording.events.push_back({recording.t_ns.back(), "episode", ""});
  }
  for (const double t_s : series.homings_s)
    recording.events.push_back({std::llround(t_s * 1e9), "homing", ""});
  return recording;
}

class ChosenPredictor final : public Predictor {
 public:
  ChosenPredictor(const Problem& problem, choice::Choice choice)
      : problem_(problem), choice_(std::move(choice)) {}

  void start(const Series& series, Eigen::Index) override {
    const auto inputs = model::feature_matrix(
        choice_.model.features, recording_of(problem_, series), choice_.model.row_period_s);
    inputs_ = inputs.ok() ? *inputs : model::FeatureMatrix();
  }
  void step(const Series&, Eigen::Index row, Eigen::Ref<Eigen::VectorXd> correction) override {
    if (row < inputs_.rows() && inputs_.row(row).allFinite()) {
      correction = choice_.model.predict(inputs_.row(row).cast<double>()).transpose();
    } else {
      correction.setConstant(std::numeric_limits<double>::quiet_NaN());
    }
  }
  [[nodiscard]] std::size_t parameters() const override {
    std::size_t count = 0;
    for (const model::DenseLayer& layer : choice_.model.layers)
      count += static_cast<std::size_t>(layer.weights.size() + layer.biases.size());
    return count;
  }
  [[nodiscard]] const model::CalibrationModel* model() const override { return &choice_.model; }
  [[nodiscard]] std::string remark() const override {
    return choice_.model.provenance.at("settings");
  }

 private:
  Problem problem_;
  choice::Choice choice_;
  model::FeatureMatrix inputs_;  ///< of the series in work
};

class Chosen final : public Method {
 public:
  std::string_view id() const override { return "chosen"; }
  std::string_view title() const override { return "chosen per joint"; }
  std::string_view source() const override { return "ravencal train"; }
  bool ours() const override { return true; }
  core::Result<std::unique_ptr<Predictor>> fit(const Problem& problem,
                                               std::span<const Series> train,
                                               const Settings& settings) const override {
    std::vector<record::Recording> recordings;
    for (const Series& series : train) recordings.push_back(recording_of(problem, series));
    std::vector<const record::Recording*> pointers;
    for (const record::Recording& recording : recordings) pointers.push_back(&recording);
    choice::ChoiceOptions options;
    options.seed = settings.seed;
    for (const model::OutputSpec& output : problem.outputs) options.joints.push_back(output.joint);
    RAVENCAL_ASSIGN_OR_RETURN(
        choice::Choice choice,
        choice::choose_model(pointers, options, [&](double done, const std::string&) {
          return settings.keep_going(done);
        }));
    if (choice.interrupted) return stopped();
    return std::unique_ptr<Predictor>(
        std::make_unique<ChosenPredictor>(problem, std::move(choice)));
  }
};

}  // namespace

std::unique_ptr<Method> make_chosen() { return std::make_unique<Chosen>(); }

}  // namespace ravencal::methods
