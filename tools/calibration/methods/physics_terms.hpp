// SPDX-License-Identifier: Apache-2.0
//
// The physics that `ravencal diagnose` found, read from plant_improved.toml in its folder and
// turned into columns over a stream of samples. Widths, orders and the numbers of the cable come
// from the diagnosis; the user of the columns fits their sizes.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "methods/problem.hpp"

namespace ravencal::methods {

/// Columns of one joint's error. Copyable by clone(): each stream has its own memory.
class Terms {
 public:
  virtual ~Terms() = default;
  [[nodiscard]] virtual std::unique_ptr<Terms> clone() const = 0;
  virtual void start(const Series& series, Eigen::Index row) = 0;
  /// Values of the columns [count()] at this row.
  virtual void step(const Series& series, Eigen::Index row, Eigen::Ref<Eigen::VectorXd> values) = 0;
  [[nodiscard]] virtual Eigen::Index count() const = 0;
  [[nodiscard]] virtual std::string text() const = 0;  ///< e.g. "gain_error, hysteresis from q6"
};

/// Terms of each output of `problem`, a constant first. Errors: kIo, kData if the folder has no
/// such plant, or it lacks an output's joint.
core::Result<std::vector<std::unique_ptr<Terms>>> read_terms(const std::filesystem::path& folder,
                                                             const Problem& problem);

}  // namespace ravencal::methods
