// SPDX-License-Identifier: Apache-2.0
//
// What a Keras model.h5 holds, before anything of it is interpreted: the description as JSON and
// the arrays by layer. The HDF5 library trusts the bytes of a file, so that a child process reads
// it.
#pragma once

#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

#include "core/result.hpp"

namespace ravencal::conversion {

struct KerasContent {
  std::string model_config;
  std::string version;
  /// By layer and by the weights' own name; a vector is one row, a single number 1 x 1.
  std::map<std::string, std::map<std::string, Eigen::MatrixXd>> weights;
  /// Why an array is not among them: of other dimensions, too large, or not finite.
  std::map<std::string, std::map<std::string, std::string>> unreadable;

  /// Errors (kIo, kData): no such file; not a whole Keras model.
  static core::Result<KerasContent> read(const std::string& path);
};

}  // namespace ravencal::conversion
