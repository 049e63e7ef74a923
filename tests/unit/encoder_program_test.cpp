// SPDX-License-Identifier: Apache-2.0
//
// ravencal-encoders as a user or a service manager meets it: exit codes, status lines, signals.
#include <fcntl.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "quadrature_reader/encode.hpp"
#include "quadrature_reader/recorder.hpp"
#include "record/load.hpp"
#include "record/recording_writer.hpp"

namespace ravencal::quadrature_reader {
namespace {

namespace fs = std::filesystem;
constexpr std::int64_t kMs = 1'000'000;

class EncoderProgram : public testing::Test {
 protected:
  EncoderProgram() : folder_(fs::temp_directory_path() / fmt::format("encoders_{}", ::getpid())) {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  ~EncoderProgram() override { fs::remove_all(folder_); }

  /// A configuration whose only source has these keys.
  void configure(const std::string& source, const std::string& wiring,
                 const std::string& zero = "zero_counts = 0") const {
    std::ofstream(folder_ / "c.toml")
        << "[[source]]\nname = \"s\"\n"
        << source << "\n[[encoder]]\njoint = \"shoulder\"\nsource = \"s\"\n"
        << "counts_per_rev = 80000\n"
        << zero << '\n'
        << wiring << '\n';
  }
  void configure_missing_chip() const {
    configure("kind = \"gpio\"\nchip = \"/dev/no-such-chip\"", "line_a = 0\nline_b = 1");
  }
  /// 20 s of a joint that turns at 1000 counts/s, played at its own speed.
  void configure_replay(const std::string& zero = "zero_counts = 0") const {
    Config config;
    config.sources.emplace_back();
    EncoderSettings encoder;
    encoder.axis.joint = "shoulder";
    encoder.axis.si_per_count = 1e-4;
    config.encoders.push_back(encoder);
    auto recorder = Recorder::create(config, folder_ / "motion.db", {true});
    ASSERT_TRUE(recorder.ok());
    const std::int64_t t_ns[] = {1, 20'000 * kMs};
    const double counts[] = {0.0, 20'000.0};
    for (const auto& reading : encode_motion(t_ns, counts, {})) {
      recorder->take(0, reading);
    }
    recorder->take(0, {20'001 * kMs, 0, kEveryAxis, ReadingKind::kAlive, Line::kA, Fault::kNone});
    ASSERT_TRUE(recorder->finish().ok());
    configure(
        fmt::format("kind = \"replay\"\nrecording = \"{}\"", (folder_ / "motion.db").string()), "",
        zero);
  }

  /// Starts the program in the test's folder with its outputs in files `out` and `err`.
  [[nodiscard]] pid_t start(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), {RAVENCAL_ENCODERS, "--config", "c.toml"});
    std::vector<char*> argv;
    for (auto& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    for (const char* output : {"out", "err"}) fs::remove(folder_ / output);
    const pid_t child = ::fork();
    if (child != 0) return child;
    (void)!::chdir(folder_.c_str());
    (void)::dup2(::open("out", O_WRONLY | O_CREAT | O_TRUNC, 0600), STDOUT_FILENO);
    (void)::dup2(::open("err", O_WRONLY | O_CREAT | O_TRUNC, 0600), STDERR_FILENO);
    ::execv(argv[0], argv.data());
    ::_exit(127);
  }
  static int wait_for(pid_t child) {
    int status = 0;
    ::waitpid(child, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  }
  [[nodiscard]] std::string text_of(const char* name) const {
    std::ifstream file(folder_ / name);
    std::ostringstream text;
    text << file.rdbuf();
    return text.str();
  }
  template <typename Condition>
  static void wait_until(const Condition& condition) {
    while (!condition()) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }

  fs::path folder_;
};

TEST_F(EncoderProgram, RefusesToRecordWithoutItsDeviceAndSaysWhatToDo) {
  configure_missing_chip();
  EXPECT_EQ(wait_for(start({"--out", "r.db"})), 4);
  const std::string text = text_of("err");
  EXPECT_NE(text.find("cannot open GPIO chip /dev/no-such-chip"), std::string::npos) << text;
  EXPECT_NE(text.find("--check-setup"), std::string::npos) << text;
  EXPECT_FALSE(fs::exists(folder_ / "r.db"));
}

TEST_F(EncoderProgram, TakesNoPoseThatIsNoNumberOfARobot) {
  configure_missing_chip();
  for (const char* value : {"nandeg", "infdeg", "-infdeg", "1e300deg", "1e999deg", "30", "deg"}) {
    EXPECT_EQ(wait_for(start({"--out", "r.db", "--pose", std::string("shoulder=") + value})), 2)
        << value;
    EXPECT_NE(text_of("err").find("--pose shoulder="), std::string::npos) << text_of("err");
  }
}

TEST_F(EncoderProgram, WaitsForItsDeviceUntilTheDurationIsOverOrASignalComes) {
  configure_missing_chip();
  EXPECT_EQ(wait_for(start({"--out", "r.db", "--wait-for-devices", "--duration-s", "0.3"})), 4);
  for (const int signal : {SIGINT, SIGTERM}) {
    const pid_t child = start({"--out", "r.db", "--wait-for-devices"});
    wait_until([&] { return text_of("err").find("waiting") != std::string::npos; });
    ::kill(child, signal);
    EXPECT_EQ(wait_for(child), 4);
  }
  EXPECT_FALSE(fs::exists(folder_ / "r.db"));
}

TEST_F(EncoderProgram, PrintsALineOfJsonEverySecondAndStopsAtASignalWithAValidFile) {
  configure_replay();
  const pid_t child = start({"--out", "r.db", "--json"});
  wait_until([&] {
    const std::string text = text_of("out");
    return std::count(text.begin(), text.end(), '\n') >= 2;
  });
  ::kill(child, SIGTERM);
  EXPECT_EQ(wait_for(child), 0) << text_of("err");
  std::istringstream lines(text_of("out"));
  std::string line;
  while (std::getline(lines, line)) {
    const auto status = nlohmann::json::parse(line);
    const auto& joint = status.at("joints").at(0);
    EXPECT_EQ(joint.at("joint"), "shoulder");
    for (const char* key : {"counts", "position", "velocity", "edges_per_s", "losses"})
      EXPECT_TRUE(joint.contains(key)) << key;
    EXPECT_TRUE(status.contains("fullest_ring"));
  }
  const auto recording = record::load_recording(folder_ / "r.db", {});
  ASSERT_TRUE(recording.ok()) << recording.error().message;
  EXPECT_GT(recording->rows(), 500);
}

TEST_F(EncoderProgram, SaysWhichRowsHaveNoPositionAndHowTheyGetOne) {
  configure_replay("");
  EXPECT_EQ(wait_for(start({"--out", "r.db", "--duration-s", "0.5"})), 0);
  const std::string without = text_of("err");
  EXPECT_NE(without.find("the zero is unknown: shoulder; --home"), std::string::npos) << without;
  EXPECT_EQ(wait_for(start({"--out", "p.db", "--duration-s", "0.5", "--json"})), 0);
  const std::string lines = text_of("out");
  EXPECT_NE(lines.find(R"("without_zero":["shoulder"])"), std::string::npos) << lines;
  fs::remove(folder_ / "motion.db");
  configure_replay();
  EXPECT_EQ(wait_for(start({"--out", "q.db", "--duration-s", "0.5"})), 0);
  EXPECT_EQ(text_of("err"), "");
}

TEST_F(EncoderProgram, AReplayThatMissesRowsEndsAsADeviceThatLostData) {
  configure_replay();
  auto edges = record::load_recording(folder_ / "motion.db", {});
  ASSERT_TRUE(edges.ok()) << edges.error().message;
  record::Recording cut = *edges;
  for (Eigen::Index row = 4000; row + 3 < edges->rows(); ++row) {
    cut.samples.row(row) = edges->samples.row(row + 3);
    cut.t_ns[static_cast<std::size_t>(row)] = edges->t_ns[static_cast<std::size_t>(row + 3)];
  }
  cut.samples.conservativeResize(edges->rows() - 3, Eigen::NoChange);
  cut.t_ns.resize(cut.t_ns.size() - 3);
  ASSERT_TRUE(record::write_recording(cut, folder_ / "cut.db", true).ok());
  EXPECT_EQ(wait_for(start({"--out", "w.db", "--replay", "motion.db", "--replay-speed", "0"})), 0);
  EXPECT_EQ(text_of("err"), "");
  EXPECT_EQ(wait_for(start({"--out", "r.db", "--replay", "cut.db", "--replay-speed", "0"})), 4);
  const std::string text = text_of("err");
  EXPECT_NE(text.find("data was lost: shoulder 1 times"), std::string::npos) << text;
  const auto written = record::load_recording(folder_ / "r.db", {});
  ASSERT_TRUE(written.ok()) << written.error().message;
  ASSERT_EQ(written->events.size(), 1U);
  EXPECT_NE(written->events[0].detail.find("\"amount\":3,"), std::string::npos);
}

TEST_F(EncoderProgram, TellsTheServiceManagerThatItIsReadyAliveAndStopping) {
  configure_replay();
  const int manager = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::string path = (folder_ / "notify").string();
  ASSERT_LT(path.size(), sizeof(address.sun_path));
  std::memcpy(address.sun_path, path.c_str(), path.size());
  ASSERT_EQ(::bind(manager, reinterpret_cast<sockaddr*>(&address), sizeof(address)), 0);
  ::setenv("NOTIFY_SOCKET", path.c_str(), 1);
  const pid_t child = start({"--out", "r.db"});
  ::unsetenv("NOTIFY_SOCKET");
  const auto next = [&] {
    char text[256] = {};
    (void)!::recv(manager, text, sizeof(text) - 1, 0);
    return std::string(text);
  };
  EXPECT_EQ(next().rfind("READY=1", 0), 0U);
  EXPECT_EQ(next(), "WATCHDOG=1");
  EXPECT_EQ(next(), "WATCHDOG=1") << "once a second, before the unit's three are over";
  ::kill(child, SIGINT);
  std::string last = next();
  while (last == "WATCHDOG=1") last = next();
  EXPECT_EQ(last, "STOPPING=1");
  EXPECT_EQ(wait_for(child), 0);
  ::close(manager);
}

}  // namespace
}  // namespace ravencal::quadrature_reader
