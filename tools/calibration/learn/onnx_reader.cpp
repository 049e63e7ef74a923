// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <onnx/onnx_pb.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <optional>

#include "learn/onnx_file.hpp"
#include "learn/onnx_metadata.hpp"
#include "model/scaled_inputs.hpp"

namespace ravencal::learn {
namespace {

using RowMajor = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

constexpr const char* kChain =
    "a calibration model is Max, Min, Sub, Mul, Gemm with Sigmoid, Tanh or Relu, Mul, Add";

/// Walks the one chain that a calibration model is: Max, Min, Sub, Mul, (Gemm, activation?)+, Mul,
/// Add. Older files lack Max and Min.
class GraphReader {
 public:
  explicit GraphReader(const onnx::GraphProto& graph) : graph_(graph) {}

  core::Status read(model::CalibrationModel& model) {
    if (graph_.input_size() < 1 || graph_.input(0).name() != "features") {
      return core::data_error("the graph has no input 'features'");
    }
    value_ = "features";
    if (next_is("Max")) {
      const model::ClampedRange range = model::clamped_range(model);
      RAVENCAL_RETURN_IF_ERROR(read_scaling("Max", "input_min and input_max", range.low));
      RAVENCAL_RETURN_IF_ERROR(read_scaling("Min", "input_min and input_max", range.high));
    }
    const Eigen::VectorXf inverse_scale = model.input.scale.cwiseInverse().cast<float>();
    RAVENCAL_RETURN_IF_ERROR(read_scaling("Sub", "input_mean", model.input.mean.cast<float>()));
    RAVENCAL_RETURN_IF_ERROR(read_scaling("Mul", "input_scale", inverse_scale));
    auto width = static_cast<Eigen::Index>(model.features.size());
    while (next_is("Gemm")) {
      RAVENCAL_ASSIGN_OR_RETURN(model::DenseLayer layer, read_layer(width));
      width = layer.weights.rows();
      model.layers.push_back(std::move(layer));
    }
    if (model.layers.empty() || !next_is("Mul")) {
      return core::data_error(
          fmt::format("after {} layer(s) there is {}; {}", model.layers.size(), here(), kChain));
    }
    if (model.layers.back().activation != model::Activation::kLinear) {
      return core::data_error("the last layer is not linear");
    }
    if (width != static_cast<Eigen::Index>(model.outputs.size())) {
      return core::data_error(fmt::format("the last layer has {} outputs, the metadata {}", width,
                                          model.outputs.size()));
    }
    RAVENCAL_RETURN_IF_ERROR(read_scaling("Mul", "output_scale", model.output.scale.cast<float>()));
    RAVENCAL_RETURN_IF_ERROR(read_scaling("Add", "output_mean", model.output.mean.cast<float>()));
    if (next_ != graph_.node_size())
      return core::data_error(fmt::format("after the last step there is {}", here()));
    if (graph_.output_size() != 1 || graph_.output(0).name() != value_) {
      return core::data_error(fmt::format("the graph's output is not '{}'", value_));
    }
    return {};
  }

 private:
  [[nodiscard]] bool next_is(const std::string& op) const {
    return next_ < graph_.node_size() && graph_.node(next_).op_type() == op;
  }

  /// The node that is next, for a message.
  [[nodiscard]] std::string here() const {
    if (next_ >= graph_.node_size()) return "the end of the graph";
    const onnx::NodeProto& node = graph_.node(next_);
    return fmt::format("node {} '{}' with operator {}", next_, node.name(), node.op_type());
  }

  /// Takes the next node, which must be `op`, have `inputs` inputs and continue the chain.
  core::Result<const onnx::NodeProto*> take(const std::string& op, int inputs) {
    if (!next_is(op)) {
      return core::data_error(
          fmt::format("expected operator {}, found {}; {}", op, here(), kChain));
    }
    const onnx::NodeProto& node = graph_.node(next_);
    if (node.input_size() != inputs || node.output_size() != 1 || node.input(0) != value_) {
      return core::data_error(
          fmt::format("{} does not continue the chain from '{}'", here(), value_));
    }
    value_ = node.output(0);
    ++next_;
    return &node;
  }

  core::Result<RowMajor> tensor(const std::string& name, int rank) const {
    for (const onnx::TensorProto& candidate : graph_.initializer()) {
      if (candidate.name() == name) return values_of(candidate, rank);
    }
    return core::data_error(fmt::format("'{}' is not a constant of the graph", name));
  }

  /// A vector is one row.
  static core::Result<RowMajor> values_of(const onnx::TensorProto& tensor, int rank) {
    if (tensor.data_type() != onnx::TensorProto::FLOAT || tensor.dims_size() != rank ||
        tensor.data_location() == onnx::TensorProto::EXTERNAL) {
      return core::data_error(fmt::format(
          "tensor '{}' is not a float32 tensor of rank {} inside the file", tensor.name(), rank));
    }
    constexpr std::int64_t kLargest = 1 << 20;  // far above any network for a 1 kHz loop
    const std::int64_t rows = rank == 2 ? tensor.dims(0) : 1;
    const std::int64_t columns = tensor.dims(rank - 1);
    if (rows < 1 || columns < 1 || rows > kLargest || columns > kLargest) {
      return core::data_error(
          fmt::format("tensor '{}' has shape {} x {}", tensor.name(), rows, columns));
    }
    const auto count = static_cast<std::size_t>(rows * columns);
    const bool raw = tensor.raw_data().size() == count * sizeof(float);
    if (!raw && static_cast<std::size_t>(tensor.float_data_size()) != count) {
      return core::data_error(
          fmt::format("tensor '{}' does not hold its {} values", tensor.name(), count));
    }
    RowMajor values(rows, columns);
    const void* source = raw ? static_cast<const void*>(tensor.raw_data().data())
                             : static_cast<const void*>(tensor.float_data().data());
    std::memcpy(values.data(), source, count * sizeof(float));
    if (!values.allFinite()) {
      return core::data_error(
          fmt::format("tensor '{}' has a value that is not finite", tensor.name()));
    }
    return values;
  }

  /// A scaling step must be what the metadata says.
  core::Status read_scaling(const std::string& op, std::string_view what,
                            const Eigen::VectorXf& expected) {
    RAVENCAL_ASSIGN_OR_RETURN(const onnx::NodeProto* node, take(op, 2));
    RAVENCAL_ASSIGN_OR_RETURN(const RowMajor values, tensor(node->input(1), 1));
    if (values.size() != expected.size() || !values.row(0).transpose().isApprox(expected, 1e-6F)) {
      return core::data_error(
          fmt::format("node '{}' contradicts the metadata's {}", node->name(), what));
    }
    return {};
  }

  core::Result<model::DenseLayer> read_layer(Eigen::Index inputs) {
    RAVENCAL_ASSIGN_OR_RETURN(const onnx::NodeProto* node, take("Gemm", 3));
    bool transposed = false;
    for (const onnx::AttributeProto& attribute : node->attribute()) {
      const bool one =
          (attribute.name() == "alpha" || attribute.name() == "beta") && attribute.f() == 1.0F;
      const bool plain = attribute.name() == "transA" && attribute.i() == 0;
      if (attribute.name() == "transB") {
        transposed = attribute.i() != 0;
      } else if (!one && !plain) {
        return core::data_error(fmt::format("Gemm '{}' has an attribute {} that is not supported",
                                            node->name(), attribute.name()));
      }
    }
    RAVENCAL_ASSIGN_OR_RETURN(RowMajor weights, tensor(node->input(1), 2));
    if (!transposed) weights = RowMajor(weights.transpose());
    RAVENCAL_ASSIGN_OR_RETURN(const RowMajor biases, tensor(node->input(2), 1));
    if (weights.cols() != inputs || biases.cols() != weights.rows()) {
      return core::data_error(
          fmt::format("Gemm '{}' has weights {} x {} and {} biases where {} inputs arrive",
                      node->name(), weights.rows(), weights.cols(), biases.cols(), inputs));
    }
    model::DenseLayer layer;
    layer.weights = weights;
    layer.biases = biases.row(0).transpose();
    layer.activation = model::Activation::kLinear;
    constexpr std::pair<const char*, model::Activation> kActivations[] = {
        {"Sigmoid", model::Activation::kSigmoid},
        {"Tanh", model::Activation::kTanh},
        {"Relu", model::Activation::kRelu}};
    for (const auto& [op, activation] : kActivations) {
      if (!next_is(op)) continue;
      RAVENCAL_ASSIGN_OR_RETURN([[maybe_unused]] const onnx::NodeProto* taken, take(op, 1));
      layer.activation = activation;
      break;
    }
    return layer;
  }

  const onnx::GraphProto& graph_;
  int next_ = 0;
  std::string value_;
};

core::Result<model::CalibrationModel> from_proto(const onnx::ModelProto& proto) {
  Metadata metadata;
  for (const auto& property : proto.metadata_props()) metadata[property.key()] = property.value();
  RAVENCAL_ASSIGN_OR_RETURN(model::CalibrationModel model, model_from_metadata(metadata));
  RAVENCAL_RETURN_IF_ERROR(GraphReader(proto.graph()).read(model));
  return model;
}

core::Result<onnx::ModelProto> parse(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file || std::filesystem::is_directory(path)) {
    return core::Error{core::ErrorCode::kIo, fmt::format("{}: cannot be opened", path.string())};
  }
  onnx::ModelProto proto;
  if (!proto.ParseFromIstream(&file) || !proto.has_graph()) {
    return core::data_error(
        fmt::format("{}: is not an ONNX file, or a damaged one", path.string()));
  }
  return proto;
}

}  // namespace

core::Result<bool> is_ravencal_onnx(const std::filesystem::path& path) {
  RAVENCAL_ASSIGN_OR_RETURN(const onnx::ModelProto proto, parse(path));
  return std::any_of(proto.metadata_props().begin(), proto.metadata_props().end(),
                     [](const auto& property) { return property.key().starts_with("ravencal."); });
}

core::Result<model::CalibrationModel> read_onnx(const std::filesystem::path& path) {
  RAVENCAL_ASSIGN_OR_RETURN(const onnx::ModelProto proto, parse(path));
  auto model = from_proto(proto);
  if (!model.ok())
    return core::data_error(fmt::format("{}: {}", path.string(), model.error().message));
  return model;
}

}  // namespace ravencal::learn
