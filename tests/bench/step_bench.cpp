// SPDX-License-Identifier: Apache-2.0
//
// Time of one whole plugin step (gather, checks, network, envelope), and of a plain dynamic Eigen
// network of the same sizes in the same run. Warm: called again at once. Evicted: after 64 MiB of
// other reads, which is what a control loop sees after a millisecond of other work. Prints; judges
// nothing.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "bench/step_peer.hpp"
#include "rt/rig.hpp"

namespace {

using ravencal::bench::DynamicNetwork;
using ravencal::test::make_model;
using ravencal::test::Rig;

struct Figures {
  double p50_us = 0.0;
  double p99_us = 0.0;
  double max_us = 0.0;
};

/// Something large to read between two calls.
class Eviction {
 public:
  void run() {
    std::uint64_t sum = 0;
    for (std::size_t i = 0; i < memory_.size(); i += 8) sum += memory_[i];
    sink_ = sink_ + sum;
  }

 private:
  std::vector<std::uint64_t> memory_ = std::vector<std::uint64_t>((64U << 20U) / 8, 1);
  volatile std::uint64_t sink_ = 0;
};

template <typename Call>
Figures measure(int repeats, Eviction* eviction, Call call) {
  std::vector<double> times_us;
  for (int i = 0; i < 20; ++i) call();
  for (int i = 0; i < repeats; ++i) {
    if (eviction != nullptr) eviction->run();
    const auto start = std::chrono::steady_clock::now();
    call();
    const std::chrono::duration<double, std::micro> time = std::chrono::steady_clock::now() - start;
    times_us.push_back(time.count());
  }
  std::sort(times_us.begin(), times_us.end());
  const std::size_t n = times_us.size();
  return {times_us[n / 2], times_us[n * 99 / 100], times_us.back()};
}

void print(const std::string& what, const Figures& figures, double peer_us) {
  fmt::print("{:<44}{:>9.2f}{:>9.2f}{:>9.2f}{:>9.2f}\n", what, figures.p50_us, figures.p99_us,
             figures.max_us, peer_us > 0.0 ? figures.p50_us / peer_us : 1.0);
}

void compare(const char* name, std::uint32_t inputs, const std::vector<std::uint32_t>& hidden) {
  std::vector<std::size_t> sizes{inputs};
  sizes.insert(sizes.end(), hidden.begin(), hidden.end());
  sizes.push_back(RAVENCAL_JOINTS);
  DynamicNetwork peer(sizes);
  std::vector<float> x(inputs, 0.5F);
  std::vector<float> y(RAVENCAL_JOINTS);
  const auto run_peer = [&] { peer.run(x, y); };
  Eviction eviction;
  for (const bool evicted : {false, true}) {
    Eviction* const between = evicted ? &eviction : nullptr;
    const int repeats = evicted ? 300 : 20'000;
    const Figures plain = measure(repeats, between, run_peer);
    const char* const cache = evicted ? "evicted" : "warm";
    print(fmt::format("{} {}, plain dynamic Eigen", name, cache), plain, 0.0);
    std::uint32_t last_isa = 0;
    for (const std::uint32_t isa :
         {RAVENCAL_ISA_AVX512, RAVENCAL_ISA_AVX2, RAVENCAL_ISA_BASELINE}) {
      Rig rig(isa);
      rig.load(make_model(inputs, hidden));
      rig.enable();
      rig.tick_until(RAVENCAL_STATE_ACTIVE);
      const std::uint32_t got = rig.instance.info().isa;
      if (got == last_isa) continue;
      last_isa = got;
      const Figures step = measure(repeats, between, [&] { rig.tick(); });
      print(fmt::format("{} {}, plugin step, {}", name, cache, ravencal::host::isa_name(got)), step,
            plain.p50_us);
    }
  }
}

}  // namespace

int main() {
  fmt::print("{:<44}{:>9}{:>9}{:>9}{:>9}\n", "us per call", "p50", "p99", "max", "ratio");
  compare("light 112-128-64-32-3", 112, {128, 64, 32});
  compare("paper 208-600-500-400-3", 208, {600, 500, 400});
  return 0;
}
