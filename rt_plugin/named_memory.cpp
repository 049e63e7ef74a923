// SPDX-License-Identifier: Apache-2.0
#include "rt_plugin/named_memory.hpp"

#include <fcntl.h>
#include <pthread.h>
#include <sys/file.h>
#include <sys/ipc.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/shm.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <new>

#include "ravencal/plugin.h"
#include "rt_plugin/file_status.hpp"

namespace ravencal::rt {

namespace {

/// All named memory of this process. A child of fork() has copies of the mappings and of the
/// descriptors: with them it would write beside its parent, and hold the lock of a parent that was
/// killed. So it gives them up before fork() returns.
class Forks {
 public:
  static bool keep(NamedMemory::Held& held) noexcept {
    ::pthread_mutex_lock(&mutex_);
    if (!watched_) watched_ = ::pthread_atfork(&before, &in_parent, &in_child) == 0;
    const bool kept = watched_;
    if (kept) {
      held.next = first_;
      first_ = &held;
    }
    ::pthread_mutex_unlock(&mutex_);
    return kept;
  }

  static void forget(const NamedMemory::Held& held) noexcept {
    ::pthread_mutex_lock(&mutex_);
    NamedMemory::Held** at = &first_;
    while (*at != nullptr && *at != &held) at = &(*at)->next;
    if (*at != nullptr) *at = held.next;
    ::pthread_mutex_unlock(&mutex_);
  }

 private:
  static void before() noexcept { ::pthread_mutex_lock(&mutex_); }
  static void in_parent() noexcept { ::pthread_mutex_unlock(&mutex_); }
  static void in_child() noexcept {
    for (NamedMemory::Held* held = first_; held != nullptr; held = held->next) held->detach();
    first_ = nullptr;
    ::pthread_mutex_unlock(&mutex_);
  }

  static inline pthread_mutex_t mutex_ = PTHREAD_MUTEX_INITIALIZER;
  static inline NamedMemory::Held* first_ = nullptr;
  static inline bool watched_ = false;
};

/// shm_open is open in this folder, but in libc only since glibc 2.34: a plugin that called it
/// would not load on older systems.
constexpr char kFolder[] = "/dev/shm";
constexpr mode_t kMode = 0640;

/// What errno means for who asked.
std::int32_t refusal() noexcept {
  switch (errno) {
    case EMFILE:
    case ENFILE:
    case EFBIG:
      return RAVENCAL_ERROR_LIMIT;
    case ENOMEM:
    case ENOSPC:
    case EDQUOT:
      return RAVENCAL_ERROR_MEMORY;
    default:
      return RAVENCAL_ERROR_IO;
  }
}

void close_quietly(int file) noexcept {
  const int reason = errno;
  ::close(file);
  errno = reason;
}

bool leads_to(const char* path, int file) noexcept {
  struct stat named = {};
  struct stat held = {};
  return path_status(path, named) && file_status(file, held) && named.st_ino == held.st_ino &&
         named.st_dev == held.st_dev;
}

/// Those who ask whether an owner lives hold a shared lock for a moment; an owner holds its own
/// until it ends.
bool lock_or_find_owner(int file) noexcept {
  constexpr int kTries = 20;
  constexpr timespec kPause = {0, 1'000'000};
  for (int i = 0; i < kTries; ++i) {
    if (::flock(file, LOCK_EX | LOCK_NB) == 0) return true;
    ::nanosleep(&kPause, nullptr);
  }
  return false;
}

/// Takes the name away from the file that a dead process left there. RAVENCAL_SUCCESS also if the
/// name is free by now, or leads to another file.
std::int32_t remove_dead(const char* path, std::span<const std::byte> magic) noexcept {
  const int file = ::open(path, O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
  if (file < 0) {
    if (errno == ENOENT) return RAVENCAL_SUCCESS;
    const std::int32_t code = refusal();
    return code == RAVENCAL_ERROR_IO ? RAVENCAL_ERROR_BUSY : code;
  }
  char start[16] = {};
  const bool ours = ::read(file, start, magic.size()) == static_cast<ssize_t>(magic.size()) &&
                    std::memcmp(start, magic.data(), magic.size()) == 0;
  const bool dead = ours && lock_or_find_owner(file);
  if (dead && leads_to(path, file)) ::unlink(path);
  ::close(file);
  return dead ? RAVENCAL_SUCCESS : RAVENCAL_ERROR_BUSY;
}

/// A file without a name, locked, with that content; -1: errno says why not.
int make_file(std::span<const std::byte> content) noexcept {
  // Past this limit a write would not fail but end the process (SIGXFSZ).
  rlimit limit{};
  if (::getrlimit(RLIMIT_FSIZE, &limit) == 0 && limit.rlim_cur < content.size()) {
    errno = EFBIG;
    return -1;
  }
  const int file = ::open(kFolder, O_TMPFILE | O_RDWR | O_CLOEXEC, kMode);
  if (file < 0) return -1;
  const ssize_t written = ::write(file, content.data(), content.size());
  if (written == static_cast<ssize_t>(content.size()) && ::fchmod(file, kMode) == 0 &&
      ::flock(file, LOCK_EX | LOCK_NB) == 0) {
    return file;
  }
  if (written >= 0 && written < static_cast<ssize_t>(content.size())) errno = ENOSPC;
  close_quietly(file);
  return -1;
}

}  // namespace

std::int32_t NamedMemory::Segment::take(std::size_t bytes, unsigned mode) noexcept {
  id = ::shmget(IPC_PRIVATE, bytes, IPC_CREAT | IPC_EXCL | static_cast<int>(mode));
  if (id < 0) return refusal();
  void* const memory = ::shmat(id, nullptr, 0);
  const int reason = errno;
  // Linux lets others attach to a removed segment for as long as somebody has it.
  ::shmctl(id, IPC_RMID, nullptr);
  errno = reason;
  if (memory == reinterpret_cast<void*>(-1)) return refusal();
  words = static_cast<std::uint64_t*>(memory);
  std::memset(memory, 0, bytes);  // the first store to a page would fault in a tick
  ::mlock(memory, bytes);
  return RAVENCAL_SUCCESS;
}

void NamedMemory::Segment::detach() noexcept {
  if (words != nullptr) ::shmdt(words);
  words = nullptr;
}

std::int32_t NamedMemory::reserve(std::size_t bytes, std::size_t request_bytes) noexcept {
  void* const page =
      ::mmap(nullptr, sizeof(Held), PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (page == MAP_FAILED) return refusal();
  ::mlock(page, sizeof(Held));
  held_ = new (page) Held;
  constexpr unsigned kMine = 0600;
  std::int32_t code = held_->shown.take(bytes, kMode);
  if (code == RAVENCAL_SUCCESS) code = held_->asked.take(request_bytes, kMine);
  if (code != RAVENCAL_SUCCESS) return code;
  if (Forks::keep(*held_)) return RAVENCAL_SUCCESS;
  errno = ENOMEM;
  return RAVENCAL_ERROR_MEMORY;
}

std::int32_t NamedMemory::publish(const char* name, std::span<const std::byte> label,
                                  std::span<const std::byte> magic) noexcept {
  char path[sizeof held_->path] = {};
  (void)std::snprintf(path, sizeof path, "%s%s", kFolder, name);
  held_->file = make_file(label);
  if (held_->file < 0) return refusal();
  char self[32] = {};
  (void)std::snprintf(self, sizeof self, "/proc/self/fd/%d", held_->file);
  constexpr int kTries = 100;  // against others who want the name, or end, at the same time
  for (int i = 0; i < kTries; ++i) {
    if (::linkat(AT_FDCWD, self, AT_FDCWD, path, AT_SYMLINK_FOLLOW) == 0) {
      std::memcpy(held_->path, path, sizeof path);
      return RAVENCAL_SUCCESS;
    }
    if (errno != EEXIST) return refusal();
    if (const std::int32_t code = remove_dead(path, magic); code != RAVENCAL_SUCCESS) return code;
  }
  return RAVENCAL_ERROR_BUSY;
}

bool NamedMemory::is_strangers(const char* name) noexcept {
  char path[sizeof held_->path] = {};
  (void)std::snprintf(path, sizeof path, "%s%s", kFolder, name);
  struct stat named = {};
  return path_status(path, named) && named.st_uid != 0 && named.st_uid != ::geteuid();
}

void NamedMemory::Held::detach() noexcept {
  shown.detach();
  asked.detach();
  if (file >= 0) ::close(file);
  file = -1;
}

void NamedMemory::release() noexcept {
  if (held_ == nullptr) return;
  const int reason = errno;
  Forks::forget(*held_);
  // Where it is the owner's, the lock is still held: nobody else may change where the name leads.
  if (held_->file >= 0 && held_->path[0] != '\0' && leads_to(held_->path, held_->file)) {
    ::unlink(held_->path);
  }
  held_->detach();
  ::munmap(held_, sizeof(Held));
  held_ = nullptr;
  errno = reason;
}

}  // namespace ravencal::rt
