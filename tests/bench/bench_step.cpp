// SPDX-License-Identifier: Apache-2.0
//
// bench_step: the time of one step of the plugin, through its C ABI, at each precision and
// instruction set, beside the peers that are installed: same weights, same inputs, same run.
// Reports; judges nothing.
#include <fmt/format.h>
#include <sched.h>
#include <sys/mman.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>

#include "bench/step_calls.hpp"
#include "bench/step_settings.hpp"
#include "ravencal/plugin.h"

namespace ravencal::bench {
namespace {

constexpr std::string_view kBoundName = "bound";
constexpr std::string_view kEigenName = "Eigen";

struct Options {
  std::string network = "both";
  std::string json;
  std::vector<std::uint32_t> compacted;  ///< inputs, units of each layer, outputs; empty: none
  unsigned core = 0;
  Effort effort;
};

struct Row {
  Peer peer;
  PeerTimes times{};
  std::optional<double> max_error;  ///< against the double reference; nothing for the bound
  double heap_calls = 0.0;
  std::optional<double> system_calls;
};

const std::vector<std::uint32_t> kPaperShape = {208, 600, 500, 400, 3};
const std::vector<std::uint32_t> kLightShape = {112, 128, 64, 32, 3};

Task make_task(const std::vector<std::uint32_t>& shape) {
  std::mt19937 random(1);
  Task task;
  task.network = kernels_test::paper_like_network(shape, random);
  std::uniform_real_distribution<float> uniform(-0.9F, 0.9F);
  task.inputs.resize(task.network.front().inputs);
  for (float& input : task.inputs) input = uniform(random);
  return task;
}

std::vector<Peer> all_peers(const Task& task, bool paper) {
  std::vector<Peer> peers;
  for (const auto precision :
       {kernels::Precision::kFloat32, kernels::Precision::kBfloat16, kernels::Precision::kInt8}) {
    std::size_t bytes = 0;
    const std::size_t first = peers.size();
#if defined(__x86_64__)
    constexpr std::uint32_t kIsas[] = {RAVENCAL_ISA_AVX512_VNNI, RAVENCAL_ISA_AVX512,
                                       RAVENCAL_ISA_AVX2, RAVENCAL_ISA_BASELINE};
#else
    constexpr std::uint32_t kIsas[] = {RAVENCAL_ISA_NEON};
#endif
    for (const std::uint32_t isa : kIsas) {
      peers.push_back(plugin_peer(task, precision, isa));
      bytes = std::max(bytes, peers.back().weight_bytes);
    }
    peers.push_back(kernel_peer(task, precision));
    if (paper) peers.push_back(gru_peer(precision));
    peers.insert(peers.begin() + static_cast<std::ptrdiff_t>(first), bound_peer(bytes));
  }
  for (const auto& make : {eigen_peer, onnx_runtime_peer, torch_peer, rtneural_peer}) {
    peers.push_back(make(task));
  }
  return peers;
}

/// The plugin on what `ravencal convert --compact` left of a network: its time depends on the
/// shape.
Peer compacted_peer(const std::vector<std::uint32_t>& shape) {
  Peer peer = plugin_peer(make_task(shape), kernels::Precision::kFloat32, RAVENCAL_ISA_BEST);
  peer.name = fmt::format("ravencal f32 compacted {}", fmt::join(shape, "-"));
  peer.runs_task = false;
  return peer;
}

double max_error(const Peer& peer, const std::vector<double>& expected) {
  std::array<float, 16> outputs{};
  if (peer.prepare) peer.prepare();
  peer.step(outputs.data());
  double worst = 0.0;
  for (std::size_t j = 0; j < expected.size(); ++j) {
    worst = std::max(worst, std::abs(static_cast<double>(outputs[j]) - expected[j]));
  }
  return worst;
}

/// Counts first, because tracing forks: then times, all peers in turn.
std::vector<Row> measure(const Task& task, std::vector<Peer> peers, const Effort& effort) {
  const std::vector<double> expected = kernels_test::reference_forward(task.network, task.inputs);
  std::vector<Row> rows;
  for (Peer& peer : peers) {
    Row row;
    if (peer.runs_task) row.max_error = max_error(peer, expected);
    row.heap_calls = heap_calls_per_step(peer);
    row.system_calls = system_calls_per_step(peer);
    rows.push_back(std::move(row));
  }
  const std::vector<PeerTimes> times = time_peers(peers, effort);
  for (std::size_t p = 0; p < rows.size(); ++p) {
    rows[p].peer = std::move(peers[p]);
    rows[p].times = times[p];
  }
  return rows;
}

/// The bound of as many bytes, or of the next fewer: f32 peers without padding.
const Row* bound_of(const std::vector<Row>& rows, const Row& row) {
  const Row* best = nullptr;
  for (const Row& other : rows) {
    if (!other.peer.name.starts_with(kBoundName)) continue;
    const auto distance = [&](const Row& bound) {
      return std::abs(static_cast<double>(bound.peer.weight_bytes) -
                      static_cast<double>(row.peer.weight_bytes));
    };
    if (best == nullptr || distance(other) < distance(*best)) best = &other;
  }
  return best;
}

double ratio(const Row* to, const Row& row, std::size_t setting) {
  return to == nullptr ? 0.0 : row.times[setting].p50_ns / to->times[setting].p50_ns;
}

const Row* eigen_row(const std::vector<Row>& rows) {
  const auto it = std::find_if(rows.begin(), rows.end(), [](const Row& row) {
    return row.peer.name.starts_with(kEigenName);
  });
  return it == rows.end() ? nullptr : &*it;
}

void print(const std::vector<Row>& rows) {
  fmt::print("{:<36}{:>6} {:>8}{:>6}{:>6} {:<10}{:>8}{:>8}{:>8}{:>9}{:>7}{:>8}{:>8}\n", "peer",
             "kB", "max|err|", "heap", "calls", "setting", "p50_us", "p99", "p99.9", "max", "GB/s",
             "x bound", "x Eigen");
  for (const Row& row : rows) {
    const std::string calls = row.system_calls ? fmt::format("{:.1f}", *row.system_calls) : "?";
    const std::string error = row.max_error ? fmt::format("{:.0e}", *row.max_error) : "-";
    for (std::size_t s = 0; s < kSettingNames.size(); ++s) {
      const Quantiles& ns = row.times[s];
      const auto bytes = static_cast<double>(row.peer.weight_bytes);
      fmt::print(
          "{:<36}{:>6.0f} {:>8}{:>6.1f}{:>6} "
          "{:<10}{:>8.1f}{:>8.1f}{:>8.1f}{:>9.1f}{:>7.0f}{:>8.2f}{:>8.2f}\n",
          s == 0 ? row.peer.name : "", bytes / 1e3, error, row.heap_calls, calls, kSettingNames[s],
          ns.p50_ns / 1e3, ns.p99_ns / 1e3, ns.p999_ns / 1e3, ns.max_ns / 1e3, bytes / ns.p50_ns,
          ratio(bound_of(rows, row), row, s), ratio(eigen_row(rows), row, s));
    }
  }
}

nlohmann::json to_json(const std::vector<Row>& rows) {
  nlohmann::json list = nlohmann::json::array();
  for (const Row& row : rows) {
    nlohmann::json entry = {{"peer", row.peer.name},
                            {"weight_bytes", row.peer.weight_bytes},
                            {"heap_calls_per_step", row.heap_calls}};
    if (row.max_error) entry["max_abs_error"] = *row.max_error;
    if (row.system_calls) entry["system_calls_per_step"] = *row.system_calls;
    for (std::size_t s = 0; s < kSettingNames.size(); ++s) {
      const Quantiles& ns = row.times[s];
      entry["settings"][kSettingNames[s]] = {{"p50_ns", ns.p50_ns},
                                             {"p99_ns", ns.p99_ns},
                                             {"p999_ns", ns.p999_ns},
                                             {"max_ns", ns.max_ns},
                                             {"to_bound", ratio(bound_of(rows, row), row, s)}};
    }
    list.push_back(std::move(entry));
  }
  return list;
}

std::string first_line_with(const char* path, std::string_view key) {
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with(key))
      return line.substr(line.find(':') == std::string::npos ? 0 : line.find(':') + 2);
  }
  return {};
}

std::string load_average() { return first_line_with("/proc/loadavg", "").substr(0, 14); }

nlohmann::json run_network(bool paper, const Options& options) {
  const Task task = make_task(paper ? kPaperShape : kLightShape);
  std::vector<Peer> peers = all_peers(task, paper);
  if (!options.compacted.empty()) peers.push_back(compacted_peer(options.compacted));
  nlohmann::json report;
  report["network"] = paper ? "208-600-500-400-3" : "112-128-64-32-3";
  report["load_average_before"] = load_average();
  fmt::print("\nnetwork {}, load average {} before\n", report["network"].get<std::string>(),
             load_average());
  for (const Peer& peer : peers) {
    if (peer.skipped.empty()) continue;
    fmt::print("skipped {}: {}\n", peer.name, peer.skipped);
    report["skipped"][peer.name] = peer.skipped;
  }
  std::erase_if(peers, [](const Peer& peer) { return !peer.skipped.empty(); });
  const std::vector<Row> rows = measure(task, std::move(peers), options.effort);
  print(rows);
  fmt::print("load average {} after\n", load_average());
  report["load_average_after"] = load_average();
  report["peers"] = to_json(rows);
  return report;
}

/// Asks for real-time scheduling as a control process does; prints what is refused.
void settle(unsigned core) {
  cpu_set_t cores;
  CPU_ZERO(&cores);
  CPU_SET(core, &cores);
  if (sched_setaffinity(0, sizeof cores, &cores) != 0) fmt::print("not pinned to a core\n");
  if (mlockall(MCL_CURRENT | MCL_FUTURE) != 0) fmt::print("memory is not locked\n");
}

}  // namespace

int run(int argc, char** argv) {
  CLI::App app("Times one step of the plugin beside its peers.", "bench_step");
  Options options;
  app.add_option("--network", options.network, "paper, light or both")
      ->check(CLI::IsMember({"paper", "light", "both"}))
      ->capture_default_str();
  app.add_option("--json", options.json, "also write the figures to this file");
  app.add_option("--compacted", options.compacted,
                 "also the shape that ravencal convert --compact left, such as 9,7,6,5,3")
      ->delimiter(',');
  app.add_option("--core", options.core, "processor to run on")->capture_default_str();
  app.add_option("--bursts", options.effort.bursts, "rounds over all peers")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  app.add_option("--ticks", options.effort.loop_ticks, "ticks of the 1 ms loop per burst and peer")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  app.footer("Example: bench_step --network paper --bursts 10 --json bench_step.json");
  CLI11_PARSE(app, argc, argv);
  settle(options.core);
  nlohmann::json report;
  report["processor"] = first_line_with("/proc/cpuinfo", "model name");
  fmt::print("processor: {}\n", report["processor"].get<std::string>());
  if (options.network != "light") report["networks"].push_back(run_network(true, options));
  if (options.network != "paper") report["networks"].push_back(run_network(false, options));
  if (options.json.empty()) return 0;
  std::ofstream file(options.json);
  file << report.dump(1) << '\n';
  file.close();
  if (file) return 0;
  fmt::print(stderr, "bench_step: {}: cannot be written\n", options.json);
  return 3;
}

}  // namespace ravencal::bench

int main(int argc, char** argv) { return ravencal::bench::run(argc, argv); }
