// SPDX-License-Identifier: Apache-2.0
//
// The instructions of one step, counted exactly by callgrind with the AVX2 kernels (it knows no
// AVX-512): the gate on the step's time that no noise can move. See callgrind_steps.cpp for what
// the situations are.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>

namespace {

namespace fs = std::filesystem;

using Counts = std::map<std::string, std::int64_t>;  ///< instructions per situation

/// From one of callgrind's files: its trigger's name and its sum.
void read_counts(const fs::path& path, Counts& counts) {
  std::ifstream file(path);
  std::string name;
  for (std::string line; std::getline(file, line);) {
    const std::string trigger = "desc: Trigger: Client Request: ";
    if (line.starts_with(trigger)) name = line.substr(trigger.size());
    if (line.starts_with("summary: ") && !name.empty()) counts[name] = std::stoll(line.substr(9));
  }
}

/// Counts of a run; empty if it failed.
Counts run(const std::string& network, const std::string& precision) {
  const fs::path folder =
      fs::temp_directory_path() / ("ravencal_callgrind_" + std::to_string(::getpid()));
  fs::create_directories(folder);
  const std::string command =
      "valgrind --tool=callgrind --instr-atstart=no --collect-atstart=no --callgrind-out-file=" +
      (folder / "out").string() + " " RAVENCAL_CALLGRIND_STEPS " " + network + " " + precision +
      " >" + (folder / "log").string() + " 2>&1";
  const int status = std::system(command.c_str());
  Counts counts;
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) {
    for (const auto& entry : fs::directory_iterator(folder)) read_counts(entry.path(), counts);
  }
  if (counts.empty()) {
    std::ifstream log(folder / "log");
    ADD_FAILURE() << command << '\n' << log.rdbuf();
  }
  fs::remove_all(folder);
  return counts;
}

/// The largest difference among the situations whose name starts so.
std::int64_t spread(const Counts& counts, const std::string& start) {
  std::int64_t least = INT64_MAX;
  std::int64_t most = INT64_MIN;
  for (const auto& [name, count] : counts) {
    if (!name.starts_with(start)) continue;
    least = std::min(least, count);
    most = std::max(most, count);
  }
  return most - least;
}

/// A step remembers its longest time, so the clock decides one branch.
constexpr std::int64_t kClock = 4;

struct Gate {
  const char* network;
  const char* precision;
  /// Instructions of one step in ACTIVE, as built by GCC 12 in Release. Change it with the code,
  /// in the same commit, and say why.
  std::int64_t instructions;
};

void PrintTo(const Gate& gate, std::ostream* out) { *out << gate.network << ' ' << gate.precision; }

bool has_valgrind() { return std::system("command -v valgrind >/dev/null 2>&1") == 0; }

class Callgrind : public ::testing::TestWithParam<Gate> {};

TEST_P(Callgrind, AStepStaysWithinItsGateAndItsInstructionsDoNotDependOnTheData) {
  if (!has_valgrind()) GTEST_SKIP() << "valgrind is not installed";
  const Counts counts = run(GetParam().network, GetParam().precision);
  ASSERT_FALSE(counts.empty());
  for (const auto& [name, count] : counts)
    std::printf("%-28s%9lld\n", name.c_str(), static_cast<long long>(count));

  // The network, exactly; the alarm sees a loop that ran once more.
  EXPECT_EQ(spread(counts, "network_"), 0);
  EXPECT_GT(spread(counts, "ring_"), 0);

  // Around it, what the envelope does with the data and the state: at most kBranches instructions.
  constexpr std::int64_t kBranches = 400;
  EXPECT_LE(std::abs(counts.at("step_again") - counts.at("step_zeros")), kClock);
  EXPECT_LE(std::abs(counts.at("step_again") - counts.at("step_denormal")), kClock);
  EXPECT_LE(spread(counts, "means_"), kClock);
  EXPECT_LE(spread(counts, "step_"), kBranches + kClock);
  EXPECT_LE(spread(counts, "state_"), kBranches + kClock);
  EXPECT_LE(spread(counts, "flawed_"), kBranches + kClock);
  EXPECT_LE(std::abs(counts.at("state_active") - counts.at("step_again")), kBranches);

  if (!RAVENCAL_GATED) GTEST_SKIP() << "the gate's numbers are those of GCC's Release build";
  constexpr double kTolerance = 0.03;  // of a patch release of the compiler
  const auto gate = static_cast<double>(GetParam().instructions);
  EXPECT_LE(static_cast<double>(counts.at("state_active")), gate * (1.0 + kTolerance));
  EXPECT_GE(static_cast<double>(counts.at("state_active")), gate * (1.0 - 5.0 * kTolerance))
      << "good; now lower the gate";
}

INSTANTIATE_TEST_SUITE_P(EveryPrecision, Callgrind,
                         ::testing::Values(Gate{"light", "f32", 11'487},
                                           Gate{"light", "bf16", 16'250},
                                           Gate{"light", "int8", 14'262},
                                           Gate{"paper", "int8", 178'774}));

TEST(CallgrindRuns, CountTheSameAgain) {
  if (!has_valgrind()) GTEST_SKIP() << "valgrind is not installed";
  const Counts first = run("light", "int8");
  const Counts second = run("light", "int8");
  ASSERT_EQ(first.size(), second.size());
  for (const auto& [name, count] : first) {
    const bool reads_clock = !name.starts_with("network_") && !name.starts_with("ring_");
    EXPECT_LE(std::abs(count - second.at(name)), reads_clock ? kClock : 0) << name;
  }
}

}  // namespace
