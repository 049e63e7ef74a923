// SPDX-License-Identifier: Apache-2.0
//
// Networks with a memory of their own. GRU: the second study of the paper's authors (journal
// version of arXiv 2302.04999 and its notebook): 8 steps 50 ms apart, 300 units, a sigmoid layer of
// 300. LSTM: Hwang et al., RA-L 2020 (dvrkCalibration, modeling/): 4 rows, 120 units, linear
// output, Adam at 1e-3 on batches of 100. Neither gets play operators, because they have a memory
// of their own.
#include <fmt/format.h>

#include <cmath>

#include "core/random.hpp"
#include "learn/aligned.hpp"
#include "methods/method.hpp"
#include "methods/recurrent_kernels.hpp"
#include "methods/scaled_model.hpp"

namespace ravencal::methods {
namespace {

struct Plan {
  RecurrentShape shape;
  Eigen::Index stride_rows = 1;
  std::uint32_t batch = 256;
  std::uint32_t iterations = 0;  ///< at least
  double learning_rate = 1e-3;
  std::uint64_t seed = 3;
};

/// A matrix on cache lines, as the kernels want it.
class LineMatrix {
 public:
  LineMatrix(Eigen::Index rows, Eigen::Index columns)
      : values_(static_cast<std::size_t>(rows * columns), 0.0F), rows_(rows), columns_(columns) {}
  [[nodiscard]] float* data() { return values_.data(); }
  [[nodiscard]] const float* data() const { return values_.data(); }
  [[nodiscard]] Eigen::Map<Eigen::MatrixXf> view() { return {values_.data(), rows_, columns_}; }
  [[nodiscard]] Eigen::Map<Eigen::ArrayXf> flat() { return {values_.data(), rows_ * columns_}; }

 private:
  learn::AlignedVector<float> values_;
  Eigen::Index rows_;
  Eigen::Index columns_;
};

/// Scaled inputs of a series as columns, and where the episode of each row began.
struct Rows {
  Eigen::MatrixXf inputs;  ///< [inputs x rows]
  std::vector<Eigen::Index> began;
};

Rows rows_of(const model::CalibrationModel& frame, const Series& series) {
  const Eigen::Index count = frame.input.mean.size();
  Rows rows;
  rows.inputs =
      ((series.inputs.leftCols(count).transpose().colwise() - frame.input.mean).array().colwise() /
       frame.input.scale.array())
          .cast<float>();
  Eigen::Index began = 0;
  for (Eigen::Index row = 0; row < series.rows(); ++row) {
    // A row with a lost input ends the memory, too.
    if (series.fresh[static_cast<std::size_t>(row)] != 0 || !series.usable(row)) began = row;
    if (row > 0 && !series.usable(row - 1)) began = row;
    rows.began.push_back(began);
  }
  return rows;
}

/// Columns of the window that ends at `row`, oldest first, into column `sample` of each step.
void gather(const Plan& plan, const Rows& rows, Eigen::Index row, Eigen::Index sample,
            Eigen::Index samples, Eigen::Map<Eigen::MatrixXf> windows) {
  for (std::ptrdiff_t t = 0; t < plan.shape.window; ++t) {
    const Eigen::Index back = (plan.shape.window - 1 - t) * plan.stride_rows;
    const Eigen::Index at = std::max(row - back, rows.began[static_cast<std::size_t>(row)]);
    windows.col(t * samples + sample) = rows.inputs.col(at);
  }
}

/// Adam (Kingma and Ba 2015) with Keras' and PyTorch's defaults.
class Adam {
 public:
  explicit Adam(std::ptrdiff_t count)
      : first_(Eigen::ArrayXf::Zero(count)), second_(Eigen::ArrayXf::Zero(count)) {}
  void step(Eigen::Map<Eigen::ArrayXf> parameters, Eigen::Map<Eigen::ArrayXf> gradient,
            double rate) {
    constexpr float kBeta1 = 0.9F;
    constexpr float kBeta2 = 0.999F;
    ++steps_;
    first_ = kBeta1 * first_ + (1.0F - kBeta1) * gradient;
    second_ = kBeta2 * second_ + (1.0F - kBeta2) * gradient.square();
    const double correction = std::sqrt(1.0 - std::pow(static_cast<double>(kBeta2), steps_)) /
                              (1.0 - std::pow(static_cast<double>(kBeta1), steps_));
    parameters -= static_cast<float>(rate * correction) * first_ / (second_.sqrt() + 1e-7F);
  }

 private:
  Eigen::ArrayXf first_;
  Eigen::ArrayXf second_;
  int steps_ = 0;
};

/// Glorot uniform weights per gate, zero biases; the forget gate's bias is 1 (Gers et al. 2000).
LineMatrix initial(const RecurrentShape& s, std::uint64_t seed) {
  LineMatrix parameters(s.parameter_count(), 1);
  Eigen::Map<Eigen::ArrayXf> p = parameters.flat();
  core::Random random(seed);
  const auto draw = [&](int block, std::ptrdiff_t in, std::ptrdiff_t out) {
    const double limit = std::sqrt(6.0 / static_cast<double>(in + out));
    const std::ptrdiff_t end = s.offset(block) + s.size(block);
    for (std::ptrdiff_t i = s.offset(block); i < end; ++i)
      p[i] = static_cast<float>(limit * (2.0 * random.uniform() - 1.0));
  };
  draw(0, s.inputs, s.units);
  draw(2, s.units, s.units);
  if (s.dense > 0) draw(4, s.units, s.dense);
  draw(6, s.head_inputs(), s.outputs);
  if (s.cell == Cell::kLstm) p.segment(s.offset(1) + s.units, s.units).setOnes();
  return parameters;
}

/// Layers that the plugin runs: gate blocks padded to whole lines, then the dense layers.
std::vector<model::DenseLayer> gru_layers(const Plan& plan, const LineMatrix& p) {
  const RecurrentShape& s = plan.shape;
  const auto block = static_cast<Eigen::Index>(
      model::packed::padded(static_cast<std::size_t>(s.units), model::packed::kLineLanes));
  const auto matrix = [&](int at, Eigen::Index rows, Eigen::Index columns) {
    return Eigen::MatrixXf(
        Eigen::Map<const Eigen::MatrixXf>(p.data() + s.offset(at), rows, columns));
  };
  const auto padded = [&](const Eigen::MatrixXf& gates) {
    Eigen::MatrixXf wide = Eigen::MatrixXf::Zero(3 * block, gates.cols());
    for (Eigen::Index g = 0; g < 3; ++g)
      wide.middleRows(g * block, s.units) = gates.middleRows(g * s.units, s.units);
    return wide;
  };
  std::vector<model::DenseLayer> layers(s.dense > 0 ? 4 : 3);
  layers[0].weights = padded(matrix(0, s.gates(), s.inputs));
  layers[0].biases = padded(matrix(1, s.gates(), 1));
  layers[0].kind = model::packed::LayerKind::kGruInput;
  layers[1].weights = padded(matrix(2, s.gates(), s.units));
  layers[1].biases = padded(matrix(3, s.gates(), 1));
  layers[1].kind = model::packed::LayerKind::kGruRecurrent;
  layers[1].window = static_cast<std::uint8_t>(s.window);
  layers[1].stride_rows = static_cast<std::uint32_t>(plan.stride_rows);
  if (s.dense > 0) {
    layers[2].weights = matrix(4, s.dense, s.units);
    layers[2].biases = matrix(5, s.dense, 1);
    layers[2].activation = model::Activation::kSigmoid;
  }
  layers.back().weights = matrix(6, s.outputs, s.head_inputs());
  layers.back().biases = matrix(7, s.outputs, 1);
  return layers;
}

class RecurrentPredictor final : public Predictor {
 public:
  RecurrentPredictor(Plan plan, model::CalibrationModel frame, LineMatrix parameters)
      : plan_(plan), model_(std::move(frame)), parameters_(std::move(parameters)) {
    if (plan_.shape.cell == Cell::kGru) model_.layers = gru_layers(plan_, parameters_);
  }

  Eigen::MatrixXd predict(const Series& series) override {
    const Rows rows = rows_of(model_, series);
    Eigen::MatrixXd result(series.rows(), plan_.shape.outputs);
    constexpr Eigen::Index kBatch = 256;
    for (Eigen::Index row = 0; row < series.rows(); row += kBatch)
      run(rows, row, std::min(kBatch, series.rows() - row), result);
    for (Eigen::Index row = 0; row < series.rows(); ++row) {
      if (!series.usable(row)) result.row(row).setConstant(std::nan(""));
    }
    return result;
  }
  /// One row by itself: its window is scaled and run from zero, as a loop without memory would.
  void step(const Series& series, Eigen::Index row,
            Eigen::Ref<Eigen::VectorXd> correction) override {
    const Eigen::Index span = (plan_.shape.window - 1) * plan_.stride_rows;
    Eigen::Index from = row;
    while (from > 0 && row - from < span && series.fresh[static_cast<std::size_t>(from)] == 0 &&
           series.usable(from - 1))
      --from;
    const Series part = slice_inputs(series, from, row - from + 1);
    Eigen::MatrixXd result(row - from + 1, plan_.shape.outputs);
    run(rows_of(model_, part), row - from, 1, result);
    correction = result.row(row - from).transpose();
  }
  [[nodiscard]] std::size_t parameters() const override {
    std::ptrdiff_t count = 0;
    for (int block = 0; block < RecurrentShape::kBlocks; ++block) count += plan_.shape.size(block);
    return static_cast<std::size_t>(count);
  }
  [[nodiscard]] const model::CalibrationModel* model() const override {
    return plan_.shape.cell == Cell::kGru ? &model_ : nullptr;
  }
  [[nodiscard]] std::string remark() const override {
    return fmt::format("{} units, {} steps {} row(s) = {:g} s apart", plan_.shape.units,
                       plan_.shape.window, plan_.stride_rows,
                       static_cast<double>(plan_.stride_rows) * model_.row_period_s);
  }

 private:
  static Series slice_inputs(const Series& series, Eigen::Index from, Eigen::Index count) {
    Series part;
    part.inputs = series.inputs.middleRows(from, count);
    part.fresh.assign(static_cast<std::size_t>(count), 0);
    part.fresh.front() = 1;
    return part;
  }
  void run(const Rows& rows, Eigen::Index row, Eigen::Index count, Eigen::MatrixXd& result) const {
    LineMatrix windows(plan_.shape.inputs, plan_.shape.window * count);
    for (Eigen::Index i = 0; i < count; ++i) gather(plan_, rows, row + i, i, count, windows.view());
    LineMatrix outputs(plan_.shape.outputs, count);
    recurrent_kernels(learn::best_isa())
        .forward(plan_.shape, parameters_.data(), windows.data(), count, outputs.data());
    result.middleRows(row, count) =
        ((outputs.view().cast<double>().array().colwise() * model_.output.scale.array())
             .matrix()
             .colwise() +
         model_.output.mean)
            .transpose();
  }

  Plan plan_;
  model::CalibrationModel model_;  ///< for an LSTM the frame alone
  LineMatrix parameters_;
};

/// Trains on windows in random order. Errors: stopped.
core::Result<std::unique_ptr<Predictor>> train(Plan plan, const Problem& problem,
                                               std::span<const Series> series,
                                               const Settings& settings, double epochs) {
  const auto columns = first_columns(problem.plain);
  const Stack data = stack(series, problem.plain);
  if (data.errors.rows() == 0)
    return core::Error{core::ErrorCode::kData,
                       "no training row has every feature and every joint's error"};
  model::CalibrationModel frame = frame_of(problem, columns, data);
  plan.shape.inputs = problem.plain;
  plan.shape.outputs = data.errors.cols();
  std::vector<Rows> rows;
  std::vector<std::pair<std::size_t, Eigen::Index>> order;
  for (std::size_t k = 0; k < series.size(); ++k) {
    rows.push_back(rows_of(frame, series[k]));
    for (Eigen::Index row = 0; row < series[k].rows(); ++row) {
      if (series[k].trains(row)) order.emplace_back(k, row);
    }
  }
  const auto batch = std::min<Eigen::Index>(plan.batch, static_cast<Eigen::Index>(order.size()));
  if (epochs > 0.0) {
    const double asked = epochs * static_cast<double>(order.size()) / static_cast<double>(batch);
    plan.iterations =
        static_cast<std::uint32_t>(std::max<double>(std::ceil(asked), plan.iterations));
  }
  LineMatrix parameters = initial(plan.shape, plan.seed);
  LineMatrix gradient(plan.shape.parameter_count(), 1);
  Adam adam(plan.shape.parameter_count());
  core::Random random(plan.seed + 1);
  LineMatrix windows(plan.shape.inputs, plan.shape.window * batch);
  LineMatrix targets(plan.shape.outputs, batch);
  std::size_t next = order.size();
  for (std::uint32_t i = 0; i < plan.iterations; ++i) {
    if (i % 8 == 0 && !settings.keep_going(static_cast<double>(i) / plan.iterations))
      return stopped();
    for (Eigen::Index b = 0; b < batch; ++b) {
      if (next == order.size()) {
        random.shuffle(std::span(order));
        next = 0;
      }
      const auto [k, row] = order[next++];
      gather(plan, rows[k], row, b, batch, windows.view());
      targets.view().col(b) = ((series[k].errors.row(row).transpose() - frame.output.mean).array() /
                               frame.output.scale.array())
                                  .cast<float>();
    }
    recurrent_kernels(learn::best_isa())
        .gradient(plan.shape, parameters.data(), windows.data(), targets.data(), batch,
                  gradient.data());
    // The step falls to a tenth over the last third, which lowers the noise of small batches.
    const double late = 3.0 * (static_cast<double>(i) / plan.iterations - 2.0 / 3.0);
    adam.step(parameters.flat(), gradient.flat(),
              plan.learning_rate * std::pow(10.0, -std::max(0.0, late)));
  }
  if (!parameters.flat().allFinite())
    return core::Error{core::ErrorCode::kData, "training diverged: a weight is not finite"};
  frame.provenance["settings"] =
      fmt::format("{} units, window {}, seed {}", plan.shape.units, plan.shape.window, plan.seed);
  return std::unique_ptr<Predictor>(
      std::make_unique<RecurrentPredictor>(plan, std::move(frame), std::move(parameters)));
}

class Recurrent : public Method {
 public:
  std::string unsuited(const Problem& problem, std::span<const Series>,
                       const Settings&) const override {
    return problem.order == Order::kPoses ? "needs rows in order of time" : "";
  }
};

class Gru final : public Recurrent {
 public:
  std::string_view id() const override { return "gru"; }
  std::string_view title() const override { return "GRU, 8 steps of 50 ms"; }
  std::string_view source() const override { return "Peng et al., T-ASE 2025"; }
  core::Result<std::unique_ptr<Predictor>> fit(const Problem& problem,
                                               std::span<const Series> series,
                                               const Settings& settings) const override {
    constexpr double kWindowStepS = 0.05;
    Plan plan;
    plan.shape.cell = Cell::kGru;
    plan.shape.units = settings.gru_units;
    plan.shape.dense = settings.gru_dense;
    plan.shape.window = 8;
    plan.stride_rows =
        problem.order == Order::kTime && problem.row_period_s > 0.0
            ? std::max<Eigen::Index>(1, std::lround(kWindowStepS / problem.row_period_s))
            : 1;
    plan.batch = count_rows(series) > 20000 ? 256 : 64;
    plan.iterations = settings.gru_iterations;
    plan.seed = settings.seed;
    return train(plan, problem, series, settings, settings.gru_epochs);
  }
};

class Lstm final : public Recurrent {
 public:
  std::string_view id() const override { return "lstm"; }
  std::string_view title() const override { return "LSTM, 4 rows"; }
  std::string_view source() const override { return "Hwang et al., RA-L 2020"; }
  std::string why_not_loadable() const override { return "the plugin runs GRUs, not LSTMs"; }
  core::Result<std::unique_ptr<Predictor>> fit(const Problem& problem,
                                               std::span<const Series> series,
                                               const Settings& settings) const override {
    Plan plan;
    plan.shape.cell = Cell::kLstm;
    plan.shape.units = settings.lstm_units;
    plan.shape.window = 4;
    // Their rows are one and a half seconds apart; in a stream four rows do not describe the path.
    plan.stride_rows = problem.order == Order::kTime && problem.row_period_s > 0.0
                           ? std::max<Eigen::Index>(1, std::lround(0.5 / problem.row_period_s))
                           : 1;
    plan.batch = 100;
    plan.iterations = settings.lstm_iterations;
    plan.seed = settings.seed;
    return train(plan, problem, series, settings, 0.0);
  }
};

}  // namespace

std::unique_ptr<Method> make_gru() { return std::make_unique<Gru>(); }
std::unique_ptr<Method> make_lstm() { return std::make_unique<Lstm>(); }

}  // namespace ravencal::methods
