// SPDX-License-Identifier: Apache-2.0
//
// Commands that write, ended by SIGKILL, SIGTERM and SIGINT at moments spread over their run: what
// has the name of an output is the old file or the new one, whole. A few moments each;
// RAVENCAL_KILLS=100 asks for more.
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <map>
#include <set>
#include <thread>
#include <vector>

#include "cli/interrupt.hpp"
#include "unit/files_rig.hpp"

namespace ravencal::test {
namespace {
namespace fs = std::filesystem;

using Clock = std::chrono::steady_clock;
using Contents = std::map<std::string, std::string>;  // of each output, by its name

const std::string kPublished = RAVENCAL_SOURCE_DIR "/tools/plants/raven2_published.toml";
const std::string kOld = "what was there before\n";

int kills() {
  const char* const wanted = std::getenv("RAVENCAL_KILLS");
  return wanted == nullptr ? 6 : std::atoi(wanted);
}

struct Command {
  std::string name;
  std::string arguments;             ///< outputs are OUT, OUT.2
  std::vector<std::string> outputs;  ///< their names
};

void PrintTo(const Command& command, std::ostream* out) { *out << command.name; }

class KilledCommand : public FilesRig, public testing::WithParamInterface<Command> {
 protected:
  void SetUp() override {
    run_folder_ = folder_ / "run";
    fs::create_directories(run_folder_ / "tmp");
  }
  void TearDown() override { fs::remove_all(run_folder_); }

  /// The old outputs, and nothing else.
  void restore() const {
    fs::remove_all(run_folder_);
    fs::create_directories(run_folder_ / "tmp");
    for (const std::string& output : GetParam().outputs)
      std::ofstream(run_folder_ / output) << kOld;
  }

  [[nodiscard]] pid_t start() const {
    const std::string line =
        fmt::format("cd {} && TMPDIR={}/tmp exec {} {} > /dev/null 2>&1", run_folder_.string(),
                    run_folder_.string(), kProgram, GetParam().arguments);
    const pid_t child = ::fork();
    if (child == 0) {
      ::execl("/bin/sh", "sh", "-c", line.c_str(), nullptr);
      ::_exit(127);
    }
    return child;
  }

  static int status_of(pid_t child) {
    int status = 0;
    ::waitpid(child, &status, 0);
    return status;
  }

  [[nodiscard]] Contents contents() const {
    Contents found;
    for (const std::string& output : GetParam().outputs)
      found[output] = bytes_of(run_folder_ / output);
    return found;
  }

  /// Files that are neither outputs nor folders.
  [[nodiscard]] std::set<std::string> leftovers() const {
    std::set<std::string> names;
    for (const auto& entry : fs::recursive_directory_iterator(run_folder_)) {
      const std::string name = entry.path().lexically_relative(run_folder_).string();
      if (name != "tmp" && contents().count(name) == 0) names.insert(name);
    }
    return names;
  }

  fs::path run_folder_;
};

TEST_P(KilledCommand, LeavesTheOldOrTheNewWhole) {
  restore();
  const auto begun = Clock::now();
  ASSERT_EQ(status_of(start()), 0) << GetParam().arguments;
  const auto whole = Clock::now() - begun;
  const Contents made = contents();
  for (const auto& [name, bytes] : made) ASSERT_NE(bytes, kOld) << name;
  ASSERT_EQ(leftovers(), std::set<std::string>());
  std::map<int, int> ended;  // by the exit status
  int old_ones = 0;
  for (int i = 0; i < kills(); ++i) {
    const int signal_number = i % 3 == 0 ? SIGTERM : i % 3 == 1 ? SIGKILL : SIGINT;
    restore();
    const pid_t child = start();
    std::this_thread::sleep_for(whole * (i + 1) / (kills() + 1));
    ::kill(child, signal_number);
    const int status = status_of(child);
    ++ended[WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status)];
    const std::string when = fmt::format("signal {} at {} of {}", signal_number, i + 1, kills());
    for (const auto& [name, bytes] : contents()) {
      EXPECT_TRUE(bytes == kOld || bytes == made.at(name)) << name << ", " << when;
      old_ones += bytes == kOld ? 1 : 0;
    }
    if (signal_number != SIGKILL) {
      // Before main() has said what signals do, and in the shell, they end the process at once.
      const bool is_told = status == 0 || status == signal_number ||
                           (WIFEXITED(status) && WEXITSTATUS(status) == 128 + signal_number);
      EXPECT_TRUE(is_told) << "status " << status << ", " << when;
      EXPECT_EQ(leftovers(), std::set<std::string>()) << when;
    }
    for (const std::string& name : leftovers()) {
      const bool is_partial =
          name.find(".partial") != std::string::npos || name.starts_with("tmp/");
      EXPECT_TRUE(is_partial) << name << ", " << when;
    }
  }
  std::printf("%s: %.2f s; %d kills, %d outputs old; ended by", GetParam().name.c_str(),
              std::chrono::duration<double>(whole).count(), kills(), old_ones);
  for (const auto& [status, count] : ended) std::printf(" %d: %d", status, count);
  std::printf("\n");
}

const std::vector<Command> kCommands = {
    {"trajectory", "trajectory sinusoid --duration-s 3000 --force --out OUT", {"OUT"}},
    {"simulate",
     "simulate --plant " + kPlant + " --trajectory ../t.csv --force --out OUT",
     {"OUT"}},
    {"simulate_edges",
     "simulate --plant " + kPlant + " --trajectory ../t.csv --force --out OUT --edges OUT.2",
     {"OUT", "OUT.2"}},
    {"simulate_follow",
     "simulate --plant " + kPlant + " --follow ../s.db --force --out OUT",
     {"OUT"}},
    {"import", "import ../s.csv --profile generic --overwrite --out OUT", {"OUT"}},
    {"export_csv", "export ../s.db --overwrite --out OUT.csv", {"OUT.csv", "OUT.csv.toml"}},
    {"export_h5", "export ../s.db --overwrite --out OUT.h5", {"OUT.h5"}},
    {"export_mat", "export ../s.db --overwrite --out OUT.mat", {"OUT.mat"}},
    {"export_bag", "export ../s.db --overwrite --out OUT.bag", {"OUT.bag"}},
    {"train", "train ../s.db --method linear --force --out OUT --report OUT.2", {"OUT", "OUT.2"}},
    {"train_network",
     "train ../s.db --features light --hidden 32 --epochs 40 --threads 1 --force --out OUT",
     {"OUT"}},
    {"evaluate", "evaluate ../m.onnx ../u.db --force --json OUT --report OUT.2", {"OUT", "OUT.2"}},
    {"merge", "merge ../r.db ../truth.db --clock wall --delay-ms 0 --overwrite --out OUT", {"OUT"}},
    {"diagnose",
     "diagnose ../s.db --plant " + kPublished + " --placebo 0 --force --out .",
     {"report.json", "report.html", "plant_improved.toml"}},
    {"convert",
     "convert ../m.onnx --calibrate ../s.db --unbounded-loop --force --out OUT",
     {"OUT"}},
};

INSTANTIATE_TEST_SUITE_P(Files, KilledCommand, testing::ValuesIn(kCommands),
                         [](const auto& command) { return command.param.name; });

using StoppedCommand = FilesRig;

/// Runs the command until a signal finds it at work, so that `out` is there; its exit status.
Outcome stopped(const fs::path& folder, const std::string& arguments, const std::string& out,
                const char* signal_name) {
  Outcome outcome;
  for (int delay_s = 1; delay_s <= 64 && !fs::exists(folder / out); delay_s *= 2) {
    outcome = run_command(fmt::format("cd {} && timeout --preserve-status -s {} {} {} {} 2>&1",
                                      folder.string(), signal_name, delay_s, kProgram, arguments));
  }
  return outcome;
}

TEST_F(StoppedCommand, SaysSoInTheModelAndInTheExitCode) {
  const Outcome outcome = stopped(
      folder_, "train s.db --features light --hidden 32 --epochs 1000000 --out stopped.onnx",
      "stopped.onnx", "INT");
  EXPECT_EQ(outcome.exit_code, 130) << outcome.text;
  EXPECT_NE(outcome.text.find("interrupted"), std::string::npos) << outcome.text;
  const Outcome described = run("info stopped.onnx --json");
  EXPECT_EQ(described.exit_code, 0) << described.text;
  EXPECT_NE(described.text.find("\"interrupted\""), std::string::npos) << described.text;
}

TEST_F(StoppedCommand, SaysSoInTheRecordingAndInTheExitCode) {
  ASSERT_EQ(run("trajectory sinusoid --duration-s 80000 --out long.csv").exit_code, 0);
  const Outcome outcome =
      stopped(folder_, "simulate --plant " + kPlant + " --trajectory long.csv --out stopped.db",
              "stopped.db", "TERM");
  EXPECT_EQ(outcome.exit_code, 143) << outcome.text;
  const Outcome described = run("info stopped.db");
  EXPECT_EQ(described.exit_code, 0) << described.text;
  EXPECT_NE(described.text.find("interrupted"), std::string::npos) << described.text;
}

/// ravencal-encoders at work on a replay of 40 s, whose recording live.db is there.
class Recorder {
 public:
  explicit Recorder(const fs::path& folder) {
    const std::string line = fmt::format(
        "cd {} && exec {} --config {}/quadrature_reader/encoders.toml --replay e.db "
        "--replay-speed 0.1 --out live.db > live.log 2>&1",
        folder.string(), RAVENCAL_ENCODERS, RAVENCAL_SOURCE_DIR);
    fs::remove(folder / "live.db");
    process_ = ::fork();
    if (process_ == 0) {
      ::execl("/bin/sh", "sh", "-c", line.c_str(), nullptr);
      ::_exit(127);
    }
    while (!fs::exists(folder / "live.db") && ::waitpid(process_, &status_, WNOHANG) == 0)
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  void signal(int number) const { ::kill(process_, number); }
  int exit_code() {
    ::waitpid(process_, &status_, 0);
    return WIFEXITED(status_) ? WEXITSTATUS(status_) : -1;
  }

 private:
  pid_t process_ = 0;
  int status_ = 0;
};

// A recorder has no other end than this one.
TEST_F(StoppedCommand, EndsARecorderAsUsual) {
  for (const int signal_number : {SIGINT, SIGTERM}) {
    Recorder recorder(folder_);
    recorder.signal(signal_number);
    EXPECT_EQ(recorder.exit_code(), 0) << bytes_of(folder_ / "live.log");
    EXPECT_EQ(run("info live.db").exit_code, 0);
  }
}

// timeout(1) signals its child alone and then again with the whole group.
TEST_F(StoppedCommand, TakesASignalThatComesTwiceAtOnceForOne) {
  Recorder recorder(folder_);
  recorder.signal(SIGINT);
  std::this_thread::sleep_for(std::chrono::milliseconds(2));  // so that both are delivered
  recorder.signal(SIGINT);
  EXPECT_EQ(recorder.exit_code(), 0) << bytes_of(folder_ / "live.log");
  EXPECT_EQ(run("info live.db").exit_code, 0);
}

TEST(Interrupts, EndTheProcessAtTheSecondSignalOfAPerson) {
  std::array<int, 2> ready{};
  ASSERT_EQ(::pipe(ready.data()), 0);
  const pid_t child = ::fork();
  if (child == 0) {
    cli::catch_interrupts();
    (void)!::write(ready[1], "r", 1);
    while (true) ::pause();
  }
  char letter = 0;
  ASSERT_EQ(::read(ready[0], &letter, 1), 1);
  ::kill(child, SIGINT);
  std::this_thread::sleep_for(std::chrono::duration<double>(cli::kSecondSignal_s + 0.1));
  ::kill(child, SIGINT);
  int status = 0;
  ::waitpid(child, &status, 0);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 130) << status;
}

}  // namespace
}  // namespace ravencal::test
