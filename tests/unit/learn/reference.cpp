// SPDX-License-Identifier: Apache-2.0
#include "unit/learn/reference.hpp"

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

namespace ravencal::learn {
namespace {

using Json = nlohmann::json;

/// Rows of samples to columns.
Eigen::MatrixXd columns_of(const Json& rows) {
  Eigen::MatrixXd matrix(rows[0].size(), rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    for (std::size_t k = 0; k < rows[i].size(); ++k) {
      matrix(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(i)) = rows[i][k];
    }
  }
  return matrix;
}

/// The reference keeps weights as [inputs][outputs] per layer.
std::vector<double> flattened(const Shape& shape, const Json& weights, const Json& biases) {
  std::vector<double> parameters(static_cast<std::size_t>(shape.parameter_count()), 0.0);
  for (std::size_t k = 0; k < shape.layers().size(); ++k) {
    const LayerShape& layer = shape.layers()[k];
    for (std::ptrdiff_t out = 0; out < layer.outputs; ++out) {
      const auto o = static_cast<std::size_t>(out);
      parameters[static_cast<std::size_t>(layer.biases + out)] = biases[k][o];
      for (std::ptrdiff_t in = 0; in < layer.inputs; ++in) {
        parameters[static_cast<std::size_t>(layer.weights + in * layer.outputs + out)] =
            weights[k][static_cast<std::size_t>(in)][o];
      }
    }
  }
  return parameters;
}

}  // namespace

std::optional<Reference> load_reference() {
  const std::filesystem::path path =
      std::filesystem::path(RAVENCAL_REFERENCE_DIR) / "mlp_reference.json";
  std::ifstream file(path);
  if (!file) return std::nullopt;
  const Json j = Json::parse(file);
  Reference reference;
  const auto sizes = j["sizes"].get<std::vector<std::uint32_t>>();
  reference.shape =
      Shape(sizes.front(), std::vector<std::uint32_t>(sizes.begin() + 1, sizes.end() - 1),
            sizes.back(), model::Activation::kSigmoid);
  reference.settings.batch = j["batch"];
  reference.settings.adam = {j["lr"], j["beta1"], j["beta2"], j["epsilon"]};
  reference.settings.penalties = {j["l1"], j["l2"], j["l2_bias"], j["l2_activity"]};
  reference.samples = {columns_of(j["inputs"]), columns_of(j["targets"])};
  reference.parameters = flattened(reference.shape, j["weights"], j["biases"]);
  reference.gradient = flattened(reference.shape, j["weight_gradients"], j["bias_gradients"]);
  reference.parameters_after_10 =
      flattened(reference.shape, j["weights_after_10"], j["biases_after_10"]);
  reference.mean_squared_error = j["mse"];
  reference.penalty = j["regularisation"];
  return reference;
}

}  // namespace ravencal::learn
