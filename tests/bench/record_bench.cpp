// SPDX-License-Identifier: Apache-2.0
//
// CSV loading against numpy.loadtxt, in one run on one machine, and recording against the 1 kHz
// loop.
//   record_bench [rows]       needs /usr/bin/python3 with numpy; prints JSON
// The file has 252 columns of message values, printed as numpy.savetxt does (%.18e) and short
// (%.7g).
#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <memory>
#include <random>

#include "record/csv_kernel.hpp"
#include "record/load.hpp"
#include "record/recording_writer.hpp"

namespace {

namespace record = ravencal::record;
using Clock = std::chrono::steady_clock;

constexpr int kColumns = 252;
constexpr int kRepeats = 5;

double seconds_of(const std::function<void()>& work) {
  const auto start = Clock::now();
  work();
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// Message values are float32; counts, levels and stamps are whole numbers.
void write_csv(const std::filesystem::path& path, int rows, bool short_form) {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "w"),
                                                             std::fclose);
  std::mt19937 random(1);
  std::array<float, kColumns> spread{};
  for (float& s : spread) s = std::exp(std::normal_distribution<float>(0.0F, 3.0F)(random));
  std::normal_distribution<float> normal(0.0F, 1.0F);
  fmt::memory_buffer line;
  for (int r = 0; r < rows; ++r) {
    line.clear();
    for (int c = 0; c < kColumns; ++c) {
      double value = static_cast<double>(spread[static_cast<std::size_t>(c)] * normal(random));
      if (c == 0) value = 0.01 * r;
      if (c >= 29 && c < 40) value = std::round(value);
      if (c >= 76 && c < 114) value = std::round(1000.0 * value);
      if (short_form && c > 0) {
        fmt::format_to(std::back_inserter(line), "{:.7g}{}", value, c + 1 < kColumns ? ',' : '\n');
      } else {
        fmt::format_to(std::back_inserter(line), "{:.18e}{}", value, c + 1 < kColumns ? ',' : '\n');
      }
    }
    std::fwrite(line.data(), 1, line.size(), file.get());
  }
}

double ravencal_seconds(const std::filesystem::path& path) {
  record::LoadOptions options;
  options.profile = "raven2";
  double best = 1e9;
  for (int i = 0; i < kRepeats; ++i) {
    best = std::min(best, seconds_of([&] {
                      const auto loaded = record::load_recording(path, options);
                      if (!loaded.ok()) fmt::print(stderr, "{}\n", loaded.error().message);
                    }));
  }
  return best;
}

double numpy_seconds(const std::filesystem::path& path) {
  const std::string command = fmt::format(
      "/usr/bin/python3 -c \"import numpy,time\nbest=1e9\nfor i in range(2):\n "
      "t=time.perf_counter();"
      "numpy.loadtxt('{}',delimiter=',');best=min(best,time.perf_counter()-t)\nprint(best)\"",
      path.string());
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> pipe(::popen(command.c_str(), "r"),
                                                             ::pclose);
  double seconds = 0.0;
  if (std::fscanf(pipe.get(), "%lf", &seconds) != 1) fmt::print(stderr, "numpy did not run\n");
  return seconds;
}

/// Peak memory of a process that loads the file, over that of one that loads its first row, in
/// units of the loaded data.
double memory_ratio(const std::filesystem::path& path, const std::filesystem::path& one_row,
                    int rows) {
  const auto peak_kib = [](const std::filesystem::path& file) {
    const pid_t child = ::fork();
    if (child == 0) {
      record::LoadOptions options;
      options.profile = "raven2";
      const auto loaded = record::load_recording(file, options);
      ::_exit(loaded.ok() ? 0 : 1);
    }
    rusage usage{};
    int status = 0;
    ::wait4(child, &status, 0, &usage);
    return static_cast<double>(usage.ru_maxrss);
  };
  const double data_kib = static_cast<double>(rows) * (kColumns - 9 + 1) * 8 / 1024;
  return (peak_kib(path) - peak_kib(one_row)) / data_kib;
}

void bench_load(const std::filesystem::path& folder, int rows, bool short_form) {
  const auto path = folder / "bench.csv";
  const auto one_row = folder / "one_row.csv";
  write_csv(one_row, 1, short_form);
  write_csv(path, rows, short_form);
  const double memory = memory_ratio(path, one_row, rows);
  const double ours = ravencal_seconds(path);
  const double theirs = numpy_seconds(path);
  fmt::print(
      "{{\"bench\":\"load_csv\",\"format\":\"{}\",\"rows\":{},\"columns\":{},\"kernel\":\"{}\","
      "\"ravencal_s\":{:.4f},\"numpy_s\":{:.4f},\"ratio\":{:.1f},\"memory_over_data\":{:.2f}}}\n",
      short_form ? "%.7g" : "%.18e", rows, kColumns,
      record::avx512_csv_kernel() != nullptr ? "avx512" : "portable", ours, theirs, theirs / ours,
      memory);
}

void bench_write(const std::filesystem::path& folder) {
  constexpr int kRows = 20000;
  std::vector<record::Channel> channels;
  for (int c = 0; c < 250; ++c) {
    channels.push_back({fmt::format("c{}", c), "rad", record::Role::kFeature, ""});
  }
  auto writer = record::RecordingWriter::create(folder / "bench.db", {}, channels);
  std::vector<double> row(channels.size());
  std::vector<double> step_s;
  const double total = seconds_of([&] {
    for (int r = 0; r < kRows; ++r) {
      for (std::size_t c = 0; c < row.size(); ++c) row[c] = 1e-3 * r + 0.1 * static_cast<double>(c);
      step_s.push_back(seconds_of([&] { (void)writer->append(1'000'000LL * r, row); }));
    }
    (void)writer->finish();
  });
  std::sort(step_s.begin(), step_s.end());
  fmt::print(
      "{{\"bench\":\"write_recording\",\"channels\":{},\"rows_per_s\":{:.0f},\"times_real_time\":"
      "{:.1f},\"append_us\":{{\"p50\":{:.1f},\"p999\":{:.0f},\"max\":{:.0f}}}}}\n",
      channels.size(), kRows / total, kRows / total / 1000.0, step_s[kRows / 2] * 1e6,
      step_s[kRows * 999 / 1000] * 1e6, step_s.back() * 1e6);
}

}  // namespace

int main(int argc, char** argv) {
  const int rows = argc > 1 ? std::atoi(argv[1]) : 68000;
  std::string name = (std::filesystem::temp_directory_path() / "ravencal_bench_XXXXXX").string();
  const std::filesystem::path folder = ::mkdtemp(name.data());
  bench_write(folder);
  bench_load(folder, rows, false);
  bench_load(folder, rows, true);
  std::filesystem::remove_all(folder);
  return 0;
}
