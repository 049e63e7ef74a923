// SPDX-License-Identifier: Apache-2.0
#include "e2e/ros_rig.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <fstream>
#include <numbers>
#include <sstream>
#include <thread>

namespace ravencal::test {
namespace {

namespace fs = std::filesystem;
using std::chrono::milliseconds;

constexpr double kDeg = std::numbers::pi / 180.0;

int code_of(int status) { return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status); }

}  // namespace

int free_port() {
  constexpr int kFirst = 12'000;
  constexpr int kCount = 20'000;
  for (int i = 0; i < kCount; ++i) {
    const int port = kFirst + (::getpid() + i) % kCount;
    const int socket = ::socket(AF_INET, SOCK_STREAM, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    const bool is_free = ::bind(socket, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0;
    ::close(socket);
    if (is_free) return port;
  }
  return 0;
}

bool wait_until(const std::function<bool()>& so) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::minutes(30);
  while (std::chrono::steady_clock::now() < end) {
    if (so()) return true;
    std::this_thread::sleep_for(milliseconds(20));
  }
  return false;
}

bool installed(const char* program) {
  return std::system(fmt::format("command -v {} >/dev/null 2>&1", program).c_str()) == 0;
}

Background::Background(const std::string& command) : pid_(::fork()) {
  if (pid_ == 0) {
    ::setpgid(0, 0);
    ::execl("/bin/sh", "sh", "-c", command.c_str(), nullptr);
    ::_exit(127);
  }
  ::setpgid(pid_, pid_);
}

Background::~Background() { (void)stop(SIGKILL); }

int Background::wait() {
  if (pid_ > 0) ::waitpid(pid_, &status_, 0);
  pid_ = 0;
  return code_of(status_);
}

int Background::stop(int signal) {
  if (pid_ > 0) ::kill(-pid_, signal);
  return wait();
}

bool Background::running() {
  if (pid_ > 0 && ::waitpid(pid_, &status_, WNOHANG) == pid_) pid_ = 0;
  return pid_ > 0;
}

std::string text_of(const fs::path& path) {
  std::stringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

void RosRig::SetUp() {
  for (const char* program : {"rosmaster", "rostopic", "rosbag", "rosservice"}) {
    if (!installed(program)) {
      GTEST_SKIP() << program
                   << " is not installed (python3-rosmaster, python3-rostopic, python3-rosbag, "
                      "python3-rosservice)";
    }
  }
  if (!fs::exists(RAVENCAL_ROS_PROGRAM))
    GTEST_SKIP() << "built without ROS: libroscpp-dev is not installed";
  folder_ = fs::temp_directory_path() / fmt::format("ravencal_e2e_{}", ::getpid());
  fs::remove_all(folder_);
  fs::create_directories(folder_);
  write_path("short.csv", 1.5, 3.0);
  port_ = free_port();
  environment_ = fmt::format(
      "cd '{}'; export ROS_MASTER_URI=http://127.0.0.1:{} ROS_IP=127.0.0.1 ROS_HOME='{}' "
      "PATH='{}':/usr/bin:/bin;",
      folder_.string(), port_, folder_.string(),
      fs::path(RAVENCAL_ROS_PROGRAM).parent_path().string());
}

void RosRig::TearDown() {
  robot_.reset();
  master_.reset();
  std::error_code ignored;
  if (!folder_.empty()) fs::remove_all(folder_, ignored);
}

void RosRig::start_master() {
  const auto answers = [&] { return run("rostopic list", "list.txt") == 0; };
  master_ = start(fmt::format("exec rosmaster --core -p {}", port_), "master.txt");
  ASSERT_TRUE(wait_until([&] { return !master_->running() || answers(); }));
  ASSERT_TRUE(master_->running()) << log("master.txt");
}

void RosRig::kill_master() { (void)master_->stop(SIGKILL); }

void RosRig::start_robot(const std::string& options) {
  robot_ = start(fmt::format("exec ravencal-ros robot --plant {}/tools/plants/raven2.toml {}",
                             RAVENCAL_SOURCE_DIR, options),
                 "robot.txt");
  const bool there = wait_until([&] {
    return !robot_->running() ||
           run("rosservice list | grep -q /r2_control/start", "list.txt") == 0;
  });
  ASSERT_TRUE(there && robot_->running()) << log("robot.txt");
}

void RosRig::kill_robot(int signal) { (void)robot_->stop(signal); }

int RosRig::run(const std::string& command, const std::string& log) const {
  return code_of(std::system(
      fmt::format("({} {}) >'{}' 2>&1", environment_, command, (folder_ / log).string()).c_str()));
}

std::unique_ptr<Background> RosRig::start(const std::string& command,
                                          const std::string& log) const {
  return std::make_unique<Background>(
      fmt::format("exec >'{}' 2>&1; {} {}", (folder_ / log).string(), environment_, command));
}

std::string RosRig::run_command(const std::string& more, double stale_s, double wait_s) const {
  return fmt::format(
      "ravencal-ros run --trajectory short.csv --out run.db --stale-s {} --wait-s {} {}", stale_s,
      wait_s, more);
}

bool RosRig::press(const std::string& call) const {
  return run("timeout 600 rosservice call /r2_control/" + call, "press.txt") == 0;
}

/// From home, the elbow back by `elbow_deg` and the shoulder up as far, and home again.
void RosRig::write_path(const std::string& name, double seconds, double elbow_deg) const {
  std::ofstream file(folder_ / name);
  file << "t_s,shoulder_rad,elbow_rad,insertion_m\n";
  constexpr int kRows = 100;
  for (int row = 0; row <= 2 * kRows; ++row) {
    const double share = static_cast<double>(row < kRows ? row : 2 * kRows - row) / kRows;
    file << fmt::format("{:.4f},{:.9f},{:.9f},{:.9f}\n", seconds * row / kRows,
                        (30.0 + elbow_deg * share) * kDeg, (90.0 - elbow_deg * share) * kDeg,
                        0.40 - 0.004 * share);
  }
}

}  // namespace ravencal::test
