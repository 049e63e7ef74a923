// SPDX-License-Identifier: Apache-2.0
//
// Plays a CANopen encoder node on an interface: position frames that count up by one each.
//   can_sender INTERFACE NODE RATE_HZ FRAMES [FIRST_COUNT]     RATE_HZ 0: as fast as it goes
// Waits where the transmit queue is full, so every frame goes out. Prints the rate reached.
#include <linux/can.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>

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

}  // namespace

int main(int argc, char** argv) {
  if (argc < 5) return 2;
  const double rate_hz = std::atof(argv[3]);
  const long frames = std::atol(argv[4]);
  const long first = argc > 5 ? std::atol(argv[5]) : 0;
  const int socket_fd = socket(PF_CAN, SOCK_RAW, CAN_RAW);
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = static_cast<int>(if_nametoindex(argv[1]));
  if (socket_fd < 0 ||
      bind(socket_fd, reinterpret_cast<sockaddr*>(&address), sizeof(address)) != 0) {
    std::perror(argv[1]);
    return 1;
  }
  can_frame frame{};
  frame.can_id = 0x180U + static_cast<unsigned>(std::atoi(argv[2]));
  frame.can_dlc = 8;
  const std::int64_t start_ns = now_ns();
  for (long i = 0; i < frames; ++i) {
    if (rate_hz > 0.0) wait_until(start_ns + std::llround(1e9 * static_cast<double>(i) / rate_hz));
    const auto count = static_cast<std::uint32_t>(first + i);
    std::memcpy(frame.data, &count, sizeof(count));
    while (write(socket_fd, &frame, sizeof(frame)) != static_cast<ssize_t>(sizeof(frame))) {
      if (errno != ENOBUFS && errno != EAGAIN) {
        std::perror("write");
        return 1;
      }
      wait_until(now_ns() + 100'000);
    }
  }
  const double seconds = static_cast<double>(now_ns() - start_ns) * 1e-9;
  std::printf("frames %ld rate %.0f\n", frames, static_cast<double>(frames) / seconds);
  return 0;
}
