// SPDX-License-Identifier: Apache-2.0
//
// Plays an encoder on the lines of a gpio-sim chip: writes the pulls of A and B (and Z) so that the
// kernel sees the edges of a real one.
//   gpio_sim_driver [-p PID:EDGE:MS] SIM_DIR FIRST_LINE RATE_HZ COUNTS [COUNTS ...]
// Moves by each of COUNTS (negative: backwards) at RATE_HZ edges a second (0: as fast as it goes).
// FIRST_LINE is A, the next B. With -p, process PID is stopped at that edge and goes on MS later.
// Prints the final count and the rate reached.
#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <string>

namespace {

std::int64_t now_ns() {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return std::int64_t{t.tv_sec} * 1'000'000'000 + t.tv_nsec;
}

void wait_until(std::int64_t t_ns) {
  timespec t{};
  t.tv_sec = t_ns / 1'000'000'000;
  t.tv_nsec = t_ns % 1'000'000'000;
  clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, nullptr);
}

int open_pull(const std::string& folder, int line) {
  const std::string path = folder + "/sim_gpio" + std::to_string(line) + "/pull";
  const int file = open(path.c_str(), O_WRONLY);
  if (file < 0) std::perror(path.c_str());
  return file;
}

bool set_level(int file, bool level) {
  const char* text = level ? "pull-up" : "pull-down";
  return pwrite(file, text, std::strlen(text), 0) > 0;
}

/// Stops another process for a while in the middle of the motion.
class Pause {
 public:
  explicit Pause(const char* text) {
    if (std::sscanf(text, "%d:%lld:%lld", &pid_, &edge_, &ms_) != 3) std::exit(2);
  }
  Pause() = default;
  void at(std::int64_t edge) {
    if (pid_ > 0 && edge == edge_) {
      kill(pid_, SIGSTOP);
      until_ns_ = now_ns() + ms_ * 1'000'000;
    } else if (until_ns_ > 0 && now_ns() >= until_ns_) {
      kill(pid_, SIGCONT);
      until_ns_ = 0;
    }
  }
  ~Pause() {
    if (until_ns_ > 0) kill(pid_, SIGCONT);
  }
  Pause(const Pause&) = delete;
  Pause& operator=(const Pause&) = delete;

 private:
  int pid_ = 0;
  long long edge_ = -1;
  long long ms_ = 0;
  std::int64_t until_ns_ = 0;
};

}  // namespace

int main(int argc, char** argv) {
  const bool pauses = argc > 2 && std::strcmp(argv[1], "-p") == 0;
  Pause pause = pauses ? Pause(argv[2]) : Pause();
  if (pauses) {
    argc -= 2;
    argv += 2;
  }
  if (argc < 5) return 2;
  const int first = std::atoi(argv[2]);
  const double rate_hz = std::atof(argv[3]);
  const int line_a = open_pull(argv[1], first);
  const int line_b = open_pull(argv[1], first + 1);
  if (line_a < 0 || line_b < 0) return 1;
  std::int64_t count = 0;
  std::int64_t edges = 0;
  const std::int64_t start_ns = now_ns();
  for (int i = 4; i < argc; ++i) {
    const std::int64_t target = count + std::atoll(argv[i]);
    while (count != target) {
      if (rate_hz > 0.0)
        wait_until(start_ns + std::llround(1e9 * static_cast<double>(edges) / rate_hz));
      const std::int64_t next = count + (target > count ? 1 : -1);
      // Count n has A high for n mod 4 in {1, 2} and B high for n mod 4 in {2, 3}.
      const auto phase = ((next % 4) + 4) % 4;
      const bool moves_a = std::min(count, next) % 2 == 0;
      const bool done =
          moves_a ? set_level(line_a, phase == 1 || phase == 2) : set_level(line_b, phase >= 2);
      if (!done) {
        std::perror("pull");
        return 1;
      }
      count = next;
      pause.at(++edges);
    }
  }
  const double seconds = static_cast<double>(now_ns() - start_ns) * 1e-9;
  std::printf("count %lld edges %lld rate %.0f\n", static_cast<long long>(count),
              static_cast<long long>(edges), static_cast<double>(edges) / seconds);
  return 0;
}
