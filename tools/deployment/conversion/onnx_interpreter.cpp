// SPDX-License-Identifier: Apache-2.0
//
// Runs a graph operator by operator in double, as the ONNX specification defines each of them: the
// reference for a folded chain, so it shares no arithmetic with the folding.
#include <fmt/format.h>

#include <cmath>

#include "conversion/onnx_graph.hpp"

namespace ravencal::conversion {
namespace {

/// Element of a matrix that is repeated along each dimension of size 1.
double repeated(const Eigen::MatrixXd& values, Eigen::Index row, Eigen::Index column) {
  return values(values.rows() == 1 ? 0 : row, values.cols() == 1 ? 0 : column);
}

template <typename Operation>
core::Result<Eigen::MatrixXd> element_wise(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b,
                                           Operation operation) {
  const Eigen::Index rows = std::max(a.rows(), b.rows());
  const Eigen::Index columns = std::max(a.cols(), b.cols());
  for (const Eigen::MatrixXd* matrix : {&a, &b}) {
    if ((matrix->rows() != 1 && matrix->rows() != rows) ||
        (matrix->cols() != 1 && matrix->cols() != columns)) {
      return core::data_error("shapes that do not match");
    }
  }
  Eigen::MatrixXd result(rows, columns);
  for (Eigen::Index column = 0; column < columns; ++column) {
    for (Eigen::Index row = 0; row < rows; ++row) {
      result(row, column) = operation(repeated(a, row, column), repeated(b, row, column));
    }
  }
  return result;
}

core::Result<Eigen::MatrixXd> gemm(const onnx::NodeProto& node, const Eigen::MatrixXd& a,
                                   const Eigen::MatrixXd& b, const Eigen::MatrixXd* c) {
  const bool trans_a = attribute_or(node, "transA", std::int64_t{0}) != 0;
  const bool trans_b = attribute_or(node, "transB", std::int64_t{0}) != 0;
  const Eigen::MatrixXd left = trans_a ? Eigen::MatrixXd(a.transpose()) : a;
  const Eigen::MatrixXd right = trans_b ? Eigen::MatrixXd(b.transpose()) : b;
  if (left.cols() != right.rows()) return core::data_error("factors that do not go together");
  const auto alpha = static_cast<double>(attribute_or(node, "alpha", 1.0F));
  const auto beta = static_cast<double>(attribute_or(node, "beta", 1.0F));
  const Eigen::MatrixXd product = alpha * (left * right);
  if (c == nullptr) return product;
  return element_wise(product, *c, [beta](double x, double y) { return x + beta * y; });
}

/// (x - mean) / sqrt(variance + epsilon) * scale + offset.
core::Result<Eigen::MatrixXd> normalised(const onnx::NodeProto& node,
                                         const std::vector<const Eigen::MatrixXd*>& in) {
  const auto epsilon = static_cast<double>(attribute_or(node, "epsilon", kOnnxBatchEpsilon));
  RAVENCAL_ASSIGN_OR_RETURN(const Eigen::MatrixXd centred,
                            element_wise(*in[0], *in[3], std::minus<>()));
  RAVENCAL_ASSIGN_OR_RETURN(const Eigen::MatrixXd unit,
                            element_wise(centred, *in[4], [epsilon](double x, double variance) {
                              return x / std::sqrt(variance + epsilon);
                            }));
  RAVENCAL_ASSIGN_OR_RETURN(const Eigen::MatrixXd scaled,
                            element_wise(unit, *in[1], std::multiplies<>()));
  return element_wise(scaled, *in[2], std::plus<>());
}

double leaked(double x, double slope) { return x < 0.0 ? slope * x : x; }

core::Result<Eigen::MatrixXd> run(const onnx::NodeProto& node,
                                  const std::vector<const Eigen::MatrixXd*>& in) {
  const std::string& op = node.op_type();
  const auto unary = [&](auto function) { return Eigen::MatrixXd(in[0]->unaryExpr(function)); };
  if (op == "Identity" || op == "Dropout" || op == "Flatten" || op == "Reshape") {
    return Eigen::MatrixXd(*in[0]);  // the reader took those only that keep a flat vector
  }
  if (op == "BatchNormalization" && in.size() == 5) return normalised(node, in);
  if (in.size() == 1) {
    if (op == "Sigmoid") return unary([](double x) { return 1.0 / (1.0 + std::exp(-x)); });
    if (op == "Tanh") return unary([](double x) { return std::tanh(x); });
    if (op == "Relu") return unary([](double x) { return x > 0.0 ? x : 0.0; });
    if (op == "LeakyRelu") {
      const auto alpha = static_cast<double>(attribute_or(node, "alpha", kOnnxLeakyAlpha));
      return unary([alpha](double x) { return leaked(x, alpha); });
    }
  }
  if (op == "Gemm" && (in.size() == 2 || in.size() == 3)) {
    return gemm(node, *in[0], *in[1], in.size() == 3 ? in[2] : nullptr);
  }
  if (in.size() == 2) {
    if (op == "MatMul") {
      if (in[0]->cols() != in[1]->rows())
        return core::data_error("factors that do not go together");
      return Eigen::MatrixXd(*in[0] * *in[1]);
    }
    if (op == "PRelu") return element_wise(*in[0], *in[1], leaked);
    if (op == "Add") return element_wise(*in[0], *in[1], std::plus<>());
    if (op == "Sub") return element_wise(*in[0], *in[1], std::minus<>());
    if (op == "Mul") return element_wise(*in[0], *in[1], std::multiplies<>());
    if (op == "Div") return element_wise(*in[0], *in[1], std::divides<>());
  }
  return core::data_error(fmt::format("an unknown operator, or one with {} inputs", in.size()));
}

}  // namespace

core::Result<Eigen::MatrixXd> run_onnx(const OnnxGraph& graph, const Eigen::MatrixXd& inputs) {
  std::map<std::string, Eigen::MatrixXd> values = {{graph.input, inputs}};
  for (std::size_t k = 0; k < graph.steps.size(); ++k) {
    const onnx::NodeProto& node = *graph.steps[k];
    std::vector<const Eigen::MatrixXd*> in;
    for (const std::string& name : node.input()) {
      if (name.empty()) continue;  // an optional input left out
      const auto value = values.find(name);
      const auto constant = graph.constants.find(name);
      if (value == values.end() && constant == graph.constants.end()) {
        return core::data_error(fmt::format("{}: nothing gives '{}'", name_of(node, k), name));
      }
      in.push_back(value != values.end() ? &value->second : &constant->second.values);
    }
    auto result = run(node, in);
    if (!result.ok())
      return core::data_error(fmt::format("{}: {}", name_of(node, k), result.error().message));
    values[node.output(0)] = std::move(*result);
  }
  const auto output = values.find(graph.output);
  if (output == values.end()) return core::data_error("nothing gives the graph's output");
  return output->second;
}

}  // namespace ravencal::conversion
