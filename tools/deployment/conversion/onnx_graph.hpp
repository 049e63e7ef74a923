// SPDX-License-Identifier: Apache-2.0
//
// An ONNX file opened: its constants as double matrices and its steps in order. The reader
// (onnx_network.cpp) and the interpreter (onnx_interpreter.cpp) share this and nothing else.
#pragma once

#include <onnx/onnx_pb.h>

#include <Eigen/Core>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "core/result.hpp"

namespace ravencal::conversion {

/// What the operators of ONNX mean where a node does not say.
inline constexpr float kOnnxLeakyAlpha = 0.01F;
inline constexpr float kOnnxBatchEpsilon = 1e-5F;

/// At most two dimensions; a vector is one row, a scalar 1 x 1.
struct OnnxTensor {
  int rank = 0;
  Eigen::MatrixXd values;
  std::vector<std::int64_t> integers;  ///< of a tensor of integers or truth values, which has no
                                       ///< `values`
  std::string no_values;               ///< why `values` is empty: said only where a step needs them
};

struct OnnxGraph {
  onnx::ModelProto proto;
  std::map<std::string, OnnxTensor> constants;  ///< initialisers, Constant nodes, Identity of them
  std::vector<const onnx::NodeProto*> steps;    ///< the other nodes, in the file's order
  std::string input;
  Eigen::Index input_width = 0;
  std::int64_t rows = 0;  ///< of the input, where the file fixes them
  std::string output;
  std::int64_t opset = 0;

  /// Opens `path`. Errors: kIo; kData with the place and the remedy.
  static core::Result<std::shared_ptr<const OnnxGraph>> read(const std::string& path);
};

/// "node 3 '/net/0/Gemm' (operator Gemm)".
std::string name_of(const onnx::NodeProto& node, std::size_t index);

/// Of a node, or `otherwise`.
float attribute_or(const onnx::NodeProto& node, const char* name, float otherwise);
std::int64_t attribute_or(const onnx::NodeProto& node, const char* name, std::int64_t otherwise);

/// Runs every step of a graph that read_foreign_onnx() takes on [rows x inputs]. Errors (kData): an
/// operator or shape that it does not know.
core::Result<Eigen::MatrixXd> run_onnx(const OnnxGraph& graph, const Eigen::MatrixXd& inputs);

}  // namespace ravencal::conversion
