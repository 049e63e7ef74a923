// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <memory>
#include <optional>

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
      fmt::format("activation '{}' is not supported; the weights hold linear, sigmoid, tanh "
                  "and relu. Train the layer with one of these",
                  name));
}

bool passes_values_on(const KerasLayer& layer) {
  return layer.class_name == "InputLayer" || layer.class_name == "Dropout" ||
         layer.class_name == "ActivityRegularization" || layer.class_name == "GaussianNoise";
}

class NetworkReader {
 public:
  explicit NetworkReader(const KerasFile& file) : file_(file) {}

  core::Result<ForeignNetwork> read() && {
    for (std::size_t k = 0; k < file_.layers.size(); ++k) {
      const KerasLayer& layer = file_.layers[k];
      if (window_ == 0 && layer.input_shape.size() == 2) {
        window_ = static_cast<std::uint32_t>(layer.input_shape[0]);
      }
      const core::Status taken = take(layer);
      if (!taken.ok())
        return core::data_error(fmt::format("{}: {}", layer_name(layer, k), taken.error().message));
    }
    if (!builder_) return core::data_error("there is no layer in it");
    RAVENCAL_ASSIGN_OR_RETURN(ForeignNetwork network, std::move(*builder_).finish());
    if (network.has_gru) network.window = window_;
    return network;
  }

 private:
  core::Status take(const KerasLayer& layer) {
    if (passes_values_on(layer)) return {};
    if (layer.class_name == "Dense") return take_dense(layer);
    if (layer.class_name == "GRU") return take_gru(layer);
    if (layer.class_name == "Activation" && builder_) {
      RAVENCAL_ASSIGN_OR_RETURN(const model::Activation activation,
                                activation_of(layer.activation));
      return builder_->activate(activation);
    }
    return core::data_error(
        "not supported; a model may have one GRU, then Dense, Activation and Dropout layers. "
        "Take the layer out and train again, or bring scaling in the file of --scaling");
  }

  /// Weights of that name and shape; rows of a vector is 1.
  static core::Result<Eigen::MatrixXd> weights_of(const KerasLayer& layer, const char* role,
                                                  Eigen::Index rows, Eigen::Index columns) {
    const auto it = layer.weights.find(role);
    if (it == layer.weights.end())
      return core::data_error(fmt::format("its {} is not in the file", role));
    if (it->second.rows() != rows || it->second.cols() != columns) {
      return core::data_error(fmt::format("its {} is {} x {} and should be {} x {}", role,
                                          it->second.rows(), it->second.cols(), rows, columns));
    }
    return it->second;
  }

  /// Values that arrive at the layer: of those before it, or for the first what its kernel takes.
  Eigen::Index width_before(const KerasLayer& layer) {
    if (!builder_) {
      const auto kernel = layer.weights.find("kernel");
      builder_.emplace(kernel == layer.weights.end() ? 0 : kernel->second.rows());
    }
    return builder_->width();
  }

  core::Status take_dense(const KerasLayer& layer) {
    const Eigen::Index width = width_before(layer);
    RAVENCAL_ASSIGN_OR_RETURN(const Eigen::MatrixXd kernel,
                              weights_of(layer, "kernel", width, layer.units));
    Eigen::VectorXd biases = Eigen::VectorXd::Zero(layer.units);
    if (layer.use_bias) {
      RAVENCAL_ASSIGN_OR_RETURN(const Eigen::MatrixXd bias,
                                weights_of(layer, "bias", 1, layer.units));
      biases = bias.row(0).transpose();
    }
    RAVENCAL_ASSIGN_OR_RETURN(const model::Activation activation, activation_of(layer.activation));
    builder_->dense(kernel.transpose(), &biases);
    return builder_->activate(activation);
  }

  core::Status take_gru(const KerasLayer& layer) {
    const std::pair<bool, const char*> refusals[] = {
        {builder_.has_value(), "a GRU must be the first layer: its window is one of inputs"},
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
    const Eigen::Index width = width_before(layer);
    const Eigen::Index gates = 3 * layer.units;
    RAVENCAL_ASSIGN_OR_RETURN(const Eigen::MatrixXd kernel,
                              weights_of(layer, "kernel", width, gates));
    RAVENCAL_ASSIGN_OR_RETURN(const Eigen::MatrixXd recurrent,
                              weights_of(layer, "recurrent_kernel", layer.units, gates));
    Eigen::MatrixXd biases = Eigen::MatrixXd::Zero(2, gates);
    if (layer.use_bias) {
      RAVENCAL_ASSIGN_OR_RETURN(biases, weights_of(layer, "bias", 2, gates));
    }
    builder_->gru(kernel.transpose(), biases.row(0).transpose(), recurrent.transpose(),
                  biases.row(1).transpose());
    return {};
  }

  const KerasFile& file_;
  std::optional<ChainBuilder> builder_;
  std::uint32_t window_ = 0;
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
