// SPDX-License-Identifier: Apache-2.0
#include "conversion/onnx_graph.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <fstream>

#include "conversion/foreign_model.hpp"

namespace ravencal::conversion {
namespace {

constexpr std::int64_t kLargestTensorSide = 1 << 20;  // far above any network for a 1 kHz loop

template <typename T>
using RowWise = Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Empty where the file holds another number of values than the shape; then nothing is allocated.
template <typename T>
RowWise<T> stored(const std::string& raw, const auto& fields, Eigen::Index rows,
                  Eigen::Index columns) {
  const auto count = static_cast<std::size_t>(rows * columns);
  const bool is_raw = raw.size() == count * sizeof(T);
  if (!is_raw && static_cast<std::size_t>(fields.size()) != count) return {};
  RowWise<T> values(rows, columns);
  if (is_raw) {
    std::memcpy(values.data(), raw.data(), raw.size());
  } else {
    std::copy(fields.begin(), fields.end(), values.data());
  }
  return values;
}

std::vector<std::int64_t> integers_of(const onnx::TensorProto& proto, Eigen::Index rows,
                                      Eigen::Index columns) {
  const auto list = [](const auto& values) {
    return std::vector<std::int64_t>(values.data(), values.data() + values.size());
  };
  switch (proto.data_type()) {
    case onnx::TensorProto::INT64:
      return list(stored<std::int64_t>(proto.raw_data(), proto.int64_data(), rows, columns));
    case onnx::TensorProto::INT32:
      return list(stored<std::int32_t>(proto.raw_data(), proto.int32_data(), rows, columns));
    case onnx::TensorProto::BOOL:
      return list(stored<std::uint8_t>(proto.raw_data(), proto.int32_data(), rows, columns));
    default:
      return {};
  }
}

core::Status fill_values(const onnx::TensorProto& proto, const std::string& name,
                         OnnxTensor& tensor) {
  if (proto.data_location() == onnx::TensorProto::EXTERNAL) {
    return core::data_error(
        fmt::format("tensor '{}' lies in another file; export the model into one file "
                    "(PyTorch: external_data=False)",
                    name));
  }
  if (proto.dims_size() > 2) {
    return core::data_error(
        fmt::format("tensor '{}' has {} dimensions; a chain of dense layers has at most 2", name,
                    proto.dims_size()));
  }
  tensor.rank = proto.dims_size();
  const std::int64_t rows = tensor.rank == 2 ? proto.dims(0) : 1;
  const std::int64_t columns = tensor.rank >= 1 ? proto.dims(tensor.rank - 1) : 1;
  if (rows < 1 || columns < 1 || rows > kLargestTensorSide || columns > kLargestTensorSide) {
    return core::data_error(fmt::format("tensor '{}' has shape {} x {}", name, rows, columns));
  }
  if (proto.data_type() == onnx::TensorProto::FLOAT) {
    tensor.values =
        stored<float>(proto.raw_data(), proto.float_data(), rows, columns).cast<double>();
  } else if (proto.data_type() == onnx::TensorProto::DOUBLE) {
    tensor.values = stored<double>(proto.raw_data(), proto.double_data(), rows, columns);
  } else {
    tensor.integers = integers_of(proto, rows, columns);
    return core::data_error(
        fmt::format("tensor '{}' has elements of type {}; export the model in float32", name,
                    onnx::TensorProto::DataType_Name(proto.data_type())));
  }
  if (tensor.values.size() == 0)
    return core::data_error(
        fmt::format("tensor '{}' does not hold its {} values", name, rows * columns));
  if (!tensor.values.allFinite()) {
    return core::data_error(fmt::format("tensor '{}' has a value that is not finite", name));
  }
  return {};
}

/// Many a file holds tensors that no step needs: those may be anything.
OnnxTensor tensor_of(const onnx::TensorProto& proto, const std::string& name) {
  OnnxTensor tensor;
  const core::Status filled = fill_values(proto, name, tensor);
  if (!filled.ok()) tensor.no_values = filled.error().message;
  return tensor;
}

OnnxTensor constant_of(const onnx::NodeProto& node) {
  OnnxTensor tensor;
  for (const onnx::AttributeProto& attribute : node.attribute()) {
    if (attribute.name() == "value") return tensor_of(attribute.t(), node.output(0));
    if (attribute.name() == "value_float") {
      return {0, Eigen::MatrixXd::Constant(1, 1, static_cast<double>(attribute.f())), {}, {}};
    }
    if (attribute.name() == "value_floats") {
      tensor.rank = 1;
      tensor.values.resize(1, attribute.floats_size());
      for (int i = 0; i < attribute.floats_size(); ++i) {
        tensor.values(0, i) = static_cast<double>(attribute.floats(i));
      }
      return tensor;
    }
    if (attribute.name() == "value_ints") {
      tensor.integers.assign(attribute.ints().begin(), attribute.ints().end());
    }
  }
  tensor.no_values = fmt::format("constant '{}' holds no float tensor", node.output(0));
  return tensor;
}

/// Dropout may name its mask, which no step takes outside training.
core::Status check_outputs(const onnx::GraphProto& graph, const onnx::NodeProto& node,
                           std::size_t index) {
  const auto is_taken = [&](const std::string& name) {
    const auto takes = [&](const onnx::NodeProto& other) {
      return std::count(other.input().begin(), other.input().end(), name) > 0;
    };
    return std::any_of(graph.node().begin(), graph.node().end(), takes) ||
           std::any_of(graph.output().begin(), graph.output().end(),
                       [&](const auto& output) { return output.name() == name; });
  };
  const bool may_have_mask = node.op_type() == "Dropout" && node.output_size() == 2;
  if (node.output_size() == 1 || (may_have_mask && !is_taken(node.output(1)))) return {};
  return core::data_error(
      fmt::format("{} has {} outputs; a chain of dense layers has one each{}", name_of(node, index),
                  node.output_size(),
                  node.op_type() == "BatchNormalization"
                      ? ". It is in training mode: export the model after model.eval()"
                      : ""));
}

core::Status sort_nodes(OnnxGraph& graph) {
  const onnx::GraphProto& proto = graph.proto.graph();
  for (const onnx::TensorProto& tensor : proto.initializer()) {
    graph.constants[tensor.name()] = tensor_of(tensor, tensor.name());
  }
  for (int i = 0; i < proto.node_size(); ++i) {
    const onnx::NodeProto& node = proto.node(i);
    if (!node.domain().empty() && node.domain() != "ai.onnx") {
      return core::data_error(
          fmt::format("{} comes from domain '{}'; only standard operators are read",
                      name_of(node, static_cast<std::size_t>(i)), node.domain()));
    }
    RAVENCAL_RETURN_IF_ERROR(check_outputs(proto, node, static_cast<std::size_t>(i)));
    const auto source =
        node.input_size() == 1 ? graph.constants.find(node.input(0)) : graph.constants.end();
    if (node.op_type() == "Constant") {
      graph.constants[node.output(0)] = constant_of(node);
    } else if (node.op_type() == "Identity" && source != graph.constants.end()) {
      graph.constants[node.output(0)] = OnnxTensor(source->second);
    } else {
      graph.steps.push_back(&node);
    }
  }
  return {};
}

core::Status find_ends(OnnxGraph& graph) {
  const onnx::GraphProto& proto = graph.proto.graph();
  const onnx::ValueInfoProto* input = nullptr;
  for (const onnx::ValueInfoProto& candidate : proto.input()) {
    if (graph.constants.contains(candidate.name())) continue;  // old files list initialisers, too
    if (input != nullptr) {
      return core::data_error(
          fmt::format("the graph has the inputs '{}' and '{}'; a calibration model has one",
                      input->name(), candidate.name()));
    }
    input = &candidate;
  }
  if (input == nullptr || proto.output_size() != 1) {
    return core::data_error(
        fmt::format("the graph has {} inputs and {} outputs; a calibration model has one of each",
                    input == nullptr ? 0 : 1, proto.output_size()));
  }
  const auto& shape = input->type().tensor_type().shape();
  if (shape.dim_size() != 2 || shape.dim(1).dim_value() < 1) {
    return core::data_error(
        fmt::format("input '{}' is not [rows, features] with a fixed number of features; "
                    "export the model with a sample input of that shape, of which only the "
                    "rows may be dynamic",
                    input->name()));
  }
  graph.input = input->name();
  graph.input_width = shape.dim(1).dim_value();
  graph.rows = shape.dim(0).dim_value();
  graph.output = proto.output(0).name();
  return {};
}

core::Status fill(OnnxGraph& graph) {
  for (const auto& import : graph.proto.opset_import()) {
    if (import.domain().empty() || import.domain() == "ai.onnx") graph.opset = import.version();
  }
  if (graph.opset < kOldestOpset || graph.opset > kNewestOpset) {
    return core::data_error(
        fmt::format("opset {} is not one of {} to {}; export the model with one of these",
                    graph.opset, kOldestOpset, kNewestOpset));
  }
  RAVENCAL_RETURN_IF_ERROR(sort_nodes(graph));
  return find_ends(graph);
}

const onnx::AttributeProto* find_attribute(const onnx::NodeProto& node, const char* name) {
  for (const onnx::AttributeProto& attribute : node.attribute()) {
    if (attribute.name() == name) return &attribute;
  }
  return nullptr;
}

}  // namespace

std::string name_of(const onnx::NodeProto& node, std::size_t index) {
  return fmt::format("node {} '{}' (operator {})", index, node.name(), node.op_type());
}

float attribute_or(const onnx::NodeProto& node, const char* name, float otherwise) {
  const auto* attribute = find_attribute(node, name);
  return attribute == nullptr ? otherwise : attribute->f();
}

std::int64_t attribute_or(const onnx::NodeProto& node, const char* name, std::int64_t otherwise) {
  const auto* attribute = find_attribute(node, name);
  return attribute == nullptr ? otherwise : attribute->i();
}

core::Result<std::shared_ptr<const OnnxGraph>> OnnxGraph::read(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) return core::Error{core::ErrorCode::kIo, fmt::format("{}: cannot be opened", path)};
  auto graph = std::make_shared<OnnxGraph>();
  if (!graph->proto.ParseFromIstream(&file) || !graph->proto.has_graph()) {
    return core::data_error(fmt::format("{}: is not an ONNX file, or a damaged one", path));
  }
  const core::Status filled = fill(*graph);
  if (!filled.ok()) return core::data_error(fmt::format("{}: {}", path, filled.error().message));
  return std::shared_ptr<const OnnxGraph>(std::move(graph));
}

}  // namespace ravencal::conversion
