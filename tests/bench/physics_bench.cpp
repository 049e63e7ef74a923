// SPDX-License-Identifier: Apache-2.0
//
// How fast the digital twin runs. Prints times real time; decides nothing.
//   physics_bench PLANT.toml [SECONDS]
#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <cstdlib>

#include "physics/raven_twin.hpp"

int main(int argc, char** argv) {
  using namespace ravencal;
  if (argc < 2) {
    fmt::print(stderr, "usage: physics_bench PLANT.toml [SECONDS]\n");
    return 2;
  }
  const auto plant = physics::load_plant(argv[1]);
  if (!plant.ok()) {
    fmt::print(stderr, "{}\n", plant.error().message);
    return 3;
  }
  auto twin = physics::RavenTwin::create(*plant, 1);
  if (!twin.ok()) {
    fmt::print(stderr, "{}\n", twin.error().message);
    return 3;
  }
  const double seconds = argc > 2 ? std::atof(argv[2]) : 60.0;
  twin->home();
  const Eigen::Vector3d start = twin->estimate_ji();
  const auto cycles = static_cast<long>(seconds * plant->robot.control_rate_hz);
  const auto before = std::chrono::steady_clock::now();
  for (long i = 0; i < cycles; ++i) {
    const double t_s = static_cast<double>(i) / plant->robot.control_rate_hz;
    twin->begin_cycle();
    twin->end_cycle(start + std::sin(0.3 * t_s) * Eigen::Vector3d(0.15, 0.2, 0.02));
  }
  const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - before;
  fmt::print(
      "{:.0f} s of robot in {:.2f} s: {:.0f} times real time, {:.2f} us per 1 ms cycle, inner rate "
      "{:.0f} Hz\n",
      seconds, wall.count(), seconds / wall.count(),
      1e6 * wall.count() / static_cast<double>(cycles), plant->robot.inner_rate_hz);
  return 0;
}
