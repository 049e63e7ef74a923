// SPDX-License-Identifier: Apache-2.0
//
// Loads libravencal_plugin.so as a robot's control process would: dlopen, one symbol, C structs.
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

#include "core/result.hpp"
#include "ravencal/control.h"
#include "ravencal/plugin.h"

namespace ravencal::plugin_host {

/// The shared object and its function table. Keep it alive while instances of it live.
class Library {
 public:
  static core::Result<Library> open(const std::filesystem::path& path);

  [[nodiscard]] const ravencal_api& api() const { return *api_; }
  /// The plugin's own defaults, for weights of the arm of that name ("gold", "green"); of any arm
  /// where the name says none; but after an emergency stop the correction comes back.
  [[nodiscard]] ravencal_config default_config(std::string_view arm = {}) const;

 private:
  struct Close {
    void operator()(void* library) const;
  };
  std::unique_ptr<void, Close> library_;
  const ravencal_api* api_ = nullptr;
};

/// One instance with its storage, destroyed with this object.
class Instance {
 public:
  static core::Result<Instance> create(const Library& library, const ravencal_config& config);

  /// Loads weights; the error is the plugin's own sentence.
  core::Status load(const std::filesystem::path& weights);

  /// Offers the constant of a homing. Errors: kData where it is larger than any correction.
  [[nodiscard]] core::Status set_homing_constant(const ravencal_homing_constant& constant) const;

  [[nodiscard]] const ravencal_api& api() const { return *api_; }
  [[nodiscard]] ravencal_instance* get() const { return instance_.get(); }
  [[nodiscard]] ravencal_counters counters() const;
  [[nodiscard]] ravencal_info info() const;

 private:
  struct Free {
    void operator()(void* storage) const;
  };
  struct Destroy {
    const ravencal_api* api;
    void operator()(ravencal_instance* instance) const;
  };
  const ravencal_api* api_ = nullptr;
  std::unique_ptr<void, Free> storage_;
  std::unique_ptr<ravencal_instance, Destroy> instance_;
};

/// Whether another user than root has the name of the telemetry, so that the plugin writes none.
bool is_without_telemetry(const ravencal_config& config);

/// "AVX-512" for RAVENCAL_ISA_AVX512 and so on.
std::string isa_name(std::uint32_t isa);
/// "f32", "bf16" or "int8", of RAVENCAL_PRECISION_*.
std::string precision_name(std::uint32_t precision);
/// "fading_in" for RAVENCAL_STATE_FADING_IN and so on, as in the JSON of `ravencal host`.
const char* state_name(std::int32_t state);
/// "out_of_range" for bit `kind` of the doubts.
const char* doubt_name(std::size_t kind);

}  // namespace ravencal::plugin_host
