// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <memory>
#include <optional>
#include <string_view>

#include "conversion/chain_builder.hpp"
#include "conversion/keras_file.hpp"

namespace ravencal::conversion {
namespace {

std::string layer_name(const KerasLayer& layer, std::size_t index) {
  return fmt::format("layer {} '{}' ({})", index, layer.name, layer.class_name);
}

core::Result<model::Activation> activation_of(const std::string& name) {
  if (name == "linear") return model::Activation::kLinear;
  if (name == "sigmoid") return model::Activation::kSigmoid;
  if (name == "tanh") return model::Activation::kTanh;
  if (name == "relu") return model::Activation::kRelu;
  return core::data_error(
      fmt::format("activation '{}' is not supported; the weights hold linear, sigmoid, tanh, relu "
                  "and leaky_relu. Train the layer with one of these",
                  name));
}

bool passes_values_on(const KerasLayer& layer) {
  constexpr std::string_view kPassing[] = {"InputLayer",      "Dropout",
                                           "GaussianDropout", "AlphaDropout",
                                           "GaussianNoise",   "ActivityRegularization",
                                           "Identity"};
  return std::find(std::begin(kPassing), std::end(kPassing), layer.class_name) !=
         std::end(kPassing);
}

/// Values that the network takes: what its first shape says, else what its first weights do.
Eigen::Index inputs_of(const KerasFile& file) {
  for (const KerasLayer& layer : file.layers) {
    if (!layer.input_shape.empty() && layer.input_shape.back() > 0) return layer.input_shape.back();
    const auto kernel = layer.weights.find("kernel");
    if (kernel != layer.weights.end()) return kernel->second.rows();
    for (const char* role : {"moving_mean", "mean"}) {
      const auto mean = layer.weights.find(role);
      if (mean != layer.weights.end() && mean->second.size() > 1) return mean->second.size();
    }
  }
  return 0;
}

class NetworkReader {
 public:
  explicit NetworkReader(const KerasFile& file) : file_(file), builder_(inputs_of(file)) {}

  core::Result<ForeignNetwork> read() && {
    for (std::size_t k = 0; k < file_.layers.size(); ++k) {
      const KerasLayer& layer = file_.layers[k];
      if (window_ == 0 && layer.input_shape.size() == 2) {
        window_ = static_cast<std::uint32_t>(layer.input_shape[0]);
        is_flat_ = window_ == 1;
      }
      const core::Status taken = take(layer);
      if (!taken.ok())
        return core::data_error(fmt::format("{}: {}", layer_name(layer, k), taken.error().message));
    }
    RAVENCAL_ASSIGN_OR_RETURN(ForeignNetwork network, std::move(builder_).finish());
    if (network.has_gru) network.window = window_;
    return network;
  }

 private:
  core::Status take(const KerasLayer& layer) {
    if (passes_values_on(layer)) return {};
    if (layer.class_name == "Dense") return take_dense(layer);
    if (layer.class_name == "GRU") return take_gru(layer);
    if (layer.class_name == "Activation") return activate(layer.activation);
    if (layer.class_name == "BatchNormalization") return take_batch_normalisation(layer);
    if (layer.class_name == "Normalization") return take_normalisation(layer);
    if (layer.class_name == "Rescaling") return take_rescaling(layer);
    if (layer.class_name == "ReLU" || layer.class_name == "LeakyReLU" ||
        layer.class_name == "PReLU") {
      return take_leak(layer);
    }
    if (layer.class_name == "Flatten" || layer.class_name == "Reshape") return pass_flat(layer);
    return core::data_error(
        "not supported; a model may have one GRU, and Dense, Activation, ReLU, LeakyReLU, PReLU, "
        "BatchNormalization, Normalization, Rescaling, Dropout, and Flatten or Reshape of a flat "
        "vector. Take the layer out and train again, or bring scaling in the file of --scaling");
  }

  core::Status activate(const std::string& name) {
    if (name == "leaky_relu") {
      return builder_.leak(Eigen::VectorXd::Constant(builder_.width(), kKerasLeakyActivationSlope));
    }
    RAVENCAL_ASSIGN_OR_RETURN(const model::Activation activation, activation_of(name));
    return builder_.activate(activation);
  }

  /// One value for each that arrives: of weights, else of the configuration, else `otherwise`.
  core::Result<Eigen::VectorXd> per_value(const KerasLayer& layer, const char* role,
                                          std::optional<double> otherwise) const {
    RAVENCAL_RETURN_IF_ERROR(check_readable(layer, role));
    const Eigen::Index width = builder_.width();
    Eigen::VectorXd values;
    const auto weights = layer.weights.find(role);
    const auto numbers = layer.numbers.find(role);
    if (weights != layer.weights.end()) {
      values = weights->second.reshaped();
    } else if (numbers != layer.numbers.end()) {
      values = Eigen::VectorXd::Map(numbers->second.data(),
                                    static_cast<Eigen::Index>(numbers->second.size()));
    } else if (otherwise) {
      return Eigen::VectorXd::Constant(width, *otherwise).eval();
    } else {
      return core::data_error(fmt::format("its {} is not in the file", role));
    }
    if (values.size() == 1) return Eigen::VectorXd::Constant(width, values[0]).eval();
    if (values.size() == width && values.allFinite()) return values;
    return core::data_error(
        fmt::format("its {} has {} values where {} arrive", role, values.size(), width));
  }

  /// That a normalisation works value by value, not over time.
  core::Status check_axis(const KerasLayer& layer) const {
    const auto axes = layer.numbers.find("axis");
    if (axes == layer.numbers.end()) return {};
    const double last = is_flat_ ? 1.0 : 2.0;
    for (const double axis : axes->second) {
      if (axis == -1.0 || axis == last) continue;
      return core::data_error(fmt::format(
          "it works along axis {:g}; only the last, -1, is read. Train with axis=-1", axis));
    }
    return {};
  }

  core::Status take_batch_normalisation(const KerasLayer& layer) {
    RAVENCAL_RETURN_IF_ERROR(check_axis(layer));
    const auto learned = [&](const char* flag, const char* role, double otherwise) {
      return layer.number_or(flag, 1.0) != 0.0
                 ? per_value(layer, role, std::nullopt)
                 : core::Result<Eigen::VectorXd>(
                       Eigen::VectorXd::Constant(builder_.width(), otherwise).eval());
    };
    RAVENCAL_ASSIGN_OR_RETURN(const Eigen::VectorXd gamma, learned("scale", "gamma", 1.0));
    RAVENCAL_ASSIGN_OR_RETURN(const Eigen::VectorXd beta, learned("center", "beta", 0.0));
    RAVENCAL_ASSIGN_OR_RETURN(const Eigen::VectorXd mean,
                              per_value(layer, "moving_mean", std::nullopt));
    RAVENCAL_ASSIGN_OR_RETURN(const Eigen::VectorXd variance,
                              per_value(layer, "moving_variance", std::nullopt));
    return builder_.batch_normalise(gamma, beta, mean, variance,
                                    layer.number_or("epsilon", kKerasBatchEpsilon));
  }

  core::Status take_normalisation(const KerasLayer& layer) {
    RAVENCAL_RETURN_IF_ERROR(check_axis(layer));
    RAVENCAL_ASSIGN_OR_RETURN(const Eigen::VectorXd mean, per_value(layer, "mean", std::nullopt));
    RAVENCAL_ASSIGN_OR_RETURN(const Eigen::VectorXd variance,
                              per_value(layer, "variance", std::nullopt));
    if (!(variance.array() >= 0.0).all())
      return core::data_error(fmt::format("its variance is {:g}", variance.minCoeff()));
    const Eigen::VectorXd deviation = variance.cwiseSqrt().cwiseMax(kKerasLeastDeviation);
    if (layer.number_or("invert", 0.0) != 0.0) {
      builder_.scale(deviation, mean);
    } else {
      builder_.scale(deviation.cwiseInverse(), -mean.cwiseQuotient(deviation));
    }
    return {};
  }

  core::Status take_rescaling(const KerasLayer& layer) {
    RAVENCAL_ASSIGN_OR_RETURN(const Eigen::VectorXd scale, per_value(layer, "scale", std::nullopt));
    RAVENCAL_ASSIGN_OR_RETURN(const Eigen::VectorXd offset, per_value(layer, "offset", 0.0));
    builder_.scale(scale, offset);
    return {};
  }

  core::Status take_leak(const KerasLayer& layer) {
    for (const auto& [key, means] :
         {std::pair{"max_value", "an upper limit"}, std::pair{"threshold", "a threshold"}}) {
      const auto it = layer.numbers.find(key);
      if (it == layer.numbers.end() || (it->second == std::vector{0.0} && it->first != "max_value"))
        continue;
      return core::data_error(
          fmt::format("its {} is {:g}, and the weights hold no {}. Train with "
                      "ReLU() without it",
                      key, it->second.front(), means + 3));
    }
    if (layer.class_name == "PReLU") {
      RAVENCAL_ASSIGN_OR_RETURN(const Eigen::VectorXd slopes,
                                per_value(layer, "alpha", std::nullopt));
      return builder_.leak(slopes);
    }
    const double slope =
        layer.class_name == "ReLU"
            ? layer.number_or("negative_slope", 0.0)
            : layer.number_or("negative_slope", layer.number_or("alpha", kKerasLeakySlope));
    return builder_.leak(Eigen::VectorXd::Constant(builder_.width(), slope));
  }

  /// Flatten and Reshape change nothing where a flat vector arrives and leaves.
  core::Status pass_flat(const KerasLayer& layer) const {
    if (!is_flat_) {
      return core::data_error(fmt::format(
          "a window of {} samples arrives, and a model of dense layers takes a flat vector. Train "
          "with Input(shape=(n,)) and name the samples in `features` of the scaling file, such as "
          "\"jpos.elbow@3\"",
          window_));
    }
    const auto shape = layer.numbers.find("target_shape");
    if (layer.class_name == "Flatten") return {};
    if (shape != layer.numbers.end() && shape->second.size() == 1 &&
        (shape->second[0] == -1.0 || shape->second[0] == static_cast<double>(builder_.width()))) {
      return {};
    }
    return core::data_error(
        fmt::format("only a shape of ({},) keeps the flat vector that arrives. Take the layer out",
                    builder_.width()));
  }

  static core::Status check_readable(const KerasLayer& layer, const char* role) {
    const auto it = layer.unreadable.find(role);
    return it == layer.unreadable.end() ? core::Status() : core::data_error(it->second);
  }

  /// Weights of that name and shape; rows of a vector is 1.
  static core::Result<Eigen::MatrixXd> weights_of(const KerasLayer& layer, const char* role,
                                                  Eigen::Index rows, Eigen::Index columns) {
    RAVENCAL_RETURN_IF_ERROR(check_readable(layer, role));
    const auto it = layer.weights.find(role);
    if (it == layer.weights.end())
      return core::data_error(fmt::format("its {} is not in the file", role));
    if (it->second.rows() != rows || it->second.cols() != columns) {
      return core::data_error(fmt::format("its {} is {} x {} and should be {} x {}", role,
                                          it->second.rows(), it->second.cols(), rows, columns));
    }
    return it->second;
  }

  core::Status take_dense(const KerasLayer& layer) {
    RAVENCAL_ASSIGN_OR_RETURN(const Eigen::MatrixXd kernel,
                              weights_of(layer, "kernel", builder_.width(), layer.units));
    Eigen::VectorXd biases = Eigen::VectorXd::Zero(layer.units);
    if (layer.use_bias) {
      RAVENCAL_ASSIGN_OR_RETURN(const Eigen::MatrixXd bias,
                                weights_of(layer, "bias", 1, layer.units));
      biases = bias.row(0).transpose();
    }
    builder_.dense(kernel.transpose(), &biases);
    return activate(layer.activation);
  }

  core::Status take_gru(const KerasLayer& layer) {
    const std::pair<bool, const char*> refusals[] = {
        {!builder_.is_empty(), "a GRU must be the first layer: its window is one of inputs"},
        {!layer.reset_after,
         "reset_after is false; the weights hold the form with "
         "reset_after=True (Keras' default since 2.4). Train with it"},
        {layer.activation != "tanh" || layer.recurrent_activation != "sigmoid",
         "the weights hold activation='tanh' with recurrent_activation='sigmoid' only"},
        {layer.return_sequences, "return_sequences is true; only the last state goes on"},
        {layer.go_backwards, "go_backwards is true; the window runs forwards only"},
        {layer.stateful, "stateful is true; each window starts from a state of zero"}};
    for (const auto& [refused, why] : refusals) {
      if (refused) return core::data_error(why);
    }
    const Eigen::Index gates = 3 * layer.units;
    RAVENCAL_ASSIGN_OR_RETURN(const Eigen::MatrixXd kernel,
                              weights_of(layer, "kernel", builder_.width(), gates));
    RAVENCAL_ASSIGN_OR_RETURN(const Eigen::MatrixXd recurrent,
                              weights_of(layer, "recurrent_kernel", layer.units, gates));
    Eigen::MatrixXd biases = Eigen::MatrixXd::Zero(2, gates);
    if (layer.use_bias) {
      RAVENCAL_ASSIGN_OR_RETURN(biases, weights_of(layer, "bias", 2, gates));
    }
    is_flat_ = true;
    builder_.gru(kernel.transpose(), biases.row(0).transpose(), recurrent.transpose(),
                 biases.row(1).transpose());
    return {};
  }

  const KerasFile& file_;
  ChainBuilder builder_;
  std::uint32_t window_ = 0;
  bool is_flat_ = true;  ///< rows arrive; else windows of rows
};

}  // namespace

core::Result<ForeignModel> read_keras(const std::string& path) {
  RAVENCAL_ASSIGN_OR_RETURN(KerasFile opened, KerasFile::read(path));
  const auto file = std::make_shared<const KerasFile>(std::move(opened));
  auto network = NetworkReader(*file).read();
  if (!network.ok()) {
    return core::Error{network.error().code, fmt::format("{}: {}", path, network.error().message)};
  }
  ForeignModel model;
  model.origin = fmt::format("Keras {}", file->version);
  model.network = std::move(*network);
  model.run = [file](std::span<const Eigen::MatrixXd> samples) {
    return run_keras(*file, samples);
  };
  return model;
}

}  // namespace ravencal::conversion
