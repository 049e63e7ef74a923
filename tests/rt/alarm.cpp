// SPDX-License-Identifier: Apache-2.0
#include "rt/alarm.hpp"

#include <dlfcn.h>
#include <pthread.h>
#include <semaphore.h>

#include <atomic>
#include <cerrno>
#include <cstddef>

// glibc's own entry points, to which the interposed ones pass the work on.
extern "C" {
void* __libc_malloc(std::size_t bytes);
void* __libc_calloc(std::size_t count, std::size_t bytes);
void* __libc_realloc(void* memory, std::size_t bytes);
void* __libc_memalign(std::size_t alignment, std::size_t bytes);
void __libc_free(void* memory);
}

namespace {

thread_local bool armed = false;
thread_local ravencal::test::AlarmCounts counts;

void ring() {
  if (armed) ++counts.heap;
}

/// A function of the C library that this program hides.
class Hidden {
 public:
  constexpr explicit Hidden(const char* name) : name_(name) {}

  /// Counts the call and passes it on.
  template <typename Result, typename... Arguments>
  Result call(Arguments... arguments) {
    if (armed) ++counts.locks;
    void* address = address_.load(std::memory_order_relaxed);
    if (address == nullptr) {
      const bool was_armed = armed;
      armed = false;  // looking it up may itself use the heap
      address = ::dlsym(RTLD_NEXT, name_);
      armed = was_armed;
      address_.store(address, std::memory_order_relaxed);
    }
    return reinterpret_cast<Result (*)(Arguments...)>(address)(arguments...);
  }

 private:
  const char* name_;
  std::atomic<void*> address_{nullptr};
};

constinit Hidden mutex_lock("pthread_mutex_lock");
constinit Hidden mutex_trylock("pthread_mutex_trylock");
constinit Hidden mutex_timedlock("pthread_mutex_timedlock");
constinit Hidden rwlock_rdlock("pthread_rwlock_rdlock");
constinit Hidden rwlock_wrlock("pthread_rwlock_wrlock");
constinit Hidden spin_lock("pthread_spin_lock");
constinit Hidden semaphore_wait("sem_wait");

}  // namespace

extern "C" {
void* malloc(std::size_t bytes) {
  ring();
  return __libc_malloc(bytes);
}
void* calloc(std::size_t count, std::size_t bytes) {
  ring();
  return __libc_calloc(count, bytes);
}
void* realloc(void* memory, std::size_t bytes) {
  ring();
  return __libc_realloc(memory, bytes);
}
void* memalign(std::size_t alignment, std::size_t bytes) {
  ring();
  return __libc_memalign(alignment, bytes);
}
void* aligned_alloc(std::size_t alignment, std::size_t bytes) {
  ring();
  return __libc_memalign(alignment, bytes);
}
int posix_memalign(void** memory, std::size_t alignment, std::size_t bytes) {
  ring();
  *memory = __libc_memalign(alignment, bytes);
  return *memory == nullptr ? ENOMEM : 0;
}
void free(void* memory) {
  ring();
  __libc_free(memory);
}

int pthread_mutex_lock(pthread_mutex_t* mutex) noexcept { return mutex_lock.call<int>(mutex); }
int pthread_mutex_trylock(pthread_mutex_t* mutex) noexcept {
  return mutex_trylock.call<int>(mutex);
}
int pthread_mutex_timedlock(pthread_mutex_t* mutex, const timespec* until) noexcept {
  return mutex_timedlock.call<int>(mutex, until);
}
int pthread_rwlock_rdlock(pthread_rwlock_t* lock) noexcept { return rwlock_rdlock.call<int>(lock); }
int pthread_rwlock_wrlock(pthread_rwlock_t* lock) noexcept { return rwlock_wrlock.call<int>(lock); }
int pthread_spin_lock(pthread_spinlock_t* lock) noexcept { return spin_lock.call<int>(lock); }
int sem_wait(sem_t* semaphore) { return semaphore_wait.call<int>(semaphore); }
}

namespace ravencal::test {

void arm_alarms() {
  counts = {};
  armed = true;
}

AlarmCounts disarm_alarms() {
  armed = false;
  return counts;
}

}  // namespace ravencal::test
