// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <onnx/onnx_pb.h>

#include <initializer_list>

#include "core/version.hpp"
#include "core/whole_file.hpp"
#include "learn/onnx_file.hpp"
#include "learn/onnx_metadata.hpp"
#include "model/scaled_inputs.hpp"

namespace ravencal::learn {
namespace {

constexpr int kIrVersion = 7;  ///< the first that knows opset 13
constexpr int kOpset = 13;
constexpr const char* kBatchDimension = "N";

using RowMajor = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

void declare(onnx::ValueInfoProto& info, const std::string& name, Eigen::Index width) {
  info.set_name(name);
  auto* type = info.mutable_type()->mutable_tensor_type();
  type->set_elem_type(onnx::TensorProto::FLOAT);
  type->mutable_shape()->add_dim()->set_dim_param(kBatchDimension);
  type->mutable_shape()->add_dim()->set_dim_value(width);
}

class GraphWriter {
 public:
  explicit GraphWriter(onnx::GraphProto& graph) : graph_(graph) {}

  std::string add_vector(const std::string& name, const Eigen::VectorXf& values) {
    return add_tensor(name, {values.size()}, values.data(), values.size());
  }

  std::string add_matrix(const std::string& name, const RowMajor& values) {
    return add_tensor(name, {values.rows(), values.cols()}, values.data(), values.size());
  }

  /// Appends a node; returns its output, named after it.
  std::string add_node(const std::string& op, std::initializer_list<std::string> inputs,
                       const std::string& output) {
    onnx::NodeProto* node = graph_.add_node();
    node->set_op_type(op);
    node->set_name(output);
    for (const std::string& input : inputs) node->add_input(input);
    node->add_output(output);
    if (op == "Gemm") {
      onnx::AttributeProto* attribute = node->add_attribute();
      attribute->set_name("transB");
      attribute->set_type(onnx::AttributeProto::INT);
      attribute->set_i(1);
    }
    return output;
  }

 private:
  std::string add_tensor(const std::string& name, std::initializer_list<Eigen::Index> dims,
                         const float* values, Eigen::Index count) {
    onnx::TensorProto* tensor = graph_.add_initializer();
    tensor->set_name(name);
    tensor->set_data_type(onnx::TensorProto::FLOAT);
    for (const Eigen::Index dim : dims) tensor->add_dims(dim);
    tensor->set_raw_data(values, static_cast<std::size_t>(count) * sizeof(float));
    return name;
  }

  onnx::GraphProto& graph_;
};

const char* op_of(model::Activation activation) {
  switch (activation) {
    case model::Activation::kSigmoid:
      return "Sigmoid";
    case model::Activation::kTanh:
      return "Tanh";
    case model::Activation::kRelu:
      return "Relu";
    case model::Activation::kLinear:
      break;
  }
  return nullptr;
}

onnx::ModelProto to_proto(const model::CalibrationModel& model) {
  onnx::ModelProto proto;
  proto.set_ir_version(kIrVersion);
  proto.set_producer_name("ravencal");
  proto.set_producer_version(core::kVersion);
  proto.add_opset_import()->set_version(kOpset);
  for (const auto& [key, value] : metadata_of(model)) {
    auto* property = proto.add_metadata_props();
    property->set_key(key);
    property->set_value(value);
  }
  onnx::GraphProto& graph = *proto.mutable_graph();
  graph.set_name("calibration");
  declare(*graph.add_input(), "features", model.input.mean.size());
  declare(*graph.add_output(), "joint_error", model.output.mean.size());

  GraphWriter writer(graph);
  std::string value = "features";
  if (const model::ClampedRange range = model::clamped_range(model); range.low.size() > 0) {
    writer.add_vector("input_lowest", range.low);
    writer.add_vector("input_highest", range.high);
    value = writer.add_node("Max", {value, "input_lowest"}, "not_below");
    value = writer.add_node("Min", {value, "input_highest"}, "clamped");
  }
  writer.add_vector("input_mean", model.input.mean.cast<float>());
  writer.add_vector("input_inverse_scale", model.input.scale.cwiseInverse().cast<float>());
  value = writer.add_node("Sub", {value, "input_mean"}, "centred");
  value = writer.add_node("Mul", {value, "input_inverse_scale"}, "scaled");
  for (std::size_t k = 0; k < model.layers.size(); ++k) {
    const model::DenseLayer& layer = model.layers[k];
    const std::string weights = writer.add_matrix(fmt::format("weights_{}", k), layer.weights);
    const std::string biases = writer.add_vector(fmt::format("biases_{}", k), layer.biases);
    value = writer.add_node("Gemm", {value, weights, biases}, fmt::format("sums_{}", k));
    if (const char* op = op_of(layer.activation)) {
      value = writer.add_node(op, {value}, fmt::format("values_{}", k));
    }
  }
  writer.add_vector("output_scale", model.output.scale.cast<float>());
  writer.add_vector("output_mean", model.output.mean.cast<float>());
  value = writer.add_node("Mul", {value, "output_scale"}, "unscaled");
  writer.add_node("Add", {value, "output_mean"}, "joint_error");
  return proto;
}

}  // namespace

core::Status write_onnx(const model::CalibrationModel& model, const std::filesystem::path& path) {
  return core::write_whole_file(path, to_proto(model).SerializeAsString());
}

}  // namespace ravencal::learn
