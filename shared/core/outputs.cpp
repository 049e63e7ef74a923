// SPDX-License-Identifier: Apache-2.0
#include "core/outputs.hpp"

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <cstring>
#include <utility>
#include <vector>

namespace ravencal::core {
namespace {

struct FileIdentity {
  dev_t device;
  ino_t number;
  bool operator==(const FileIdentity&) const = default;
};

std::vector<FileIdentity>& inputs() {
  static std::vector<FileIdentity> identities;
  return identities;
}

/// Names as C strings, which a signal handler can use; null: free.
constinit std::array<std::atomic<const char*>, 128> unfinished{};
static_assert(std::atomic<const char*>::is_always_lock_free);

}  // namespace

void protect_inputs(std::span<const std::filesystem::path> paths) {
  for (const std::filesystem::path& path : paths) {
    struct stat file = {};
    if (::stat(path.c_str(), &file) == 0 && S_ISREG(file.st_mode))
      inputs().push_back({file.st_dev, file.st_ino});
  }
}

Status check_output(const std::filesystem::path& path) {
  struct stat file = {};
  if (::stat(path.c_str(), &file) != 0) return {};
  const FileIdentity identity{file.st_dev, file.st_ino};
  if (std::find(inputs().begin(), inputs().end(), identity) == inputs().end()) return {};
  return usage_error(
      fmt::format("{}: is read by this command and would be replaced; give the output another name",
                  path.string()));
}

Unfinished::Unfinished(const std::filesystem::path& path) {
  const char* const name = ::strdup(path.c_str());
  for (auto& slot : unfinished) {
    const char* free_slot = nullptr;
    if (!slot.compare_exchange_strong(free_slot, name)) continue;
    slot_ = &slot;
    return;
  }
  std::free(const_cast<char*>(name));
}

Unfinished::Unfinished(Unfinished&& other) noexcept : slot_(std::exchange(other.slot_, nullptr)) {}

Unfinished::~Unfinished() {
  // A handler that has taken the name still reads it; it ends the process.
  if (slot_ != nullptr) std::free(const_cast<char*>(slot_->exchange(nullptr)));
}

void remove_unfinished() noexcept {
  for (auto slot = unfinished.rbegin(); slot != unfinished.rend(); ++slot) {
    const char* const name = slot->exchange(nullptr);
    if (name != nullptr && ::unlink(name) != 0) (void)::rmdir(name);
  }
}

}  // namespace ravencal::core
