// SPDX-License-Identifier: Apache-2.0
//
// What every program does where the system gives it less than it asks for, and what `import` says.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <fstream>
#include <regex>
#include <sstream>

#include "record/recording_writer.hpp"
#include "unit/record/scratch.hpp"
#include "unit/run_command.hpp"

namespace ravencal::test {
namespace {

class Program : public ::testing::Test {
 protected:
  /// Long enough to be read by several threads.
  void SetUp() override {
    record::Recording recording;
    recording.channels = {{"q.elbow", "rad", record::Role::kJointEstimate, "elbow"}};
    recording.samples = record::SampleMatrix::Constant(20'000, 1, 0.5);
    for (std::int64_t r = 0; r < 20'000; ++r) recording.t_ns.push_back(1'000'000 * r);
    ASSERT_TRUE(record::write_recording(recording, path_).ok());
  }

  const record::testing::Scratch scratch_;
  const std::filesystem::path path_ = scratch_ / "x.db";
};

TEST_F(Program, SaysThatItsOutputCouldNotBeWritten) {
  for (const std::string& command :
       {fmt::format("{} info {}", RAVENCAL_PROGRAM, path_.string()),
        fmt::format("{} info --json {}", RAVENCAL_PROGRAM, path_.string()),
        fmt::format("{} --version", RAVENCAL_PROGRAM), fmt::format("{} --help", RAVENCAL_PROGRAM),
        fmt::format("{} --help", RAVENCAL_ENCODERS)}) {
    const Outcome full = run_command(command + " 2>&1 >/dev/full");
    EXPECT_EQ(full.exit_code, 3) << command;
    EXPECT_NE(full.text.find("standard output cannot be written: No space left on device"),
              std::string::npos)
        << command << "\n"
        << full.text;
    EXPECT_EQ(run_command(command + " >/dev/null").exit_code, 0) << command;
  }
}

TEST_F(Program, ImportSaysWhatItUnwrapped) {
  const auto folder = path_.parent_path();
  {
    std::ofstream table(folder / "turns.csv"), profile(folder / "turns.toml");
    table << "t_s,knee_deg\n";
    for (int row = 0; row < 90; ++row) table << 0.01 * row << ',' << (200 + 9 * row) % 360 << '\n';
    profile << "[source]\ntime = \"t_s\"\n[[channel]]\nname = \"knee\"\ncolumn = \"knee_deg\"\n"
               "unit = \"deg\"\nwraps_at = 360\n";
  }
  const Outcome said = run_command(fmt::format(
      "cd {} && {} import turns.csv --profile turns.toml --out turns.db 2>&1 && {} info turns.db",
      folder.string(), RAVENCAL_PROGRAM, RAVENCAL_PROGRAM));
  EXPECT_EQ(said.exit_code, 0) << said.text;
  EXPECT_NE(said.text.find("\nknee wraps at 360 in the file; unwrapped 2 times\n"),
            std::string::npos)
      << said.text;
  EXPECT_NE(said.text.find("events of kind unwrapped: 1"), std::string::npos) << said.text;
}

TEST_F(Program, SaysThatAFileWouldExceedTheLimitOfItsSize) {
  for (const char* name : {"x.csv", "x.h5", "x.mat"}) {
    const auto out = scratch_ / name;
    const Outcome limited = run_command(fmt::format(
        "ulimit -f 8; {} export {} --out {} 2>&1", RAVENCAL_PROGRAM, path_.string(), out.string()));
    EXPECT_EQ(limited.exit_code, 3) << name << ": " << limited.text;
    EXPECT_NE(limited.text.find(name), std::string::npos) << limited.text;
  }
  std::size_t files = 0;
  for ([[maybe_unused]] const auto& file : std::filesystem::directory_iterator(path_.parent_path()))
    ++files;
  EXPECT_EQ(files, 1U) << "only the recording";
}

#ifndef RAVENCAL_SANITIZED  // a sanitizer reserves terabytes of addresses
TEST_F(Program, ReadsWithTheThreadsThatItGets) {
  // No second stack fits.
  const Outcome few = run_command(fmt::format(
      "ulimit -s 4000000; ulimit -v 3000000; {} info {} 2>&1", RAVENCAL_PROGRAM, path_.string()));
  EXPECT_EQ(few.exit_code, 0) << few.text;
  EXPECT_NE(few.text.find("20000"), std::string::npos) << few.text;
}

TEST_F(Program, SaysThatThereIsNotEnoughMemory) {
  const auto wide = scratch_ / "wide.csv";
  {
    std::ofstream file(wide);
    file << "t_s,a_rad,b_rad,c_rad,d_rad,e_rad,f_rad,g_rad\n";
    for (int r = 0; r < 1'000'000; ++r) file << r << ",1,1,1,1,1,1,1\n";
  }
  const Outcome little = run_command(fmt::format(
      "ulimit -v 120000; {} info --profile generic {} 2>&1", RAVENCAL_PROGRAM, wide.string()));
  EXPECT_EQ(little.exit_code, 3) << little.text;
  EXPECT_NE(little.text.find("not enough memory"), std::string::npos) << little.text;
}
#endif

/// What comes from anybody is on the page that says how it is read.
TEST(CommandLine, EveryKindOfFileThatIsReadStandsInSecurity) {
  const std::string known =
      run_command(fmt::format("{} info x.unknown 2>&1", RAVENCAL_PROGRAM)).text;
  std::ostringstream page;
  page << std::ifstream(RAVENCAL_SOURCE_DIR "/SECURITY.md").rdbuf();
  const std::regex extension(R"(\.(?!unknown)[a-z0-9]+\b)");
  int kinds = 0;
  for (std::sregex_iterator it(known.begin(), known.end(), extension), end; it != end; ++it) {
    ++kinds;
    EXPECT_NE(page.str().find("`" + it->str() + "`"), std::string::npos) << it->str();
  }
  EXPECT_GT(kinds, 10) << known;
}

TEST(CommandLine, AMistypedCommandIsNamedWithTheOneThatWasMeant) {
  const auto error_of = [](const std::string& arguments) {
    const Outcome outcome = run_command(fmt::format("{} {} 2>&1", RAVENCAL_PROGRAM, arguments));
    EXPECT_EQ(outcome.exit_code, 2) << arguments;
    return outcome.text;
  };
  for (const auto& [arguments, wanted] :
       {std::pair{"evalute m.onnx s.db", "no command 'evalute'; did you mean 'evaluate'?"},
        std::pair{"Simulate --plant p.toml", "no command 'Simulate'; did you mean 'simulate'?"},
        std::pair{"profile gess run.csv", "profile: there is no command 'gess'; did you mean "},
        std::pair{"qqqqqqqq", "no command 'qqqqqqqq'; known: "}}) {
    const std::string text = error_of(arguments);
    EXPECT_NE(text.find(wanted), std::string::npos) << text;
  }
  EXPECT_NE(error_of("").find("subcommand is required"), std::string::npos);
  EXPECT_NE(error_of("info x.db --colour").find("--colour"), std::string::npos);
}

TEST(CommandLine, ErrorsNameTheProgramAndTheCommandThatWasCalled) {
  for (const auto& [arguments, wanted] :
       {std::pair{"", "ravencal: A subcommand is required\n`ravencal --help` "},
        std::pair{"--colour", "ravencal: "},
        std::pair{"train", "ravencal train: recordings is required\n`ravencal train --help` "},
        std::pair{"train x.db --out m.onnx --seed blue", "ravencal train: "},
        std::pair{"info x.db --colour", "ravencal info: "},
        std::pair{"profile guess", "ravencal profile guess: "},
        std::pair{"profile gess", "ravencal profile: there is no command 'gess'"}}) {
    const Outcome outcome = run_command(fmt::format("{} {} 2>&1", RAVENCAL_PROGRAM, arguments));
    EXPECT_EQ(outcome.exit_code, 2) << arguments;
    EXPECT_TRUE(outcome.text.starts_with(wanted)) << arguments << ": " << outcome.text;
  }
}

TEST(CommandLine, WordsOfAnOptionArePlainInHelpAndErrors) {
  const Outcome help = run_command(fmt::format("{} train --help", RAVENCAL_PROGRAM));
  EXPECT_EQ(help.text.find("->"), std::string::npos) << help.text;
  EXPECT_NE(help.text.find("{auto,recording,none}"), std::string::npos) << help.text;
  EXPECT_NE(help.text.find("{auto,on,off}"), std::string::npos) << help.text;
  const Outcome wrong =
      run_command(fmt::format("{} train x.db --out m.onnx --latched maybe 2>&1", RAVENCAL_PROGRAM));
  EXPECT_EQ(wrong.exit_code, 2);
  EXPECT_NE(wrong.text.find("maybe not in {auto,on,off}"), std::string::npos) << wrong.text;
}

}  // namespace
}  // namespace ravencal::test
