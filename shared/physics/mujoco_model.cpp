// SPDX-License-Identifier: Apache-2.0
#include "physics/mujoco_model.hpp"

#include <array>
#include <cstring>
#include <mutex>

namespace ravencal::physics {

CompiledModel compile_model(const std::string& xml, const std::string& name) {
  static std::mutex parser;
  const std::lock_guard<std::mutex> lock(parser);
  std::array<char, 1000> error{};
  auto files = std::make_unique<mjVFS>();
  mj_defaultVFS(files.get());
  mj_makeEmptyFileVFS(files.get(), name.c_str(), static_cast<int>(xml.size()));
  std::memcpy(files->filedata[0], xml.data(), xml.size());
  CompiledModel out;
  out.model.reset(
      mj_loadXML(name.c_str(), files.get(), error.data(), static_cast<int>(error.size())));
  mj_deleteVFS(files.get());
  out.refusal = error.data();
  return out;
}

}  // namespace ravencal::physics
