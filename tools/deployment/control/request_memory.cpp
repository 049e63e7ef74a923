// SPDX-License-Identifier: Apache-2.0
#include "control/request_memory.hpp"

#include <fmt/format.h>
#include <sys/shm.h>
#include <unistd.h>

#include <bit>
#include <cerrno>
#include <cstring>
#include <string_view>
#include <utility>

namespace ravencal::control {
namespace {

constexpr unsigned kPermissions = 0777;
constexpr unsigned kOwnerAlone = 0600;

core::Error memory_error(const std::string& name, std::string_view what) {
  return {core::ErrorCode::kIo, fmt::format("{}: its memory for requests {}", name, what)};
}

}  // namespace

core::Result<RequestMemory> RequestMemory::attach(const std::string& name, int id) {
  shmid_ds status{};
  if (::shmctl(id, IPC_STAT, &status) != 0) {
    return memory_error(name, fmt::format("cannot be looked at: {}", std::strerror(errno)));
  }
  if (status.shm_perm.uid != ::geteuid() || (status.shm_perm.mode & kPermissions) != kOwnerAlone ||
      status.shm_segsz < sizeof(ravencal_request)) {
    return memory_error(name, "is not this user's alone");
  }
  // A plugin's is marked to go with its process. A number that is stale, or false, may lead to the
  // memory of another program, which must not find a request in it.
  if ((status.shm_perm.mode & SHM_DEST) == 0) return memory_error(name, "is no plugin's");
  void* const memory = ::shmat(id, nullptr, 0);
  if (memory == reinterpret_cast<void*>(-1)) {
    return memory_error(name, fmt::format("cannot be attached: {}", std::strerror(errno)));
  }
  const bool has_room =
      status.shm_segsz >= sizeof(ravencal_request) + sizeof(ravencal_constant_request);
  return RequestMemory(static_cast<std::uint64_t*>(memory), has_room);
}

RequestMemory::RequestMemory(RequestMemory&& other) noexcept
    : words_(std::exchange(other.words_, nullptr)),
      has_room_for_constant_(other.has_room_for_constant_) {}

RequestMemory::~RequestMemory() {
  if (words_ != nullptr) ::shmdt(words_);
}

RequestMemory::Words RequestMemory::load() const {
  Words words{};
  for (std::size_t i = 0; i < kWords; ++i) words[i] = word(i).load(std::memory_order_acquire);
  return words;
}

std::uint64_t RequestMemory::number() const { return word(0).load(std::memory_order_acquire); }

bool RequestMemory::holds_waiting(std::uint64_t taken) const {
  const Words words = load();
  const auto request = std::bit_cast<ravencal_request>(words);
  // As the plugin judges: what it never takes keeps nobody waiting.
  const bool is_constant = request.kind == RAVENCAL_REQUEST_HOMING_CONSTANT;
  if (is_constant && !holds_constant_of(request.number)) return false;
  return static_cast<std::int64_t>(request.number - taken) > 0 &&
         request.check == RAVENCAL_REQUEST_CHECK(words[0], words[1], words[2]) &&
         request.version == RAVENCAL_REQUEST_VERSION && request.kind < RAVENCAL_REQUEST_KINDS &&
         request.share >= 0.0F && request.share <= 1.0F && request.joints < 1U << RAVENCAL_JOINTS;
}

bool RequestMemory::holds_constant_of(std::uint64_t number) const {
  if (!has_room_for_constant_) return false;
  ConstantWords words{};
  for (std::size_t i = 0; i < words.size(); ++i)
    words[i] = word(kWords + i).load(std::memory_order_acquire);
  return words[0] == number &&
         words[5] == RAVENCAL_CONSTANT_CHECK(words[0], words[1], words[2], words[3], words[4]);
}

bool RequestMemory::holds(const ravencal_request& request) const {
  return load() == std::bit_cast<Words>(request);
}

/// The number last: the plugin does not look before it has changed.
void RequestMemory::write(ravencal_request& request, const ravencal_homing_constant& constant) {
  if (request.kind == RAVENCAL_REQUEST_HOMING_CONSTANT)
    write_constant({request.number, constant, 0});
  auto words = std::bit_cast<Words>(request);
  request.check = RAVENCAL_REQUEST_CHECK(words[0], words[1], words[2]);
  words = std::bit_cast<Words>(request);
  for (std::size_t i = 1; i < kWords; ++i) word(i).store(words[i], std::memory_order_release);
  word(0).store(words[0], std::memory_order_release);
}

/// Right behind the request.
void RequestMemory::write_constant(ravencal_constant_request record) {
  auto words = std::bit_cast<ConstantWords>(record);
  record.check = RAVENCAL_CONSTANT_CHECK(words[0], words[1], words[2], words[3], words[4]);
  words = std::bit_cast<ConstantWords>(record);
  for (std::size_t i = 0; i < words.size(); ++i) {
    word(kWords + i).store(words[i], std::memory_order_release);
  }
}

void RequestMemory::withdraw(const ravencal_request& request, std::uint64_t taken) {
  std::uint64_t number = request.number;
  word(0).compare_exchange_strong(number, taken);  // the check then belongs to another number
}

}  // namespace ravencal::control
