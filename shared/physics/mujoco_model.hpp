// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <mujoco/mujoco.h>

#include <memory>
#include <string>

namespace ravencal::physics {

struct ModelDeleter {
  void operator()(mjModel* model) const { mj_deleteModel(model); }
};
using ModelPointer = std::unique_ptr<mjModel, ModelDeleter>;

struct CompiledModel {
  ModelPointer model;   ///< null: the library refuses it
  std::string refusal;  ///< its reason
};

/// Compiles a model that stands in memory. `name` ends in .xml or, of URDF, in .urdf. Threads may
/// call it at once; the library's parser takes one at a time.
CompiledModel compile_model(const std::string& xml, const std::string& name);

}  // namespace ravencal::physics
