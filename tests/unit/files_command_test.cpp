// SPDX-License-Identifier: Apache-2.0
#include <sys/stat.h>

#include <regex>
#include <set>
#include <vector>

#include "unit/files_rig.hpp"

namespace ravencal::test {
namespace {
namespace fs = std::filesystem;

using FilesOfACommand = FilesRig;

TEST_F(FilesOfACommand, NoInputIsReplacedByAnOutput) {
  struct Clash {
    std::string arguments, input;
  };
  const std::vector<Clash> clashes = {
      {"simulate --plant p.toml --trajectory t.csv --force --out t.csv", "t.csv"},
      {"simulate --plant p.toml --trajectory t.csv --force --out p.toml", "p.toml"},
      {"simulate --plant p.toml --trajectory t.csv --force --out x.db --edges p.toml", "p.toml"},
      {"simulate --plant p.toml --follow s.db --force --out s.db", "s.db"},
      {"import s.csv --profile generic --overwrite --out s.csv", "s.csv"},
      {"export s.db --out link.csv", "s.db"},
      {"merge s.db e.db --overwrite --out e.db", "e.db"},
      {"train s.db --out s.db", "s.db"},
      {"train s.db --out ./../{folder}/s.db", "s.db"},
      {"train s.db --out hard.db", "s.db"},
      {"train s.db --validate r.db --out x.onnx --report r.db", "r.db"},
      {"train s.db --plant p.toml --out p.toml", "p.toml"},
      {"evaluate m.onnx s.db --json s.db", "s.db"},
      {"evaluate m.onnx s.db --report m.onnx", "m.onnx"},
      {"convert m.onnx --out m.onnx", "m.onnx"},
      {"convert m.onnx --calibrate s.db --out s.db", "s.db"},
      {"diagnose s.db --plant p.toml --out d --json p.toml", "p.toml"},
      {"host --plugin m.onnx --weights w.blob --recording s.db --json w.blob", "w.blob"},
      {"host --plugin m.onnx --weights w.blob --recording s.db --flight s.db", "s.db"},
      {"sign k --key k", "k"},
  };
  fs::copy_file(kPlant, folder_ / "p.toml", fs::copy_options::overwrite_existing);
  fs::create_symlink("s.db", folder_ / "link.csv");
  fs::create_hard_link(folder_ / "s.db", folder_ / "hard.db");
  for (const Clash& clash : clashes) {
    const std::string before = bytes_of(folder_ / clash.input);
    const std::string arguments = std::regex_replace(clash.arguments, std::regex(R"(\{folder\})"),
                                                     folder_.filename().string());
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.exit_code, 2) << arguments << "\n" << outcome.text;
    EXPECT_NE(outcome.text.find("is read by this command"), std::string::npos) << arguments << "\n"
                                                                               << outcome.text;
    EXPECT_EQ(bytes_of(folder_ / clash.input), before) << arguments;
  }
  EXPECT_FALSE(fs::exists(folder_ / "d"));
}

TEST_F(FilesOfACommand, AnEmptyNameIsNoFile) {
  for (const char* arguments :
       {"evaluate m.onnx u.db --json ''", "train s.db --method linear --out ''",
        "train s.db --method linear --out empty.onnx --report ''", "info ''"}) {
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.exit_code, 2) << arguments << "\n" << outcome.text;
    EXPECT_NE(outcome.text.find("an empty name is no file"), std::string::npos) << outcome.text;
  }
  EXPECT_FALSE(fs::exists(folder_ / "empty.onnx"));
}

TEST_F(FilesOfACommand, AFolderOfOutputsReplacesNoInputInIt) {
  fs::create_directory(folder_ / "report");
  fs::copy_file(kPlant, folder_ / "report" / "plant_improved.toml");
  const std::string before = bytes_of(kPlant);
  const Outcome outcome =
      run("diagnose s.db --plant report/plant_improved.toml --held-out-from 10 --out report");
  EXPECT_EQ(outcome.exit_code, 2) << outcome.text;
  EXPECT_EQ(bytes_of(folder_ / "report" / "plant_improved.toml"), before);
}

TEST_F(FilesOfACommand, TwoOutputsHaveTwoNames) {
  const Outcome outcome = run("evaluate m.onnx u.db --json both --report ./both");
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_NE(outcome.text.find("two outputs"), std::string::npos) << outcome.text;
}

TEST_F(FilesOfACommand, DevicesAndPipesAreWrittenTo) {
  const Outcome printed = run("evaluate m.onnx u.db --json /dev/stdout");
  EXPECT_EQ(printed.exit_code, 0) << printed.text;
  EXPECT_NE(printed.text.find("\"bias_removed\""), std::string::npos) << printed.text;
  EXPECT_TRUE(fs::is_symlink("/dev/stdout"));
  struct stat device = {};
  ASSERT_EQ(::stat("/dev/null", &device), 0);
  const Outcome gone = run("evaluate m.onnx u.db --json /dev/null --report /dev/null");
  EXPECT_EQ(gone.exit_code, 0) << gone.text;
  ASSERT_EQ(::stat("/dev/null", &device), 0);
  EXPECT_TRUE(S_ISCHR(device.st_mode));
  const Outcome piped = run_command(
      fmt::format("cd {0} && mkfifo pipe && (timeout 1800 cat pipe & {1} trajectory zigzag --force "
                  "--out pipe; wait) 2>&1",
                  folder_.string(), kProgram));
  EXPECT_NE(piped.text.find("t_s,shoulder_rad"), std::string::npos) << piped.text.substr(0, 200);
  EXPECT_TRUE(fs::is_fifo(folder_ / "pipe"));
  EXPECT_EQ(run("import s.csv --profile generic --overwrite --out pipe").exit_code, 3);
}

/// `--option TYPE` lines of a help text, for types that are numbers.
std::set<std::string> number_options(const std::string& help) {
  std::set<std::string> options;
  const std::regex line(R"((--[a-z0-9-]+) (FLOAT|INT|UINT))");
  for (std::sregex_iterator it(help.begin(), help.end(), line), end; it != end; ++it)
    options.insert((*it)[1]);
  return options;
}

TEST(NumbersOfACommand, AreRefusedWhereTheyAreNone) {
  std::vector<std::string> programs = {RAVENCAL_ENCODERS, kProgram + " trajectory sinusoid"};
  const std::string all = run_command(kProgram + " --help").text;
  const std::regex command(R"(\n  ([a-z]+)  )");
  for (std::sregex_iterator it(all.begin(), all.end(), command), end; it != end; ++it)
    programs.push_back(kProgram + " " + (*it)[1].str());
  ASSERT_GT(programs.size(), 15U);
  std::size_t options = 0;
  for (const std::string& program : programs) {
    for (const std::string& option : number_options(run_command(program + " --help").text)) {
      ++options;
      for (const char* value : {"nan", "-nan", "inf", "-inf", "1e300", "18446744073709551616"}) {
        const Outcome outcome =
            run_command(fmt::format("{} {}={} 2>&1 < /dev/null", program, option, value));
        EXPECT_EQ(outcome.exit_code, 2) << program << " " << option << " " << value;
        EXPECT_NE(outcome.text.find(option), std::string::npos)
            << program << " " << value << ": " << outcome.text;
        EXPECT_EQ(outcome.text.find("is required"), std::string::npos)
            << program << " " << option << " " << value;
      }
    }
  }
  EXPECT_GT(options, 50U);
}

}  // namespace
}  // namespace ravencal::test
