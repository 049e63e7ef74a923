// SPDX-License-Identifier: Apache-2.0
//
// bench_step: the time of one step of the plugin, through its C ABI, at each precision and
// instruction set, beside the peers that are installed: same weights, same inputs, same run.
// Times are reported, not judged; outputs of the plugin beyond their error bound are a finding.
#include <fmt/format.h>
#include <sched.h>
#include <sys/mman.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>

#include "bench/step_calls.hpp"
#include "bench/step_maximum.hpp"
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
  std::uint64_t maximum_steps = 0;  ///< 0: the table of peers
  Effort effort;
};

struct Row {
  Peer peer;
  PeerTimes times{};
  std::optional<Deviation> deviation;
  double heap_calls = 0.0;
  std::optional<double> system_calls;
};

const std::vector<std::uint32_t> kPaperShape = {208, 600, 500, 400, 3};
const std::vector<std::uint32_t> kLightShape = {112, 128, 64, 32, 3};

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
    peers.back().reference = {kernels_test::reference_forward(task.network, task.inputs), {}};
  }
  return peers;
}

/// The plugin on what `ravencal convert --compact` left of a network: its time depends on the
/// shape.
Peer compacted_peer(const std::vector<std::uint32_t>& shape) {
  Peer peer = plugin_peer(make_task(shape), kernels::Precision::kFloat32, RAVENCAL_ISA_BEST);
  peer.name = fmt::format("ravencal f32 compacted {}", fmt::join(shape, "-"));
  return peer;
}

Deviation deviation_of(const Peer& peer) {
  std::array<float, 16> outputs{};
  if (peer.prepare) peer.prepare();
  peer.step(outputs.data());
  return deviation(*peer.reference, outputs);
}

/// Counts first, because tracing forks: then times, all peers in turn.
std::vector<Row> measure(std::vector<Peer> peers, const Effort& effort) {
  std::vector<Row> rows;
  for (Peer& peer : peers) {
    Row row;
    if (peer.reference) row.deviation = deviation_of(peer);
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
  fmt::print("{:<36}{:>6} {:>8}{:>9}{:>6}{:>6} {:<10}{:>8}{:>8}{:>8}{:>9}{:>7}{:>8}{:>8}\n", "peer",
             "kB", "max|err|", "allowed", "heap", "calls", "setting", "p50_us", "p99", "p99.9",
             "max", "GB/s", "x bound", "x Eigen");
  for (const Row& row : rows) {
    const std::string calls = row.system_calls ? fmt::format("{:.1f}", *row.system_calls) : "?";
    const auto number = [](std::optional<double> value) {
      return value ? fmt::format("{:.1e}", *value) : "-";
    };
    const Deviation off = row.deviation.value_or(Deviation{});
    const std::string error = row.deviation ? number(off.error) : "-";
    for (std::size_t s = 0; s < kSettingNames.size(); ++s) {
      const Quantiles& ns = row.times[s];
      const auto bytes = static_cast<double>(row.peer.weight_bytes);
      fmt::print(
          "{:<36}{:>6.0f} {:>8}{:>9}{:>6.1f}{:>6} "
          "{:<10}{:>8.1f}{:>8.1f}{:>8.1f}{:>9.1f}{:>7.0f}{:>8.2f}{:>8.2f}\n",
          s == 0 ? row.peer.name : "", bytes / 1e3, error, number(off.bound), row.heap_calls, calls,
          kSettingNames[s], ns.p50_ns / 1e3, ns.p99_ns / 1e3, ns.p999_ns / 1e3, ns.max_ns / 1e3,
          bytes / ns.p50_ns, ratio(bound_of(rows, row), row, s), ratio(eigen_row(rows), row, s));
    }
  }
}

nlohmann::json to_json(const std::vector<Row>& rows) {
  nlohmann::json list = nlohmann::json::array();
  for (const Row& row : rows) {
    nlohmann::json entry = {{"peer", row.peer.name},
                            {"weight_bytes", row.peer.weight_bytes},
                            {"heap_calls_per_step", row.heap_calls}};
    if (row.deviation) entry["max_abs_error"] = row.deviation->error;
    if (row.deviation && row.deviation->bound) entry["error_bound"] = *row.deviation->bound;
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

/// Says which peers are beyond their bound; returns how many.
int print_findings(const std::vector<Row>& rows) {
  int findings = 0;
  for (const Row& row : rows) {
    if (!row.deviation || !row.deviation->is_beyond_bound()) continue;
    fmt::print("{}: an output is off by {:.1e}, allowed {:.1e}\n", row.peer.name,
               row.deviation->error, *row.deviation->bound);
    ++findings;
  }
  return findings;
}

nlohmann::json compare_peers(bool paper, const Options& options, int& findings) {
  const Task task = make_task(paper ? kPaperShape : kLightShape);
  std::vector<Peer> peers = all_peers(task, paper);
  if (!options.compacted.empty()) peers.push_back(compacted_peer(options.compacted));
  nlohmann::json report;
  report["network"] = paper ? "208-600-500-400-3" : "112-128-64-32-3";
  report["load_average_before"] = load_average();
  fmt::print("\nnetwork {}, load average {} before\n", report["network"].get<std::string>(),
             load_average());
  for (const Peer& peer : peers) {
    if (!peer.about.empty()) fmt::print("{}\n", peer.about);
    if (!peer.about.empty()) report["about"][peer.name] = peer.about;
    if (peer.skipped.empty()) continue;
    fmt::print("skipped {}: {}\n", peer.name, peer.skipped);
    report["skipped"][peer.name] = peer.skipped;
  }
  std::erase_if(peers, [](const Peer& peer) { return !peer.skipped.empty(); });
  const std::vector<Row> rows = measure(std::move(peers), options.effort);
  print(rows);
  findings += print_findings(rows);
  fmt::print("load average {} after\n", load_average());
  report["load_average_after"] = load_average();
  report["peers"] = to_json(rows);
  return report;
}

/// The longest of many steps, beside that of as many empty ones.
nlohmann::json find_maximum(bool paper, const Options& options) {
  const Task task = make_task(paper ? kPaperShape : kLightShape);
  const std::string isolated = first_line_with("/sys/devices/system/cpu/isolated", "");
  const std::string note = isolation_note(isolated, options.core);
  std::vector<Peer> peers;
  peers.push_back(plugin_peer(task, kernels::Precision::kFloat32, RAVENCAL_ISA_BEST));
  peers.push_back(empty_peer());
  nlohmann::json report = {{"steps", options.maximum_steps}, {"isolation", note}};
  fmt::print("\nnetwork {}, {} steps back to back; {}\n",
             fmt::join(paper ? kPaperShape : kLightShape, "-"), options.maximum_steps, note);
  std::vector<Histogram> histograms;
  for (Peer& peer : peers) {
    histograms.push_back(time_back_to_back(peer, options.maximum_steps));
    report["longest_ns"][peer.name] = histograms.back().longest_ns;
    report["steps_from_2_to_k_ns"][peer.name] = histograms.back().steps;
  }
  fmt::print("{:>12} {:>24} {:>24}\n", "from ns", peers[0].name, peers[1].name);
  for (std::size_t k = 0; k < Histogram::kBins; ++k) {
    if (histograms[0].steps[k] + histograms[1].steps[k] == 0) continue;
    fmt::print("{:>12} {:>24} {:>24}\n", k == 0 ? 0 : std::uint64_t{1} << k, histograms[0].steps[k],
               histograms[1].steps[k]);
  }
  fmt::print("{:>12} {:>24} {:>24}\n", "longest ns", histograms[0].longest_ns,
             histograms[1].longest_ns);
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

bool write_json(const nlohmann::json& report, const std::string& path) {
  std::ofstream file(path);
  file << report.dump(1) << '\n';
  file.close();
  if (!file) fmt::print(stderr, "bench_step: {}: cannot be written\n", path);
  return static_cast<bool>(file);
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
  app.add_option("--maximum", options.maximum_steps,
                 "instead: the longest of so many steps back to back, with the plugin and empty")
      ->check(CLI::PositiveNumber);
  app.footer("Example: bench_step --network paper --bursts 10 --json bench_step.json");
  CLI11_PARSE(app, argc, argv);
  settle(options.core);
  nlohmann::json report;
  report["processor"] = first_line_with("/proc/cpuinfo", "model name");
  fmt::print("processor: {}\n", report["processor"].get<std::string>());
  int findings = 0;
  for (const bool paper : {true, false}) {
    if (options.network == (paper ? "light" : "paper")) continue;
    report["networks"].push_back(options.maximum_steps > 0
                                     ? find_maximum(paper, options)
                                     : compare_peers(paper, options, findings));
  }
  if (!options.json.empty() && !write_json(report, options.json)) return 3;
  return findings == 0 ? 0 : 1;
}

}  // namespace ravencal::bench

int main(int argc, char** argv) { return ravencal::bench::run(argc, argv); }
