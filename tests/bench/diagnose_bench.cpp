// SPDX-License-Identifier: Apache-2.0
//
// diagnose_bench: time and memory of a diagnosis, as a user runs it, beside one plain simulation of
// the same recording, each a process of its own. Reports; judges nothing.
#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace {

namespace fs = std::filesystem;

struct Cost {
  double wall_s = 0.0;
  double processor_s = 0.0;  ///< of all its threads
  double most_memory_mb = 0.0;
};

double seconds(const timeval& time) {
  return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
}

/// What `work` took in a process of its own; nothing unless it returned 0.
std::optional<Cost> cost_of(const std::function<int()>& work) {
  const auto start = std::chrono::steady_clock::now();
  std::fflush(stdout);  // else the child would print it again
  const pid_t child = ::fork();
  if (child < 0) return std::nullopt;
  if (child == 0) ::_exit(std::freopen("/dev/null", "w", stdout) != nullptr ? work() : 127);
  int status = 0;
  rusage usage{};
  if (::wait4(child, &status, 0, &usage) != child || !WIFEXITED(status) || WEXITSTATUS(status) != 0)
    return std::nullopt;
  const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - start;
  return Cost{wall.count(), seconds(usage.ru_utime) + seconds(usage.ru_stime),
              1e-3 * static_cast<double>(usage.ru_maxrss)};
}

int execute(const std::vector<std::string>& words) {
  std::vector<char*> arguments;
  for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  ::execv(arguments[0], arguments.data());
  return 127;
}

constexpr const char* kSimulation = "simulate at 1 kHz";

struct Run {
  const char* what;
  std::function<int()> work;
};

std::vector<Run> runs(const std::string& program, const fs::path& plant, const fs::path& folder,
                      double minutes, int placebos) {
  const std::string trajectory = folder / "motion.csv";
  const std::string recording = folder / "run.db";
  const auto diagnose = [&](int twins) {
    return std::vector<std::string>{program,
                                    "diagnose",
                                    recording,
                                    "--plant",
                                    plant,
                                    "--out",
                                    folder / "diagnosis",
                                    "--placebo",
                                    std::to_string(twins)};
  };
  const auto program_with = [](std::vector<std::string> words) {
    return [words = std::move(words)] { return execute(words); };
  };
  return {
      {"trajectory",
       program_with({program, "trajectory", "sinusoid", "--duration-s",
                     fmt::format("{}", 60.0 * minutes), "--out", trajectory, "--force"})},
      {kSimulation, program_with({program, "simulate", "--plant", plant, "--trajectory", trajectory,
                                  "--rate-hz", "1000", "--out", recording, "--force"})},
      {"diagnose", program_with(diagnose(0))},
      {"diagnose, placebo recordings", program_with(diagnose(placebos))}};
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Times a diagnosis beside one plain simulation of its recording.", "diagnose_bench");
  std::string program;
  std::string plant;
  double minutes = 30.0;
  int placebos = 20;
  app.add_option("ravencal", program, "the program")->required()->check(CLI::ExistingFile);
  app.add_option("plant", plant, "the twin's plant, tools/plants/raven2.toml")
      ->required()
      ->check(CLI::ExistingFile);
  app.add_option("--minutes", minutes, "length of the recording")
      ->check(CLI::Range(0.5, 600.0))
      ->capture_default_str();
  app.add_option("--placebo", placebos, "placebo recordings")->capture_default_str();
  app.footer("Example: diagnose_bench build/release/tools/ravencal tools/plants/raven2.toml");
  CLI11_PARSE(app, argc, argv);

  const fs::path folder =
      fs::temp_directory_path() / fmt::format("ravencal_diagnose_bench_{}", ::getpid());
  fs::create_directories(folder);
  std::optional<Cost> simulation;
  bool all_ran = true;
  fmt::print("{:<26}{:>9}{:>13}{:>12}{:>16}\n", "what", "wall s", "processor s", "memory MB",
             "x simulation");
  for (const Run& run : runs(program, plant, folder, minutes, placebos)) {
    const std::optional<Cost> cost = cost_of(run.work);
    if (!cost) {
      fmt::print(stderr, "diagnose_bench: {} failed\n", run.what);
      all_ran = false;
      break;
    }
    if (run.what == kSimulation) simulation = cost;
    const double ratio = simulation ? cost->processor_s / simulation->processor_s : 0.0;
    fmt::print("{:<26}{:>9.1f}{:>13.1f}{:>12.0f}{:>16}\n", run.what, cost->wall_s,
               cost->processor_s, cost->most_memory_mb,
               simulation ? fmt::format("{:.2f}", ratio) : "");
  }
  fs::remove_all(folder);
  return all_ran ? 0 : 3;
}
