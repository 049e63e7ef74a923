// SPDX-License-Identifier: Apache-2.0
//
// How many edges a second one core takes, from readings in memory through the decoder to a
// recording, as a ratio to what the robot's fastest motion needs.
//   encoder_bench [EDGES]
#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <numbers>
#include <vector>

#include "quadrature_reader/decoder.hpp"
#include "quadrature_reader/encode.hpp"
#include "quadrature_reader/recorder.hpp"

namespace {

using namespace ravencal::quadrature_reader;
namespace fs = std::filesystem;

// 20 deg/s on two joints of 80 000 counts/rev and 20 mm/s on one of 5 um/count.
constexpr double kNeededEdgesPerS = 2.0 * 20.0 / 360.0 * 80'000.0 + 20e-3 / 5e-6;

/// Time of this process on its cores, all threads.
double cpu_seconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

Config three_joints() {
  Config config;
  config.sources.emplace_back();
  for (const char* joint : {"shoulder", "elbow", "insertion"}) {
    EncoderSettings encoder;
    encoder.axis.joint = joint;
    encoder.axis.si_per_count = 2.0 * std::numbers::pi / 80'000.0;
    encoder.axis.zero_counts = 0;
    config.encoders.push_back(encoder);
  }
  return config;
}

/// All three joints in a zig-zag at a third of `rate` edges/s each, merged in time order.
std::vector<Reading> zigzags(std::int64_t edges, double rate) {
  std::vector<Reading> all;
  for (std::uint8_t axis = 0; axis < 3; ++axis) {
    std::vector<std::int64_t> t_ns = {0};
    std::vector<double> counts = {0.0};
    const double leg_counts = 5000.0;
    while (static_cast<double>(t_ns.size()) * leg_counts < static_cast<double>(edges) / 3.0) {
      t_ns.push_back(t_ns.back() + static_cast<std::int64_t>(3e9 * leg_counts / rate));
      counts.push_back(counts.back() > 0.0 ? 0.0 : leg_counts);
    }
    const auto readings = encode_motion(t_ns, counts, {1.0, 0, axis});
    all.insert(all.end(), readings.begin(), readings.end());
  }
  std::stable_sort(all.begin(), all.end(),
                   [](const Reading& x, const Reading& y) { return x.t_ns < y.t_ns; });
  return all;
}

void print(const char* what, std::size_t edges, double seconds) {
  const double rate = static_cast<double>(edges) / seconds;
  fmt::print("{:<44}{:>12.0f} edges/s of one core = {:>6.1f} x the {:.0f} needed\n", what, rate,
             rate / kNeededEdgesPerS, kNeededEdgesPerS);
}

void record(const char* what, const std::vector<Reading>& readings, bool every_edge) {
  const fs::path path = fs::temp_directory_path() / fmt::format("encoder_bench_{}.db", ::getpid());
  const double start = cpu_seconds();
  auto recorder = Recorder::create(three_joints(), path, {every_edge});
  if (!recorder.ok()) {
    fmt::print(stderr, "{}\n", recorder.error().message);
    std::exit(3);
  }
  std::size_t n = 0;
  for (const auto& reading : readings) {
    recorder->take(0, reading);
    if (++n % 256 == 0) {
      recorder->take(0, {reading.t_ns, 0, kEveryAxis, ReadingKind::kAlive, Line::kA, Fault::kNone});
      recorder->write_due();
    }
  }
  const bool fine = recorder->finish().ok();
  print(what, readings.size(), cpu_seconds() - start);
  if (!fine || recorder->axes()[0].losses() != 0)
    fmt::print("  with losses or errors: the figure means nothing\n");
  fs::remove(path);
}

}  // namespace

int main(int argc, char** argv) {
  const std::int64_t edges = argc > 1 ? std::atoll(argv[1]) : 2'000'000;
  const auto readings = zigzags(edges, kNeededEdgesPerS);
  const double start = cpu_seconds();
  QuadratureDecoder decoders[3];
  for (const auto& reading : readings) {
    auto& decoder = decoders[reading.axis];
    if (reading.kind == ReadingKind::kLevels) {
      decoder.on_levels((reading.value & 1) != 0, (reading.value & 2) != 0);
    } else {
      decoder.on_edge(reading.line, reading.value != 0);
    }
  }
  print("decoded", readings.size(), cpu_seconds() - start);
  if (decoders[0].uncertainty_counts() != 0) return 1;
  record("decoded, sampled at 1 kHz and recorded", readings, false);
  record("decoded and every edge recorded", readings, true);
  const auto fast = zigzags(edges, 1e6);
  record("the same motion at 10^6 edges/s, sampled", fast, false);
  return 0;
}
