// SPDX-License-Identifier: Apache-2.0
//
// One calibration method behind one small interface: fit it to training series, get a predictor,
// ask the predictor row by row, as a control loop would. A predictor never sees a truth. Not for
// real time; one thread per predictor.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"
#include "methods/problem.hpp"

namespace ravencal::methods {

class Predictor {
 public:
  virtual ~Predictor() = default;

  /// Before the first row of an episode, `row` of `series`.
  virtual void start(const Series& /*series*/, Eigen::Index /*row*/) {}
  /// Correction of one row [outputs]. Rows come in order; state may be kept since start().
  virtual void step(const Series& series, Eigen::Index row,
                    Eigen::Ref<Eigen::VectorXd> correction) = 0;
  /// Corrections of a whole series [rows x outputs], NaN where an input is lost. Calls step() for
  /// each row unless a method has a faster way to the same numbers.
  virtual Eigen::MatrixXd predict(const Series& series);
  /// Number of fitted parameters.
  [[nodiscard]] virtual std::size_t parameters() const = 0;
  /// What `convert` can load, or nullptr.
  [[nodiscard]] virtual const model::CalibrationModel* model() const { return nullptr; }
  /// Settings that the training chose: one sentence, may be empty.
  [[nodiscard]] virtual std::string remark() const { return {}; }
};

struct Settings {
  std::uint64_t seed = 3;
  unsigned threads = 1;
  // The network.
  std::vector<std::uint32_t> hidden = {128, 64, 32};
  model::Activation activation = model::Activation::kSigmoid;
  std::uint32_t epochs = 60;
  std::uint32_t batch = 1024;
  std::uint32_t networks = 1;  ///< of different seeds, averaged
  double learning_rate = 5e-4;
  double penalty_scale = 0.0;  ///< 0: chosen by blocked validation, 0.01 to 30
  // The recurrent networks.
  std::uint32_t gru_units = 300;
  std::uint32_t gru_dense = 300;
  std::uint32_t gru_epochs = 30;
  std::uint32_t gru_iterations = 3000;  ///< at least: few rows make few batches an epoch
  std::uint32_t lstm_units = 120;
  std::uint32_t lstm_iterations = 5000;
  // The others.
  std::uint32_t inducing = 256;  ///< points of the sparse Gaussian process
  std::uint32_t trees = 100;
  std::filesystem::path physics;  ///< folder of `ravencal diagnose` on training data; may be empty
  /// Called now and then with the share done; false stops.
  std::function<bool(double)> keep_going = [](double) { return true; };
};

class Method {
 public:
  virtual ~Method() = default;
  [[nodiscard]] virtual std::string_view id() const = 0;     ///< e.g. "two_phase"
  [[nodiscard]] virtual std::string_view title() const = 0;  ///< e.g. "network, then forest"
  [[nodiscard]] virtual std::string_view source() const = 0;
  /// True for what this project offers, false for what it is compared with.
  [[nodiscard]] virtual bool ours() const { return false; }
  /// Why the method cannot treat this problem; empty if it can.
  [[nodiscard]] virtual std::string unsuited(const Problem& /*problem*/,
                                             std::span<const Series> /*train*/,
                                             const Settings& /*settings*/) const {
    return {};
  }
  /// Why `convert` cannot load what fit() returns; empty if it can.
  [[nodiscard]] virtual std::string why_not_loadable() const { return {}; }
  /// Errors: kData for data that cannot be fitted, kUsage when stopped.
  [[nodiscard]] virtual core::Result<std::unique_ptr<Predictor>> fit(
      const Problem& problem, std::span<const Series> train, const Settings& settings) const = 0;
};

/// All methods, in the order of the table.
const std::vector<std::unique_ptr<Method>>& all_methods();

core::Error stopped();

/// A model of the plain or of all inputs as a predictor.
std::unique_ptr<Predictor> model_predictor(model::CalibrationModel model,
                                           std::vector<Eigen::Index> columns, std::string remark);

// One per file.
std::unique_ptr<Method> make_raw();
std::unique_ptr<Method> make_bias();
std::unique_ptr<Method> make_linear();
std::unique_ptr<Method> make_ridge();
std::unique_ptr<Method> make_ridge_memory();
std::unique_ptr<Method> make_polynomial();
std::unique_ptr<Method> make_network();
std::unique_ptr<Method> make_gru();
std::unique_ptr<Method> make_lstm();
std::unique_ptr<Method> make_gaussian_process();
std::unique_ptr<Method> make_kalman();
std::unique_ptr<Method> make_bouc_wen();
std::unique_ptr<Method> make_two_phase();
std::unique_ptr<Method> make_chosen();
std::unique_ptr<Method> make_physics();
std::unique_ptr<Method> make_physics_network();

}  // namespace ravencal::methods
