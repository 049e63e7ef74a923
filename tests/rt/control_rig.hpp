// SPDX-License-Identifier: Apache-2.0
//
// What the tests of requests share: a plugin with telemetry whose control loop runs in the test, in
// a /dev/shm of its own, and requests written word by word.
#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/shm.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <bit>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <string>
#include <thread>

#include "control/control.hpp"
#include "core/run_level.hpp"
#include "rt/telemetry_process.hpp"
#include "rt/telemetry_rig.hpp"
#include "unit/telemetry_segment.hpp"

namespace ravencal::test {

constexpr std::size_t kRequestWords = sizeof(ravencal_request) / sizeof(std::uint64_t);
using RequestWords = std::array<std::uint64_t, kRequestWords>;

inline bool write_text(const char* path, const std::string& text) {
  std::ofstream file(path);
  file << text << std::flush;
  return file.good();
}

/// Mounts of its own; without root in a user namespace, where this user stays who it is.
inline bool have_own_mounts() {
  if (::unshare(CLONE_NEWNS) == 0) return true;
  const std::string uid = std::to_string(::geteuid());
  const std::string gid = std::to_string(::getegid());
  return ::unshare(CLONE_NEWUSER | CLONE_NEWNS) == 0 &&
         write_text("/proc/self/uid_map", uid + " " + uid + " 1") &&
         write_text("/proc/self/setgroups", "deny") &&
         write_text("/proc/self/gid_map", gid + " " + gid + " 1");
}

/// Gives this process a /dev/shm that nobody else sees: "off" without a name ends the correction of
/// every plugin there, also that of a test beside this one. False where the system forbids it.
inline bool have_own_shared_memory() {
  static const bool have = have_own_mounts() &&
                           ::mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0 &&
                           ::mount("none", "/dev/shm", "tmpfs", 0, "mode=1777") == 0;
  return have;
}

/// With the check that belongs to it.
inline ravencal_request checked(ravencal_request request) {
  const auto words = std::bit_cast<RequestWords>(request);
  request.check = RAVENCAL_REQUEST_CHECK(words[0], words[1], words[2]);
  return request;
}

/// What a program does that knows control.h.
inline void write_words(std::uint64_t* memory, const ravencal_request& request) {
  const auto words = std::bit_cast<RequestWords>(request);
  for (const std::size_t i : {1U, 2U, 3U, 0U}) {
    std::atomic_ref<std::uint64_t>(memory[i]).store(words[i], std::memory_order_release);
  }
}

inline std::uint64_t* attached(int id) {
  void* const memory = ::shmat(id, nullptr, 0);
  return memory == reinterpret_cast<void*>(-1) ? nullptr : static_cast<std::uint64_t*>(memory);
}

/// How a program ended, and all that it printed.
struct Ended {
  int code = -1;
  std::string text;
};

/// The program, as a user types it.
inline Ended call_program(const std::string& arguments) {
  const std::string command = std::string(RAVENCAL_PROGRAM) + " " + arguments + " 2>&1";
  FILE* const pipe = ::popen(command.c_str(), "r");
  Ended ended;
  std::array<char, 256> part{};
  while (std::fgets(part.data(), part.size(), pipe) != nullptr) ended.text += part.data();
  const int status = ::pclose(pipe);
  ended.code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  return ended;
}

inline Ended call_control(const std::string& arguments) {
  return call_program("control " + arguments);
}

class ControlRig : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!have_own_shared_memory()) GTEST_SKIP() << "this system allows no /dev/shm of its own";
    rig.config.resume_after_stop = 0;  // as the adapter has it on a robot
    start();
  }
  void TearDown() override {
    if (memory != nullptr) ::shmdt(memory);
  }

  /// A plugin in SHADOW; in place of the one before.
  void start() {
    rig.instance = {};
    if (memory != nullptr) ::shmdt(memory);
    ASSERT_TRUE(give_telemetry(rig, name).ok());
    rig.load(make_model(16, {}));
    rig.api().set_mode(rig.instance.get(), RAVENCAL_MODE_SHADOW);
    rig.state.runlevel = core::kPedalUp;
    for (int i = 0; i < 500; ++i) rig.tick();
    ASSERT_EQ(rig.output.state, RAVENCAL_STATE_SHADOW);
    memory = attached(opened(name).request_id());
    ASSERT_NE(memory, nullptr);
  }

  /// The control loop, until `done`.
  void run_until(const std::atomic<bool>& done) {
    while (!done) {
      rig.tick();
      std::this_thread::sleep_for(std::chrono::microseconds(200));
    }
  }
  /// Asks while the loop runs; the loop ticks until the answer is there.
  control::Answer ask(const control::Request& request, double wait_s = 5.0) {
    std::atomic<bool> answered{false};
    control::Answer answer = control::Answer::kNotTaken;
    std::thread asker([&] {
      const auto result = control::ask(name, request, wait_s, [] { return true; });
      EXPECT_TRUE(result.ok()) << result.error().message;
      if (result.ok()) answer = result.value();
      answered = true;
    });
    run_until(answered);
    asker.join();
    return answer;
  }
  control::Answer ask(std::uint32_t kind) { return ask(control::Request{kind, 1.0F, 7}); }
  /// The program beside the running loop.
  Ended call(const std::string& arguments) {
    std::atomic<bool> done{false};
    Ended ended;
    std::thread program([&] {
      ended = call_control(arguments);
      done = true;
    });
    run_until(done);
    program.join();
    return ended;
  }

  [[nodiscard]] std::uint64_t taken() const { return opened(name).request_taken(); }
  /// A sound request, newer than the one taken last.
  [[nodiscard]] ravencal_request newer(std::uint32_t kind) const {
    return checked({taken() + 1'000'000, RAVENCAL_REQUEST_VERSION, kind, 1.0F, 7, 0});
  }
  void expect_state(std::int32_t state, int ticks = 50) {
    for (int i = 0; i < ticks; ++i) {
      rig.tick();
      ASSERT_EQ(rig.output.state, state);
    }
  }

  const std::string name = telemetry_name("control");
  Rig rig;
  std::uint64_t* memory = nullptr;
};

}  // namespace ravencal::test
