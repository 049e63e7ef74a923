// SPDX-License-Identifier: Apache-2.0
//
// diagnose_bench: time and memory of a whole diagnosis, as a user runs it, and of its screening
// alone, beside one plain simulation of the same recording, each a process of its own. Reports;
// judges nothing. Screening is what equation error can say, from the file on: the mismatch located
// and effects selected among all candidates on every channel; no limits, free run or report.
#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "diagnose/channel/channel.hpp"
#include "physics/plant.hpp"
#include "record/load.hpp"

namespace {

namespace fs = std::filesystem;
namespace diagnose = ravencal::diagnose;
namespace physics = ravencal::physics;
namespace record = ravencal::record;

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

void screen_channel(const diagnose::Series& series, const physics::Plant& plant) {
  diagnose::ChannelOptions options;
  options.details = false;
  diagnose::ChannelFindings findings;
  if (series.stage == diagnose::Stage::kCommand) {
    findings = diagnose::analyse_command(series, plant, options);
  } else {
    const auto fit = diagnose::fit_channel(series, plant, options, findings);
    diagnose::add_location(*fit, options, findings);
  }
}

int screen_recording(const fs::path& recording, const fs::path& plant_file) {
  const auto plant = physics::load_plant(plant_file);
  if (!plant) return 1;
  record::LoadOptions options;
  options.keep = [&](const record::Channel& channel) {
    return channel.role != record::Role::kFeature &&  // a robot's recording has hundreds of them
           (channel.joint.empty() || plant.value().joint_index(channel.joint).has_value());
  };
  auto loaded = record::load_recording(recording, options);
  if (!loaded) return 1;
  std::vector<record::Recording> recordings;
  recordings.push_back(std::move(loaded).value());
  const auto set = diagnose::build_series(recordings, {}, plant.value(), {});
  recordings.clear();
  if (!set) return 1;
  const std::vector<diagnose::Series>& series = set.value().series;
  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    for (std::size_t i = next++; i < series.size(); i = next++)
      screen_channel(series[i], plant.value());
  };
  std::vector<std::thread> threads;
  for (unsigned t = 0; t < std::max(1U, std::thread::hardware_concurrency()); ++t)
    threads.emplace_back(work);
  for (std::thread& thread : threads) thread.join();
  return 0;
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
      {"screening", [=] { return screen_recording(recording, plant); }},
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
