// SPDX-License-Identifier: Apache-2.0
//
// Work goes on whether or not anybody hears what a command says: standard output or error closed,
// on a full disk, or with a reader that left.
#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <regex>
#include <utility>
#include <vector>

#include "core/terminal.hpp"
#include "core/utf8.hpp"
#include "unit/files_rig.hpp"

namespace ravencal::test {
namespace {
namespace fs = std::filesystem;

enum class Hearing { kWell, kClosed, kFull, kLeft };
constexpr std::array kUnheard = {Hearing::kClosed, Hearing::kFull, Hearing::kLeft};
/// Output and error.
constexpr std::array kHeard = {
    std::pair{Hearing::kWell, Hearing::kFull}, std::pair{Hearing::kClosed, Hearing::kClosed},
    std::pair{Hearing::kFull, Hearing::kLeft}, std::pair{Hearing::kLeft, Hearing::kWell}};

void let_hear(int stream, Hearing hearing) {
  if (hearing == Hearing::kClosed) ::close(stream);
  if (hearing == Hearing::kFull) ::dup2(::open("/dev/full", O_WRONLY | O_CLOEXEC), stream);
  if (hearing == Hearing::kLeft) {
    std::array<int, 2> ends{};
    (void)!::pipe2(ends.data(), O_CLOEXEC);
    ::dup2(ends[1], stream);
    ::close(ends[0]);
  }
}

/// Exit code, or minus the signal, of a program whose output and error are heard so.
int code_of(const fs::path& folder, const std::string& line, Hearing output, Hearing error) {
  const pid_t child = ::fork();
  if (child == 0) {
    (void)std::signal(SIGPIPE, SIG_DFL);
    const int null = ::open("/dev/null", O_RDWR | O_CLOEXEC);
    for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) ::dup2(null, stream);
    let_hear(STDOUT_FILENO, output);
    let_hear(STDERR_FILENO, error);
    if (::chdir(folder.c_str()) == 0)
      ::execl("/bin/sh", "sh", "-c", ("exec " + line).c_str(), nullptr);
    ::_exit(127);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
}

struct Call {
  std::string arguments;
  std::vector<std::string> outputs;
};

const std::vector<Call> kCalls = {
    {"trajectory sinusoid --duration-s 40 --out m/t.csv", {"m/t.csv"}},
    {"simulate --plant " + kPlant + " --trajectory t.csv --out m/s.db", {"m/s.db"}},
    {"import s.csv --profile generic --out m/i.db", {"m/i.db"}},
    {"export s.db --out m/e.csv", {"m/e.csv", "m/e.csv.toml"}},
    {"merge r.db truth.db --clock wall --delay-ms 0 --out m/m.db", {"m/m.db"}},
    {"info s.db", {}},
    {"train s.db --method linear --out m/m.onnx --report m/m.html", {"m/m.onnx", "m/m.html"}},
    {"evaluate m.onnx u.db --json m/e.json --report m/e.html", {"m/e.json", "m/e.html"}},
    {"convert m.onnx --calibrate s.db --unbounded-loop --out m/w.blob", {"m/w.blob"}},
    {"sign keygen --out m/k", {"m/k", "m/k.pub"}},
    {"host --plugin " RAVENCAL_PLUGIN " --weights w.blob --recording u.db "
     "--ticks 2000 --json m/h.json",
     {"m/h.json"}},
    {"plant from " RAVENCAL_SOURCE_DIR "/tools/plants/double_pendulum.xml --out m/p.toml",
     {"m/p.toml"}},
    {"profile guess s.csv --out m/g.toml", {"m/g.toml"}},
    {"diagnose s.db --plant " + kPlant + " --placebo 0 --out m/d",
     {"m/d/report.json", "m/d/report.html", "m/d/plant_improved.toml"}},
    {"ablate removal --train s.db --test u.db --out m/a --plan", {}},
};

/// Without files of their own, or with work that is too long here: their help and their complaint.
std::vector<std::string> all_commands() {
  const std::string help = run_command(kProgram + " --help").text;
  std::vector<std::string> names;
  const std::regex command(R"(\n  ([a-z]+)  )");
  for (std::sregex_iterator it(help.begin(), help.end(), command), end; it != end; ++it)
    names.push_back((*it)[1]);
  return names;
}

class Messages : public FilesRig {
 protected:
  static int call(const std::string& arguments, Hearing output, Hearing error) {
    fs::remove_all(folder_ / "m");
    fs::create_directory(folder_ / "m");
    return code_of(folder_, kProgram + " " + arguments, output, error);
  }
  static void expect_outputs(const Call& made) {
    for (const std::string& output : made.outputs) {
      std::error_code absent;
      EXPECT_GT(fs::file_size(folder_ / output, absent), 0U) << made.arguments << ": " << output;
      EXPECT_FALSE(absent) << made.arguments << ": " << output;
    }
  }
};

TEST_F(Messages, ThatAreNotHeardEndNoWork) {
  for (const Call& each : kCalls) {
    const int code = call(each.arguments, Hearing::kWell, Hearing::kWell);
    ASSERT_TRUE(code == 0 || code == 1) << each.arguments << ": " << code;
    expect_outputs(each);
    for (const auto& [output, error] : kHeard) {
      const int unheard = call(each.arguments, output, error);
      const bool may_say_so = code == 0 && (output == Hearing::kClosed || output == Hearing::kFull);
      EXPECT_TRUE(unheard == code || (may_say_so && unheard == 3))
          << each.arguments << ": " << unheard << " where output and error are heard "
          << static_cast<int>(output) << " and " << static_cast<int>(error);
      expect_outputs(each);
    }
  }
}

TEST_F(Messages, HelpAndComplaintsOfEveryCommandEndInAnExitCode) {
  const std::vector<std::string> commands = all_commands();
  EXPECT_GT(commands.size(), 15U);
  for (const std::string& command : commands) {
    for (const Hearing hearing : kUnheard) {
      const int helped = hearing == Hearing::kLeft ? 0 : 3;
      EXPECT_EQ(call(command + " --help", hearing, Hearing::kWell), helped) << command;
      EXPECT_EQ(call(command + " --help", Hearing::kWell, hearing), 0) << command;
      EXPECT_EQ(call(command + " --no-such-option", hearing, hearing), 2) << command;
    }
  }
}

TEST_F(Messages, ARecorderGoesOnWithoutItsReader) {
  const std::string line = fmt::format(
      "{} --config {}/quadrature_reader/encoders.toml --replay e.db --replay-speed 10 --json "
      "--home --out m/live.db",
      RAVENCAL_ENCODERS, RAVENCAL_SOURCE_DIR);
  const std::string rows = run("info truth.db").text;
  for (const Hearing hearing : {Hearing::kWell, Hearing::kLeft}) {
    fs::remove_all(folder_ / "m");
    fs::create_directory(folder_ / "m");
    EXPECT_EQ(code_of(folder_, line, hearing, hearing), 0);
    EXPECT_EQ(run("info --json m/live.db | grep -c '\"rows\": *[1-9]'").text, "1\n") << rows;
  }
}

// The first file that is opened would otherwise become standard error, and take in what is said.
TEST_F(Messages, NoneGoesIntoAFileOfTheCommand) {
  const std::string train = "train s.db --method linear --out m/m.onnx";
  call(train, Hearing::kWell, Hearing::kWell);
  const std::string heard = run("info m/m.onnx").text;
  call(train, Hearing::kClosed, Hearing::kClosed);
  EXPECT_EQ(run("info m/m.onnx").text, heard);
}

TEST(Printable, HasNoControlCharactersButNewLinesAndTabs) {
  EXPECT_EQ(core::printable("plain \xc3\xa9 \xe2\x82\xac \xf0\x9f\x99\x82\t\n"),
            "plain \xc3\xa9 \xe2\x82\xac \xf0\x9f\x99\x82\t\n");
  EXPECT_EQ(core::printable("\x1b[2J"), "\\u001b[2J");
  EXPECT_EQ(core::printable("a\rb\x7f"), "a\\u000db\\u007f");
  EXPECT_EQ(core::printable("a\xe2\x80\xae"
                            "b"),
            "a\\u202eb")
      << "from right to left";
  EXPECT_EQ(core::printable("\xc2\x9b"), "\\u009b") << "CSI as one character";
  EXPECT_EQ(core::printable("\x9b\xff\xe2\x82"), "\\u009b\\u00ff\\u00e2\\u0082");
  EXPECT_EQ(core::printable("\xe0\x80\x9b"), "\\u00e0\\u0080\\u009b") << "longer than needed";
  EXPECT_TRUE(core::is_utf8("plain \xc3\xa9 \xf0\x9f\x99\x82"));
  for (const char* other : {"\xc0\xaf", "\xed\xa0\x80", "\xf4\x90\x80\x80", "e\xcc", "\xe9t\xe9"})
    EXPECT_FALSE(core::is_utf8(other)) << core::printable(other);
}

TEST_F(Messages, ShowNoEscapesOfAName) {
  const Outcome outcome = run("info \"$(printf 'absent\\033[31m.db')\"");
  EXPECT_EQ(outcome.text.find('\x1b'), std::string::npos) << outcome.text;
  std::ofstream(folder_ / "esc.csv") << "t_s,q_rad\x1b[2J_rad\n0,1\n1,2\n";
  const Outcome described = run("info esc.csv");
  EXPECT_EQ(described.text.find('\x1b'), std::string::npos) << described.text;
}

}  // namespace
}  // namespace ravencal::test
