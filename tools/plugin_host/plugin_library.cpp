// SPDX-License-Identifier: Apache-2.0
#include "plugin_host/plugin_library.hpp"

#include <dlfcn.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>

#include "model/origin.hpp"

namespace ravencal::plugin_host {

void Library::Close::operator()(void* library) const { ::dlclose(library); }

core::Result<Library> Library::open(const std::filesystem::path& path) {
  // dlopen searches the system's folders for a bare name; a path was meant.
  const std::string file = path.has_parent_path() ? path.string() : "./" + path.string();
  Library library;
  library.library_.reset(::dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL));
  if (library.library_ == nullptr) {
    return core::Error{core::ErrorCode::kIo,
                       fmt::format("cannot load the plugin: {}", ::dlerror())};
  }
  void* const symbol = ::dlsym(library.library_.get(), "ravencal_plugin_entry");
  if (symbol == nullptr) {
    return core::Error{
        core::ErrorCode::kData,
        fmt::format("{}: not a ravencal plugin: it has no ravencal_plugin_entry", path.string())};
  }
  library.api_ = reinterpret_cast<ravencal_plugin_entry_fn>(symbol)(RAVENCAL_ABI_MAJOR);
  if (library.api_ == nullptr || library.api_->abi_major != RAVENCAL_ABI_MAJOR ||
      library.api_->struct_size < sizeof(ravencal_api)) {
    return core::Error{core::ErrorCode::kData,
                       fmt::format("{}: the plugin does not speak ABI {}.{}; build it again from "
                                   "the same version as this program",
                                   path.string(), RAVENCAL_ABI_MAJOR, RAVENCAL_ABI_MINOR)};
  }
  return library;
}

ravencal_config Library::default_config(std::string_view arm) const {
  ravencal_config config{};
  config.struct_size = sizeof config;
  api_->default_config(&config);
  // Programs replay and simulate what an operator armed: nobody arms it again after a stop.
  config.resume_after_stop = 1;
  const model::Arm known = model::arm_from(arm).value_or(model::Arm::kUnknown);
  config.arm =
      static_cast<std::uint32_t>(known);  // rt_plugin/admission.cpp asserts that both agree
  return config;
}

bool is_without_telemetry(const ravencal_config& config) {
  struct stat named = {};
  const std::string path = std::string("/dev/shm") + config.telemetry_name;
  return config.telemetry_name[0] != '\0' && ::stat(path.c_str(), &named) == 0 &&
         named.st_uid != 0 && named.st_uid != ::geteuid();
}

namespace {

core::Error create_error(std::int32_t code, const ravencal_config& config) {
  const char* const reason = std::strerror(errno);
  const std::string name(config.telemetry_name,
                         ::strnlen(config.telemetry_name, sizeof config.telemetry_name));
  switch (code) {
    case RAVENCAL_ERROR_BUSY:
      return {
          core::ErrorCode::kIo,
          fmt::format("telemetry {}: another process writes it, or it is something else; choose "
                      "another name",
                      name)};
    case RAVENCAL_ERROR_MEMORY:
      return {core::ErrorCode::kIo,
              fmt::format("the plugin has no memory: {} (is /dev/shm full?)", reason)};
    case RAVENCAL_ERROR_LIMIT:
      return {core::ErrorCode::kIo,
              fmt::format("telemetry {}: {}: raise this process's limit (ulimit -n: open files, "
                          "ulimit -f: size of files)",
                          name, reason)};
    case RAVENCAL_ERROR_IO:
      return {core::ErrorCode::kIo,
              fmt::format("telemetry {}: the system does not let the plugin create it: {}", name,
                          reason)};
    default:
      return {core::ErrorCode::kUsage,
              name.empty() ? "the plugin refuses this configuration"
                           : fmt::format("the plugin refuses this configuration (a telemetry name "
                                         "is like /ravencal-left; this one is '{}')",
                                         name)};
  }
}

}  // namespace

void Instance::Free::operator()(void* storage) const { std::free(storage); }

void Instance::Destroy::operator()(ravencal_instance* instance) const { api->destroy(instance); }

core::Result<Instance> Instance::create(const Library& library, const ravencal_config& config) {
  Instance plugin;
  plugin.api_ = &library.api();
  const std::size_t alignment = plugin.api_->storage_alignment();
  const std::size_t bytes = (plugin.api_->storage_size() + alignment - 1) / alignment * alignment;
  plugin.storage_.reset(std::aligned_alloc(alignment, bytes));
  ravencal_instance* instance = nullptr;
  const std::int32_t code =
      plugin.storage_ == nullptr
          ? RAVENCAL_ERROR_MEMORY
          : plugin.api_->create(&config, plugin.storage_.get(), bytes, &instance);
  if (code != RAVENCAL_SUCCESS) return create_error(code, config);
  plugin.instance_ = {instance, Destroy{plugin.api_}};
  return plugin;
}

core::Status Instance::load(const std::filesystem::path& weights) {
  const std::int32_t code = api_->load(get(), weights.c_str());
  if (code == RAVENCAL_SUCCESS) return {};
  return core::Error{code == RAVENCAL_ERROR_IO ? core::ErrorCode::kIo : core::ErrorCode::kData,
                     api_->last_error(get())};
}

core::Status Instance::set_homing_constant(const ravencal_homing_constant& constant) const {
  if (api_->set_homing_constant(get(), &constant) == RAVENCAL_SUCCESS) return {};
  return core::data_error(
      "the plugin refuses a constant of a homing that is larger than any "
      "correction (max_correction_ji)");
}

ravencal_counters Instance::counters() const {
  ravencal_counters counters{};
  counters.struct_size = sizeof counters;
  api_->counters(get(), &counters);
  return counters;
}

ravencal_info Instance::info() const {
  ravencal_info info{};
  info.struct_size = sizeof info;
  api_->info(get(), &info);
  return info;
}

std::string isa_name(std::uint32_t isa) {
  constexpr const char* kNames[] = {"best", "baseline", "AVX2", "AVX-512", "AVX-512 VNNI", "NEON"};
  return isa < std::size(kNames) ? kNames[isa] : fmt::format("instruction set {}", isa);
}

std::string precision_name(std::uint32_t precision) {
  constexpr const char* kNames[] = {"f32", "bf16", "int8"};
  return precision < std::size(kNames) ? kNames[precision] : fmt::format("precision {}", precision);
}

const char* state_name(std::int32_t state) {
  constexpr const char* kNames[RAVENCAL_STATE_COUNT] = {
      "off", "armed", "fading_in", "active", "hold", "fading_out", "constant", "fault", "shadow"};
  return state >= 0 && state < RAVENCAL_STATE_COUNT ? kNames[state] : "unknown";
}

const char* doubt_name(std::size_t kind) {
  constexpr const char* kNames[RAVENCAL_DOUBT_KINDS] = {
      "robot_state",  "no_weights", "time",      "not_latched", "not_finite",
      "out_of_range", "warming_up", "magnitude", "network",     "encoder_jump",
      "distance",     "overrun",    "pedal",     "limit",       "press"};
  return kind < RAVENCAL_DOUBT_KINDS ? kNames[kind] : "unknown";
}

}  // namespace ravencal::plugin_host
