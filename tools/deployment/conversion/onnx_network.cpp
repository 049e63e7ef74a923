// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <optional>
#include <set>
#include <span>

#include "conversion/chain_builder.hpp"
#include "conversion/onnx_graph.hpp"

namespace ravencal::conversion {
namespace {

constexpr const char* kKnown =
    "Gemm, MatMul, Add, Sub, Mul, Div, BatchNormalization, Sigmoid, Tanh, Relu, LeakyRelu, PRelu, "
    "Identity, Dropout, Flatten and Reshape of a flat vector, and constants";

/// Follows the one value that goes through the graph.
class ChainReader {
 public:
  explicit ChainReader(const OnnxGraph& graph)
      : graph_(graph), builder_(graph.input_width), value_(graph.input) {}

  core::Result<ForeignNetwork> read() && {
    for (const onnx::NodeProto* node : graph_.steps) {
      where_ = name_of(*node, static_cast<std::size_t>(index_of(*node)));
      RAVENCAL_RETURN_IF_ERROR(take(*node));
      value_ = node->output(0);
      seen_.insert(value_);
    }
    if (value_ != graph_.output) {
      return core::data_error(fmt::format(
          "the graph's output '{}' is not the end of its chain, '{}'", graph_.output, value_));
    }
    return std::move(builder_).finish();
  }

 private:
  [[nodiscard]] int index_of(const onnx::NodeProto& node) const {
    int index = 0;
    for (const onnx::NodeProto& candidate : graph_.proto.graph().node()) {
      if (&candidate == &node) break;
      ++index;
    }
    return index;
  }

  core::Status take(const onnx::NodeProto& node) {
    const std::string& op = node.op_type();
    if (op == "Gemm" || op == "MatMul") return take_product(node);
    if (op == "Add" || op == "Sub" || op == "Mul" || op == "Div") return take_scaling(node);
    if (op == "Sigmoid") return take_activation(node, model::Activation::kSigmoid);
    if (op == "Tanh") return take_activation(node, model::Activation::kTanh);
    if (op == "Relu") return take_activation(node, model::Activation::kRelu);
    if (op == "LeakyRelu" || op == "PRelu") return take_leak(node);
    if (op == "BatchNormalization") return take_normalisation(node);
    if (op == "Identity" || op == "Dropout" || op == "Flatten" || op == "Reshape") {
      return pass_on(node);
    }
    const bool is_recurrent = op == "GRU" || op == "LSTM" || op == "RNN" || op == "Loop";
    return core::data_error(
        fmt::format("{} is not supported; a model may use {}{}", where_, kKnown,
                    is_recurrent ? ". A GRU is read from a Keras model.h5" : ""));
  }

  /// That the chain's value enters the node at one place; the index of the other input, if any.
  core::Result<int> other_input(const onnx::NodeProto& node) const {
    int uses = 0;
    int at = 0;
    for (int i = 0; i < node.input_size(); ++i) {
      if (node.input(i) != value_) continue;
      ++uses;
      at = i;
    }
    if (uses == 1) return 1 - at;
    for (const std::string& input : node.input()) {
      if (seen_.contains(input) || input == graph_.input) {
        return core::data_error(
            fmt::format("{} takes '{}' a second time: the graph branches; a calibration "
                        "model is one chain of layers",
                        where_, input));
      }
    }
    return core::data_error(
        fmt::format("{} does not continue the chain from '{}'", where_, value_));
  }

  core::Result<const OnnxTensor*> constant(const onnx::NodeProto& node, int input) const {
    if (input < 0 || input >= node.input_size()) {
      return core::data_error(
          fmt::format("{} has {} inputs; it takes the chain's value and a constant", where_,
                      node.input_size()));
    }
    const auto it = graph_.constants.find(node.input(input));
    if (it != graph_.constants.end() && !it->second.no_values.empty()) {
      return core::data_error(fmt::format("{}: {}", where_, it->second.no_values));
    }
    if (it != graph_.constants.end()) return &it->second;
    return core::data_error(
        fmt::format("{}: '{}' is not a constant of the file", where_, node.input(input)));
  }

  [[nodiscard]] core::Status here(const core::Status& taken) const {
    return taken.ok() ? taken
                      : core::data_error(fmt::format("{}: {}", where_, taken.error().message));
  }

  /// That the chain's value is the node's first input.
  [[nodiscard]] core::Status enters_first(const onnx::NodeProto& node) const {
    RAVENCAL_ASSIGN_OR_RETURN(const int other, other_input(node));
    if (other == 1) return {};
    return core::data_error(fmt::format(
        "{} takes the chain's value '{}' as a parameter, not as its first input", where_, value_));
  }

  core::Status take_activation(const onnx::NodeProto& node, model::Activation activation) {
    RAVENCAL_RETURN_IF_ERROR(enters_first(node));
    return here(builder_.activate(activation));
  }

  core::Status take_leak(const onnx::NodeProto& node) {
    RAVENCAL_RETURN_IF_ERROR(enters_first(node));
    if (node.op_type() == "LeakyRelu") {
      const auto alpha = static_cast<double>(attribute_or(node, "alpha", kOnnxLeakyAlpha));
      return here(builder_.leak(Eigen::VectorXd::Constant(builder_.width(), alpha)));
    }
    RAVENCAL_ASSIGN_OR_RETURN(const Eigen::VectorXd slopes, parameter(node, 1));
    return here(builder_.leak(slopes));
  }

  core::Status take_normalisation(const onnx::NodeProto& node) {
    RAVENCAL_RETURN_IF_ERROR(enters_first(node));
    if (attribute_or(node, "training_mode", std::int64_t{0}) != 0) {
      return core::data_error(
          fmt::format("{} is in training mode; export the model after model.eval()", where_));
    }
    RAVENCAL_ASSIGN_OR_RETURN(const Eigen::VectorXd scale, parameter(node, 1));
    RAVENCAL_ASSIGN_OR_RETURN(const Eigen::VectorXd offset, parameter(node, 2));
    RAVENCAL_ASSIGN_OR_RETURN(const Eigen::VectorXd mean, parameter(node, 3));
    RAVENCAL_ASSIGN_OR_RETURN(const Eigen::VectorXd variance, parameter(node, 4));
    const auto epsilon = static_cast<double>(attribute_or(node, "epsilon", kOnnxBatchEpsilon));
    return here(builder_.batch_normalise(scale, offset, mean, variance, epsilon));
  }

  /// Takes a node that changes no flat vector outside training.
  core::Status pass_on(const onnx::NodeProto& node) {
    RAVENCAL_RETURN_IF_ERROR(enters_first(node));
    const std::string& op = node.op_type();
    if (op == "Dropout" && node.input_size() > 2 && !node.input(2).empty()) {
      const auto it = graph_.constants.find(node.input(2));
      if (it == graph_.constants.end() || it->second.integers != std::vector<std::int64_t>{0}) {
        return core::data_error(
            fmt::format("{} is in training mode; export the model after model.eval()", where_));
      }
    }
    const std::int64_t axis = attribute_or(node, "axis", std::int64_t{1});
    if (op == "Flatten" && axis != 1 && axis != -1) {
      return core::data_error(fmt::format(
          "{} joins rows (axis {}); only axis 1, which keeps each row, is read", where_, axis));
    }
    return op == "Reshape" ? take_reshape(node) : core::Status();
  }

  /// To [rows, the values that arrive], however the file writes it.
  core::Status take_reshape(const onnx::NodeProto& node) const {
    const auto it =
        node.input_size() == 2 ? graph_.constants.find(node.input(1)) : graph_.constants.end();
    if (it == graph_.constants.end() || it->second.integers.empty()) {
      return core::data_error(
          fmt::format("{}: its shape is not a constant of the file; export it with a constant "
                      "shape [-1, {}], or take it out",
                      where_, builder_.width()));
    }
    const std::vector<std::int64_t>& shape = it->second.integers;
    const bool copies_zero = attribute_or(node, "allowzero", std::int64_t{0}) == 0;
    const auto fits = [&](std::int64_t rows, std::int64_t width) {
      const bool is_same_width = width == builder_.width() || (width == 0 && copies_zero);
      const bool keeps_rows = (rows == 0 && copies_zero) || (rows > 0 && rows == graph_.rows);
      // A fixed single row is a model that was exported with a batch of one.
      return (keeps_rows && (is_same_width || width == -1)) ||
             (is_same_width && (rows == -1 || rows == 1));
    };
    if (shape.size() == 2 && fits(shape[0], shape[1])) return {};
    const std::span<const std::int64_t> shown(shape.data(), std::min<std::size_t>(shape.size(), 8));
    return core::data_error(
        fmt::format("{} gives the shape [{}], and only [-1, {}] keeps the flat vector of {} values "
                    "that arrives; take it out",
                    where_, fmt::join(shown, ", "), builder_.width(), builder_.width()));
  }

  /// A constant input with one value for each of the chain's.
  core::Result<Eigen::VectorXd> parameter(const onnx::NodeProto& node, int input) const {
    RAVENCAL_ASSIGN_OR_RETURN(const OnnxTensor* tensor, constant(node, input));
    return per_value(*tensor, builder_.width());
  }

  /// One value for each of the chain's, from a scalar or a vector.
  core::Result<Eigen::VectorXd> per_value(const OnnxTensor& tensor, Eigen::Index width) const {
    if (tensor.values.size() == 1)
      return Eigen::VectorXd::Constant(width, tensor.values(0, 0)).eval();
    if (tensor.values.rows() == 1 && tensor.values.cols() == width) {
      return Eigen::VectorXd(tensor.values.row(0).transpose());
    }
    return core::data_error(fmt::format("{} has a constant of {} x {} where {} values arrive",
                                        where_, tensor.values.rows(), tensor.values.cols(), width));
  }

  core::Status take_scaling(const onnx::NodeProto& node) {
    RAVENCAL_ASSIGN_OR_RETURN(const int other, other_input(node));
    RAVENCAL_ASSIGN_OR_RETURN(const Eigen::VectorXd values, parameter(node, other));
    const Eigen::Index width = builder_.width();
    const Eigen::VectorXd ones = Eigen::VectorXd::Ones(width);
    const Eigen::VectorXd zeros = Eigen::VectorXd::Zero(width);
    const std::string& op = node.op_type();
    if (op == "Add") {
      builder_.scale(ones, values);
    } else if (op == "Mul") {
      builder_.scale(values, zeros);
    } else if (op == "Sub") {
      other == 1 ? builder_.scale(ones, -values) : builder_.scale(-ones, values);
    } else if (other == 0) {
      return core::data_error(fmt::format(
          "{} divides a constant by the chain's value, which no layer can hold", where_));
    } else if ((values.array() == 0.0).any()) {
      return core::data_error(
          fmt::format("{} divides by 0; a constant input needs the scale 1", where_));
    } else {
      builder_.scale(values.cwiseInverse(), zeros);
    }
    return {};
  }

  core::Status take_product(const onnx::NodeProto& node) {
    const bool is_gemm = node.op_type() == "Gemm";
    const bool transposed = attribute_or(node, "transB", std::int64_t{0}) != 0;
    RAVENCAL_ASSIGN_OR_RETURN(const int other, other_input(node));
    if (other != 1 || attribute_or(node, "transA", std::int64_t{0}) != 0) {
      return core::data_error(
          fmt::format("{} multiplies from the left; rows of inputs are [rows, features] "
                      "times a constant",
                      where_));
    }
    RAVENCAL_ASSIGN_OR_RETURN(const OnnxTensor* factor, constant(node, 1));
    const auto alpha = static_cast<double>(attribute_or(node, "alpha", 1.0F));
    const auto beta = static_cast<double>(attribute_or(node, "beta", 1.0F));
    Eigen::MatrixXd weights = alpha * factor->values;
    if (!transposed) weights.transposeInPlace();
    if (factor->rank != 2 || weights.cols() != builder_.width()) {
      return core::data_error(fmt::format("{} has weights for {} inputs where {} arrive", where_,
                                          weights.cols(), builder_.width()));
    }
    if (is_gemm && node.input_size() > 2 && !node.input(2).empty()) {
      RAVENCAL_ASSIGN_OR_RETURN(const OnnxTensor* addend, constant(node, 2));
      RAVENCAL_ASSIGN_OR_RETURN(Eigen::VectorXd biases, per_value(*addend, weights.rows()));
      biases *= beta;
      builder_.dense(weights, &biases);
    } else {
      builder_.dense(weights, nullptr);
    }
    return {};
  }

  const OnnxGraph& graph_;
  ChainBuilder builder_;
  std::string value_;
  std::string where_;
  std::set<std::string> seen_;
};

}  // namespace

core::Result<ForeignModel> read_foreign_onnx(const std::string& path) {
  RAVENCAL_ASSIGN_OR_RETURN(const std::shared_ptr<const OnnxGraph> graph, OnnxGraph::read(path));
  auto network = ChainReader(*graph).read();
  if (!network.ok()) {
    return core::Error{network.error().code, fmt::format("{}: {}", path, network.error().message)};
  }
  ForeignModel model;
  const auto& proto = graph->proto;
  model.origin = fmt::format("{} {}, ONNX opset {}",
                             proto.producer_name().empty() ? "unknown" : proto.producer_name(),
                             proto.producer_version(), graph->opset);
  model.network = std::move(*network);
  model.run = [graph](std::span<const Eigen::MatrixXd> samples) {
    return run_onnx(*graph, samples.back());
  };
  return model;
}

}  // namespace ravencal::conversion
