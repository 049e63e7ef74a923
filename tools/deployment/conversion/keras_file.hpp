// SPDX-License-Identifier: Apache-2.0
//
// Content of a Keras model.h5, unchanged: the configuration of each layer and its weights in
// Keras' own shapes. Keras 2 and 3 write the same groups; they differ in the names of weights and
// in keys of the configuration. The reader (keras_network.cpp) and the interpreter
// (keras_interpreter.cpp) share this and nothing else.
#pragma once

#include <Eigen/Core>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "core/result.hpp"

namespace ravencal::conversion {

/// What Keras' layers mean where their configuration does not say.
inline constexpr double kKerasBatchEpsilon = 1e-3;
inline constexpr double kKerasLeakySlope = 0.3;
/// The slope of activation "leaky_relu", which is no parameter, and `backend.epsilon()`, the least
/// deviation that Normalization divides by.
inline constexpr double kKerasLeakyActivationSlope = 0.2;
inline constexpr double kKerasLeastDeviation = 1e-7;

struct KerasLayer {
  std::string class_name;  ///< "Dense"
  std::string name;        ///< "dense_1"
  std::string activation = "linear";
  std::string recurrent_activation;
  Eigen::Index units = 0;
  bool use_bias = true;
  bool reset_after = false;  ///< GRU; files before Keras 2.2 do not have it
  bool return_sequences = false;
  bool go_backwards = false;
  bool stateful = false;
  std::vector<Eigen::Index> input_shape;           ///< without the rows; 0: any; may be empty
  std::map<std::string, Eigen::MatrixXd> weights;  ///< "kernel", ...; a vector is one row
  std::map<std::string, std::string> unreadable;   ///< why weights of that name are not there
  /// Every number, truth value (0, 1) and list of numbers of its configuration: "epsilon", ...
  std::map<std::string, std::vector<double>> numbers;

  [[nodiscard]] double number_or(const std::string& key, double otherwise) const;
};

struct KerasFile {
  std::string version;
  std::vector<KerasLayer> layers;  ///< one behind the other

  /// Errors (kIo, kData): no such file; not a whole Keras model; not a chain of layers.
  static core::Result<KerasFile> read(const std::string& path);
};

/// The samples of a window, oldest first, each [rows x inputs]; the result is [rows x outputs].
core::Result<Eigen::MatrixXd> run_keras(const KerasFile& file,
                                        std::span<const Eigen::MatrixXd> samples);

}  // namespace ravencal::conversion
