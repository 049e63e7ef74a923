// SPDX-License-Identifier: Apache-2.0
//
// bench_step [paper|light] [ROUNDS] [CORE]: time of one forward pass of every peer, same weights,
// same inputs, and of a whole step of the plugin; rounds interleaved, in three settings: warm;
// after 64 MiB of other reads (every cache evicted); and in a 1 ms clock_nanosleep loop. Beside
// them the bound: reading as many bytes. Reports, judges nothing.
#include <fmt/format.h>
#include <linux/seccomp.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <ctime>
#include <map>

#include "bench/step_peers.hpp"
#include "rt_plugin/fp_mode.hpp"

extern "C" void* __libc_malloc(std::size_t bytes);

namespace {
std::atomic<long> allocations{0};
}

extern "C" void* malloc(std::size_t bytes) {
  allocations.fetch_add(1, std::memory_order_relaxed);
  return __libc_malloc(bytes);
}

namespace ravencal::bench {
namespace {

constexpr std::size_t kEvictBytes = std::size_t{64} << 20U;
constexpr std::int64_t kPeriodNs = 1'000'000;

std::int64_t now_ns() {
  timespec t = {};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return t.tv_sec * 1'000'000'000LL + t.tv_nsec;
}

/// Sums a buffer as fast as one core can: what no kernel can beat.
[[gnu::noinline, gnu::optimize("O3"), gnu::target("arch=x86-64-v4")]] float read_all_512(
    const float* at, std::size_t floats) {
  using Line = float __attribute__((vector_size(64)));
  Line sums[8] = {};
  for (std::size_t i = 0; i + 128 <= floats; i += 128) {
    for (std::size_t v = 0; v < 8; ++v) {
      sums[v] += *reinterpret_cast<const Line*>(at + i + 16 * v);
    }
  }
  Line all = {};
  for (const Line& sum : sums) all += sum;
  return all[0];
}

[[gnu::noinline]] float read_all(const float* at, std::size_t floats) {
  using Four = float __attribute__((vector_size(16)));
  Four sums[8] = {};
  for (std::size_t i = 0; i + 32 <= floats; i += 32) {
    for (std::size_t v = 0; v < 8; ++v) sums[v] += *reinterpret_cast<const Four*>(at + i + 4 * v);
  }
  Four all = {};
  for (const Four& sum : sums) all += sum;
  return all[0];
}

float read_bytes(const std::byte* at, std::size_t bytes) {
  static const bool wide = kernels::is_supported(kernels::Isa::kAvx512);
  const auto* floats = reinterpret_cast<const float*>(at);
  return wide ? read_all_512(floats, bytes / 4) : read_all(floats, bytes / 4);
}

Peer bound_peer(std::size_t bytes) {
  const std::shared_ptr<std::byte[]> block = kernels_test::aligned_bytes(bytes + 512);
  std::fill_n(block.get(), bytes + 512, std::byte{1});
  auto step = [block, bytes](const float*, float* y) {
    y[0] = read_bytes(block.get(), bytes + 511);
  };
  return {fmt::format("bound: read {:.0f} kB", static_cast<double>(bytes) / 1e3), bytes, step, {}};
}

Peer own_peer(const kernels_test::Network& network, kernels::Precision precision,
              kernels::Isa isa) {
  const char* const precisions[] = {"f32", "bf16", "int8"};
  Peer peer{
      fmt::format("ravencal {} {}", precisions[static_cast<int>(precision)], kernels::name_of(isa)),
      0,
      {},
      {}};
  if (!kernels::is_supported(isa)) {
    peer.skipped = "this processor does not have it";
    return peer;
  }
  const auto packed = std::make_shared<kernels_test::Packed>(network, precision);
  peer.weight_bytes = packed->bytes();
  const auto forward = kernels::forward_for(isa);
  peer.step = [packed, forward](const float* x, float* y) {
    const rt::FlushDenormals flush;
    forward(packed->view(), x, y, packed->scratch());
  };
  return peer;
}

struct Samples {
  std::vector<double> warm_ns, evicted_ns, paced_ns;
};

double quantile(std::vector<double>& values, double q) {
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  return values[std::min(values.size() - 1,
                         static_cast<std::size_t>(q * static_cast<double>(values.size())))];
}

class Bench {
 public:
  Bench(const kernels_test::Network& network, std::vector<Peer> peers)
      : peers_(std::move(peers)), samples_(peers_.size()), inputs_(network.front().inputs) {
    std::mt19937 random(2);
    std::normal_distribution<float> normal;
    for (float& input : inputs_) input = std::clamp(normal(random), -6.0F, 6.0F);
    expected_ = kernels_test::reference_forward(network, inputs_);
    evict_ = kernels_test::aligned_bytes(kEvictBytes);
    std::fill_n(evict_.get(), kEvictBytes, std::byte{1});
  }

  void run(int rounds) {
    constexpr int kWarmSteps = 50;
    for (int round = 0; round < rounds; ++round) {
      for (std::size_t p = 0; p < peers_.size(); ++p) {
        for (int i = 0; i < kWarmSteps / 5; ++i) time_step(p);
        for (int i = 0; i < kWarmSteps; ++i) samples_[p].warm_ns.push_back(time_step(p));
        outputs_[1] += read_bytes(evict_.get(), kEvictBytes);
        samples_[p].evicted_ns.push_back(time_step(p));
      }
    }
    constexpr int kPacedBlock = 50;
    for (int round = 0; round < rounds / 10; ++round) {
      for (std::size_t p = 0; p < peers_.size(); ++p) run_paced(p, kPacedBlock);
    }
  }

  void print() {
    std::map<std::size_t, Samples*> bounds;
    Samples* eigen = nullptr;
    for (std::size_t p = 0; p < peers_.size(); ++p) {
      if (peers_[p].name.starts_with("bound")) bounds[peers_[p].weight_bytes] = &samples_[p];
      if (peers_[p].name.starts_with("eigen")) eigen = &samples_[p];
    }
    fmt::print("{:<28}{:>8} {:>9} {:<8}{:>9}{:>9}{:>9}{:>9}{:>9}{:>9}{:>7}\n", "peer", "kB",
               "max|err|", "setting", "p50_ns", "p99", "p99.9", "max", "x bound", "x eigen",
               "allocs");
    for (std::size_t p = 0; p < peers_.size(); ++p) print_peer(p, bounds, eigen);
  }

 private:
  double time_step(std::size_t p) {
    const std::int64_t before = now_ns();
    peers_[p].step(inputs_.data(), outputs_);
    return static_cast<double>(now_ns() - before);
  }

  void run_paced(std::size_t p, int ticks) {
    std::int64_t next = now_ns() + kPeriodNs;
    for (int tick = 0; tick < ticks; ++tick, next += kPeriodNs) {
      const timespec wake = {next / 1'000'000'000LL, next % 1'000'000'000LL};
      clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &wake, nullptr);
      const double ns = time_step(p);
      if (tick > 0) samples_[p].paced_ns.push_back(ns);
    }
  }

  double max_error(std::size_t p) {
    std::fill_n(outputs_, expected_.size(), 0.0F);
    peers_[p].step(inputs_.data(), outputs_);
    double worst = 0.0;
    for (std::size_t j = 0; j < expected_.size(); ++j) {
      worst = std::max(worst, std::abs(double{outputs_[j]} - expected_[j]));
    }
    return worst;
  }

  double allocations_per_step(std::size_t p) {
    constexpr int kSteps = 1000;
    const long before = allocations.load();
    for (int i = 0; i < kSteps; ++i) peers_[p].step(inputs_.data(), outputs_);
    return static_cast<double>(allocations.load() - before) / kSteps;
  }

  void print_peer(std::size_t p, std::map<std::size_t, Samples*>& bounds, Samples* eigen) {
    const Peer& peer = peers_[p];
    const bool is_bound = peer.name.starts_with("bound");
    auto bound = bounds.lower_bound(peer.weight_bytes);
    if (bound == bounds.end()) bound = std::prev(bound);
    const std::tuple<const char*, std::vector<double> Samples::*> settings[] = {
        {"warm", &Samples::warm_ns},
        {"evicted", &Samples::evicted_ns},
        {"1 ms", &Samples::paced_ns}};
    const std::string error =
        is_bound || !peer.runs_these_weights ? "-" : fmt::format("{:.1e}", max_error(p));
    const double allocated = allocations_per_step(p);
    for (const auto& [name, member] : settings) {
      auto& ns = samples_[p].*member;
      const double p50 = quantile(ns, 0.5);
      const double to_bound = p50 / quantile(bound->second->*member, 0.5);
      const double to_eigen = eigen == nullptr ? 0.0 : p50 / quantile(eigen->*member, 0.5);
      fmt::print(
          "{:<28}{:>8.0f} {:>9} {:<8}{:>9.0f}{:>9.0f}{:>9.0f}{:>9.0f}{:>9.2f}{:>9.2f}{:>7.1f}\n",
          peer.name, static_cast<double>(peer.weight_bytes) / 1e3, error, name, p50,
          quantile(ns, 0.99), quantile(ns, 0.999), ns.empty() ? 0.0 : ns.back(), to_bound, to_eigen,
          allocated);
    }
  }

  std::vector<Peer> peers_;
  std::vector<Samples> samples_;
  std::vector<float> inputs_;
  std::vector<double> expected_;
  kernels_test::AlignedBytes evict_;
  float outputs_[16] = {};
};

/// Runs steps in a child that the kernel kills at its first system call other than read, write and
/// exit. Returns whether it survived.
bool makes_no_system_call(const Peer& peer, const std::vector<float>& inputs) {
  const pid_t child = fork();
  if (child == 0) {
    float outputs[16];
    if (prctl(PR_SET_SECCOMP, SECCOMP_MODE_STRICT) != 0) syscall(SYS_exit, 1);
    for (int i = 0; i < 10000; ++i) peer.step(inputs.data(), outputs);
    syscall(SYS_exit, 0);
  }
  int status = 1;
  waitpid(child, &status, 0);
  return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

int run(int argc, char** argv) {
  const std::string_view which = argc > 1 ? argv[1] : "paper";
  const int rounds = argc > 2 ? std::max(std::atoi(argv[2]), 1) : 400;
  if (which != "paper" && which != "light") {
    fmt::print(stderr, "usage: bench_step [paper|light] [ROUNDS] [CORE]\n");
    return 2;
  }
  cpu_set_t cores;
  CPU_ZERO(&cores);
  CPU_SET(argc > 3 ? static_cast<unsigned>(std::atoi(argv[3])) : 0U, &cores);
  if (sched_setaffinity(0, sizeof(cores), &cores) != 0) fmt::print("not pinned to a core\n");
  mlockall(MCL_CURRENT | MCL_FUTURE);

  std::mt19937 random(1);
  const auto network = kernels_test::paper_like_network(
      which == "paper" ? std::vector<std::uint32_t>{208, 600, 500, 400, 3}
                       : std::vector<std::uint32_t>{112, 128, 64, 32, 3},
      random);
  std::vector<Peer> peers;
  for (const auto precision :
       {kernels::Precision::kFloat32, kernels::Precision::kBfloat16, kernels::Precision::kInt8}) {
    peers.push_back(bound_peer(kernels_test::Packed(network, precision).bytes()));
    for (int isa = kernels::kIsaCount - 1; isa >= 0; --isa) {
      peers.push_back(own_peer(network, precision, static_cast<kernels::Isa>(isa)));
    }
    peers.push_back(plugin_peer(network, precision));
  }
  for (const auto& make : {eigen_peer, torch_peer, rtneural_peer}) {
    peers.push_back(make(network));
  }
  for (const Peer& peer : peers) {
    if (!peer.skipped.empty()) fmt::print("skipped {}: {}\n", peer.name, peer.skipped);
  }
  std::erase_if(peers, [](const Peer& peer) { return !peer.skipped.empty(); });
  const std::vector<float> inputs(network.front().inputs, 0.5F);
  for (const Peer& peer : peers) {
    if (peer.name.starts_with("ravencal") && !makes_no_system_call(peer, inputs)) {
      fmt::print("{} makes system calls\n", peer.name);
    }
  }
  fmt::print("network {}, {} rounds; own peers were run 10000 steps in strict seccomp\n", which,
             rounds);
  Bench bench(network, std::move(peers));
  bench.run(rounds);
  bench.print();
  return 0;
}

}  // namespace
}  // namespace ravencal::bench

int main(int argc, char** argv) { return ravencal::bench::run(argc, argv); }
