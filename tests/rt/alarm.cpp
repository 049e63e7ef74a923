// SPDX-License-Identifier: Apache-2.0
#include "rt/alarm.hpp"

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
thread_local std::uint64_t calls = 0;

void ring() {
  if (armed) ++calls;
}

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
}

namespace ravencal::test {

void arm_heap_alarm() {
  calls = 0;
  armed = true;
}

std::uint64_t disarm_heap_alarm() {
  armed = false;
  return calls;
}

}  // namespace ravencal::test
