// SPDX-License-Identifier: Apache-2.0
//
// Every option of every command that names an output, with every kind of thing that an output must
// not replace. The options come from the programs themselves (--list-files), so that none is
// forgotten.
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "unit/files_rig.hpp"

namespace ravencal::test {
namespace {
namespace fs = std::filesystem;

const std::string kEncoders = RAVENCAL_ENCODERS;
const std::string kModel = RAVENCAL_SOURCE_DIR "/tools/plants/so101.xml";

struct FileOption {
  std::string command, name, kind;
};

std::vector<FileOption> listed_options(const std::string& program) {
  std::vector<FileOption> options;
  std::istringstream lines(run_command(program + " --list-files").text);
  for (std::string line; std::getline(lines, line);) {
    const auto first = line.find('\t');
    const auto second = line.find('\t', first + 1);
    if (second == std::string::npos) continue;
    options.push_back({line.substr(0, first), line.substr(first + 1, second - first - 1),
                       line.substr(second + 1)});
  }
  return options;
}

std::vector<FileOption> all_options() {
  std::vector<FileOption> options = listed_options(kProgram);
  const std::vector<FileOption> encoders = listed_options(kEncoders);
  options.insert(options.end(), encoders.begin(), encoders.end());
  return options;
}

/// What each command needs beside the option that is tried.
const std::map<std::string, std::string> kNeeded = {
    {"ravencal trajectory zigzag", "--plant p.toml"},
    {"ravencal trajectory sinusoid", "--plant p.toml"},
    {"ravencal simulate", "--plant p.toml --trajectory t.csv"},
    {"ravencal import", "s.csv --profile generic"},
    {"ravencal export", "s.db"},
    {"ravencal merge", "r.db truth.db"},
    {"ravencal train", "s.db --method linear"},
    {"ravencal evaluate", "m.onnx u.db"},
    {"ravencal convert", "m.onnx"},
    {"ravencal sign", "--key k"},
    {"ravencal sign keygen", ""},
    {"ravencal host", "--plugin P.so --weights w.blob --recording s.db --rate-hz 0 --ticks 10"},
    {"ravencal plant from", "robot.xml"},
    {"ravencal plant to", "p.toml --model robot.xml"},
    {"ravencal profile guess", "s.csv"},
    {"ravencal diagnose", "s.db --plant p.toml"},
    {"ravencal suggest", "s.db --plant p.toml"},
    {"ravencal prove", ""},
    {"ravencal ablate", "removal --train s.db --test u.db"},
    {"ravencal study paper", "--plant p.toml"},
    {"ravencal compare", "--train s.db --test u.db"},
    {"ravencal recommend", "comparison"},
    {"ravencal run", "--trajectory t.csv"},
    {"ravencal calibrate", ""},
    {"ravencal monitor", "--name /ravencal-none"},
    {"ravencal rezero", "--weights w.blob --recording s.db --at elbow=90deg+-0.1deg"},
    {"ravencal-encoders", "--config encoders.toml --replay e.db --replay-speed 0"},
};

/// Options for text that names no file.
const std::set<std::string> kWords = {
    "--sparsity", "--kind",       "--robot",   "--controller",      "--features",
    "--history",  "--hidden",     "--joints",  "--telemetry",       "--reduction",
    "--speed",    "--tool",       "--part",    "--homing-features", "--features-of",
    "--title",    "--methods",    "--name",    "--crtk-arm",        "--sparsities",
    "--pose",     "--noise-from", "--penalty", "--activation",      "--user",
    "--at",       "--at-most",
};

class OutputsOfEveryCommand : public FilesRig {
 protected:
  void SetUp() override {
    fs::remove_all(place());
    fs::create_directories(place());
    fs::copy_file(kPlant, folder_ / "p.toml", fs::copy_options::overwrite_existing);
    fs::copy_file(kModel, folder_ / "robot.xml", fs::copy_options::overwrite_existing);
    fs::copy_file(RAVENCAL_PLUGIN, folder_ / "P.so", fs::copy_options::overwrite_existing);
    fs::copy_file(RAVENCAL_SOURCE_DIR "/quadrature_reader/encoders.toml", folder_ / "encoders.toml",
                  fs::copy_options::overwrite_existing);
    fs::create_directories(folder_ / "comparison");
    std::ofstream(folder_ / "comparison/compare.json") << "{}\n";
  }
  /// Where the outputs of a try lie.
  static fs::path place() { return folder_ / "place"; }

  /// The command with `value` for the option; `before` runs in the shell before it.
  static Outcome try_it(const FileOption& option, const std::string& value, bool force,
                        const std::string& before = "") {
    const bool is_positional = !option.name.starts_with("-");
    std::string line = option.command + " " + kNeeded.at(option.command);
    line.replace(0, line.find(' '), line.starts_with("ravencal-encoders") ? kEncoders : kProgram);
    line += is_positional ? " " + value : " " + option.name + " " + value;
    if (option.name != "--out" && !is_positional && needs_out(option.command))
      line += " --out place/fresh";
    if (force && option.command != "ravencal sign" && option.command != "ravencal sign keygen")
      line += " --force";
    return run_command(fmt::format("cd {0} && export TMPDIR={0}/tmp && {1} timeout 3 {2} 2>&1",
                                   folder_.string(), before, line));
  }
  static bool needs_out(const std::string& command) {
    return command == "ravencal simulate" || command == "ravencal train" ||
           command == "ravencal diagnose";
  }

  struct Count {
    int tried = 0, refused = 0, replaced = 0;
  };
  std::map<std::string, Count> counts_;
};

/// A file as it must stay: the same inode, the same bytes.
struct Kept {
  explicit Kept(fs::path file) : path(std::move(file)), bytes(bytes_of(path)) {
    (void)::lstat(path.c_str(), &status);
  }
  [[nodiscard]] bool is_same() const {
    struct stat now = {};
    return ::lstat(path.c_str(), &now) == 0 && now.st_ino == status.st_ino &&
           now.st_mode == status.st_mode && (!S_ISREG(now.st_mode) || bytes_of(path) == bytes);
  }
  fs::path path;
  std::string bytes;
  struct stat status = {};
};

/// Some process has it open for writing, as SQLite marks it.
class OpenElsewhere {
 public:
  explicit OpenElsewhere(const fs::path& path) : file_(::open(path.c_str(), O_RDWR | O_CLOEXEC)) {
    struct flock lock = {};
    lock.l_type = F_RDLCK;
    lock.l_whence = SEEK_SET;
    lock.l_start = 0x40000002;
    lock.l_len = 510;
    EXPECT_EQ(::fcntl(file_, F_OFD_SETLK, &lock),
              0);  // of this descriptor: to read the file keeps it
  }
  OpenElsewhere(const OpenElsewhere&) = delete;
  OpenElsewhere& operator=(const OpenElsewhere&) = delete;
  ~OpenElsewhere() { ::close(file_); }

 private:
  int file_;
};

/// The first file that the command reads, in the place of an output.
std::string input_of(const std::string& needed) {
  std::istringstream words(needed);
  for (std::string word; words >> word;) {
    if (word == "comparison") return "comparison/compare.json";
    if (word.find('.') != std::string::npos || word == "k") return word;
  }
  return "";
}

TEST_F(OutputsOfEveryCommand, AreDeclared) {
  std::size_t files = 0;
  for (const FileOption& option : all_options()) {
    if (option.kind != "TEXT") {
      ++files;
      continue;
    }
    EXPECT_TRUE(kWords.contains(option.name))
        << option.command << " " << option.name
        << ": declare it in its FileOptions if it names a file, else add it to kWords";
  }
  EXPECT_GT(files, 90U);
}

TEST_F(OutputsOfEveryCommand, ReplaceNothingThatIsNotTheirs) {
  fs::copy_file(folder_ / "s.db", place() / "recording.db");
  fs::copy_file(folder_ / "s.db", place() / "open.db");
  fs::copy_file(RAVENCAL_PLUGIN, place() / "plugin.so");
  fs::copy_file(folder_ / "k", place() / "key");
  fs::create_directory(place() / "folder");
  fs::create_symlink("recording.db", place() / "link");
  fs::create_symlink("nowhere", place() / "dangling");
  const OpenElsewhere open(place() / "open.db");
  struct Thing {
    std::string name, path;
    bool also_forced;
    int exit_code;
  };
  const std::vector<Thing> things = {{"a recording", "place/recording.db", false, 2},
                                     {"a recording that is open", "place/open.db", true, 3},
                                     {"an input", "", true, 2},
                                     {"a library", "place/plugin.so", true, 2},
                                     {"a key", "place/key", true, 2},
                                     {"a link to a file", "place/link", false, 2},
                                     {"a link to nothing", "place/dangling", true, 2},
                                     {"a folder", "place/folder", true, 3}};
  for (const FileOption& option : all_options()) {
    if (option.kind == "FILE" || option.kind == "TEXT") continue;
    ASSERT_TRUE(kNeeded.contains(option.command)) << option.command;
    for (const Thing& thing : things) {
      if (option.kind == "FOLDER" && thing.name == "a folder") continue;
      const bool is_input = thing.path.empty();
      const std::string path = is_input ? input_of(kNeeded.at(option.command)) : thing.path;
      if (path.empty()) continue;
      const std::vector<Kept> kept = {Kept(folder_ / path), Kept(place() / "recording.db"),
                                      Kept(place() / "link")};
      for (const bool force : {false, true}) {
        if (force && !thing.also_forced && option.kind != "FOLDER") continue;
        const Outcome outcome = try_it(option, path, force);
        Count& count = counts_[thing.name];
        ++count.tried;
        count.refused += outcome.exit_code != 0 ? 1 : 0;
        const std::string what =
            fmt::format("{} {} {}{}: exit {}: {}", option.command, option.name, path,
                        force ? " --force" : "", outcome.exit_code, outcome.text);
        const bool stays =
            std::all_of(kept.begin(), kept.end(), [](const Kept& file) { return file.is_same(); });
        count.replaced += stays ? 0 : 1;
        EXPECT_TRUE(stays) << what;
        EXPECT_TRUE(outcome.exit_code == 2 || outcome.exit_code == 3) << what;
      }
    }
  }
  int tried = 0;
  for (const auto& [name, count] : counts_) {
    std::printf("%-28s tried %3d, refused %3d, replaced %d\n", name.c_str(), count.tried,
                count.refused, count.replaced);
    EXPECT_EQ(count.refused, count.tried) << name;
    tried += count.tried;
  }
  EXPECT_GT(tried, 250);
}

/// Three seconds a command: some work, and what matters is what stands at the end.
TEST_F(OutputsOfEveryCommand, AreWrittenThroughDevicesAndDescriptors) {
  fs::create_symlink("/proc/self/fd/1", place() / "stdout");
  int tried = 0;
  for (const FileOption& option : all_options()) {
    if (option.kind != "NEW-FILE" && option.kind != "FOLDER") continue;
    const auto look = [&](const std::string& path, const Outcome& outcome) {
      ++tried;
      struct stat device = {};
      EXPECT_EQ(::stat("/dev/full", &device), 0);
      EXPECT_TRUE(S_ISCHR(device.st_mode)) << option.command << " " << option.name;
      EXPECT_TRUE(fs::is_symlink("/dev/stdout")) << option.command << " " << option.name;
      EXPECT_TRUE(fs::is_symlink(place() / "stdout")) << option.command << " " << option.name;
      EXPECT_FALSE(fs::exists(place() / "gone")) << option.command << " " << option.name;
      EXPECT_FALSE(fs::exists(place() / "gone (deleted)")) << option.command << " " << path;
      EXPECT_LT(outcome.exit_code, 126) << outcome.text;
    };
    look("/dev/full", try_it(option, "/dev/full", true));
    look("place/stdout",
         try_it(option, "place/stdout", true, "exec 1<>place/gone && rm place/gone &&"));
  }
  std::printf("devices and descriptors: tried %d, replaced 0\n", tried);
  EXPECT_GT(tried, 50);
}

TEST_F(OutputsOfEveryCommand, ReachAStandardOutputThatIsADeletedFile) {
  for (const char* name : {"/proc/self/fd/1", "place/stdout"}) {
    fs::remove(place() / "stdout");
    fs::create_symlink("/proc/self/fd/1", place() / "stdout");
    const Outcome outcome = run_command(fmt::format(
        "cd {} && exec 3>&1 && : > place/gone && exec 4< place/gone && exec 1<> place/gone && "
        "rm place/gone && {} evaluate m.onnx u.db --json {} 2>&3; cat <&4 >&3",
        folder_.string(), kProgram, name));
    EXPECT_NE(outcome.text.find("\"bias_removed\""), std::string::npos) << name << outcome.text;
    EXPECT_TRUE(fs::is_symlink(place() / "stdout"));
  }
}

TEST_F(OutputsOfEveryCommand, OneOfFourAtOnceMakesTheFile) {
  const std::vector<std::string> commands = {
      "simulate --plant p.toml --trajectory t.csv --out place/one",
      "import s.csv --profile generic --out place/one",
      "export s.db --out place/one.csv",
      "train s.db --method linear --out place/one",
  };
  for (const std::string& command : commands) {
    for (int round = 0; round < 3; ++round) {
      fs::remove_all(place());
      fs::create_directories(place());
      const std::string one =
          fmt::format("({} {} > /dev/null 2>&1; echo $?) & ", kProgram, command);
      const Outcome outcome =
          run_command("cd " + folder_.string() + "; " + one + one + one + one + "wait");
      std::multiset<std::string> codes;
      std::istringstream lines(outcome.text);
      for (std::string line; std::getline(lines, line);) codes.insert(line);
      EXPECT_EQ(codes, (std::multiset<std::string>{"0", "2", "2", "2"})) << command;
    }
  }
}

TEST_F(OutputsOfEveryCommand, AppearTogetherOrNotAtAll) {
  const auto write_old = [] {
    std::ofstream(place() / "json") << "old\n";
    std::ofstream(place() / "report") << "old\n";
  };
  write_old();
  // The page is larger than the limit, the figures are not.
  const Outcome outcome = run_command(
      fmt::format("cd {} && ulimit -f 8 && {} evaluate m.onnx u.db --force --json place/json "
                  "--report place/report 2>&1",
                  folder_.string(), kProgram));
  EXPECT_EQ(outcome.exit_code, 3) << outcome.text;
  EXPECT_EQ(bytes_of(place() / "json"), "old\n");
  EXPECT_EQ(bytes_of(place() / "report"), "old\n");
  fs::remove(place() / "json");
  const Outcome again = run_command(
      fmt::format("cd {} && ulimit -f 8 && {} evaluate m.onnx u.db --force --json place/json "
                  "--report place/report 2>&1",
                  folder_.string(), kProgram));
  EXPECT_EQ(again.exit_code, 3) << again.text;
  EXPECT_FALSE(fs::exists(place() / "json"));
  EXPECT_EQ(std::distance(fs::directory_iterator(place()), {}), 1);
}

TEST_F(OutputsOfEveryCommand, OfADiagnosisAreRenewedUnlessSomebodyChangedThem) {
  const std::string command = "diagnose s.db --plant p.toml --placebo 0 --out place/why";
  ASSERT_EQ(run(command).exit_code, 0);
  EXPECT_EQ(run(command).exit_code, 0);
  std::ofstream(place() / "why/plant_improved.toml", std::ios::app) << "# mine\n";
  const std::string changed = bytes_of(place() / "why/plant_improved.toml");
  const std::string report = bytes_of(place() / "why/report.json");
  const Outcome refused = run(command);
  EXPECT_EQ(refused.exit_code, 2) << refused.text;
  EXPECT_NE(refused.text.find("plant_improved.toml: exists already"), std::string::npos)
      << refused.text;
  EXPECT_EQ(bytes_of(place() / "why/plant_improved.toml"), changed);
  EXPECT_EQ(bytes_of(place() / "why/report.json"), report);
  EXPECT_EQ(run(command + " --force").exit_code, 0);
  EXPECT_NE(bytes_of(place() / "why/plant_improved.toml"), changed);
}

}  // namespace
}  // namespace ravencal::test
