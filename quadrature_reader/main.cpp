// SPDX-License-Identifier: Apache-2.0
//
// ravencal-encoders: reads the joint encoders and writes a recording.
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <thread>

#include "cli/documentation.hpp"
#include "cli/exit_code.hpp"
#include "cli/files.hpp"
#include "cli/interrupt.hpp"
#include "cli/numbers.hpp"
#include "cli/program.hpp"
#include "cli/words.hpp"
#include "core/terminal.hpp"
#include "core/units.hpp"
#include "core/version.hpp"
#include "quadrature_reader/live_view.hpp"
#include "quadrature_reader/logger.hpp"
#include "quadrature_reader/ros/bridge.hpp"
#include "quadrature_reader/service_notify.hpp"
#include "quadrature_reader/setup_check.hpp"

namespace {

using namespace ravencal;
namespace qr = ravencal::quadrature_reader;

struct Arguments {
  std::string config;
  std::string out;
  std::string replay;
  double replay_speed = 0.0;
  std::vector<std::string> pose;
  qr::LoggerOptions logger;
  bool json = false;
  bool check_setup = false;
  bool publish_ros = false;
  bool wait_for_devices = false;
};

int complain(const core::Error& error) {
  core::remark("ravencal-encoders: {}\n", error.message);
  return cli::exit_code_of(error.code);
}

/// Shows the state: a table that is redrawn on a terminal, or JSON lines.
class Display {
 public:
  explicit Display(bool json) : json_(json), terminal_(!json && isatty(STDERR_FILENO) != 0) {}

  void show(const qr::LoggerStatus& status) {
    if (calls_++ % kCallsPerSecond == 0 || status.ended) {
      qr::notify_service_manager("WATCHDOG=1");
      if (json_) {
        core::say("{}\n", qr::json_of(status));
      }
    }
    if (!status.trouble.empty() && status.trouble != trouble_ && !terminal_) {
      core::remark("ravencal-encoders: {}\n", status.trouble);
    }
    trouble_ = status.trouble;
    if (!terminal_ && status.ended && !status.without_zero.empty()) {
      core::remark("ravencal-encoders: {}\n", qr::advice_on_zeros(status.without_zero));
    }
    if (const std::string lost = qr::losses_in(status); status.ended && !lost.empty() && !terminal_)
      core::remark("ravencal-encoders: {}\n", lost);
    if (!terminal_) return;
    const std::string table = qr::table_of(status);
    // Back to the first line of the last table, then clear to the end of the screen.
    if (lines_ > 0) core::draw(STDERR_FILENO, fmt::format("\033[{}A\r\033[J", lines_));
    core::remark("{}", table);
    lines_ = std::count(table.begin(), table.end(), '\n');
  }

 private:
  static constexpr int kCallsPerSecond = 10;
  bool json_;
  bool terminal_;
  int calls_ = 0;
  std::ptrdiff_t lines_ = 0;
  std::string trouble_;
};

std::atomic<qr::Logger*> running_logger{nullptr};

void home_again(int) {
  if (qr::Logger* logger = running_logger.load()) logger->home_again();
}

/// "shoulder=30deg" as joint and SI value, if the joint and the unit fit the configuration.
core::Result<std::pair<std::string, double>> parse_pose(const std::string& text,
                                                        const qr::Config& config) {
  const auto equals = text.find('=');
  const std::string joint = text.substr(0, equals);
  const auto encoder =
      std::find_if(config.encoders.begin(), config.encoders.end(),
                   [&](const auto& candidate) { return candidate.axis.joint == joint; });
  const std::string value_text = equals == std::string::npos ? "" : text.substr(equals + 1);
  const auto number = cli::leading_number(value_text);
  const auto unit = number ? core::find_unit(number->second) : std::nullopt;
  if (encoder == config.encoders.end() || !unit || unit->si_name != encoder->axis.unit) {
    return core::Error{
        core::ErrorCode::kUsage,
        fmt::format("--pose {}: must be JOINT=VALUE with the unit, as shoulder=30deg or "
                    "insertion=400mm, for a joint of {}",
                    text, config.path.string())};
  }
  return std::pair{joint, number->first * unit->to_si};
}

/// The logger, as soon as every device is there: at once, or when waiting is wanted and neither a
/// signal nor the end of the duration comes first.
core::Result<std::unique_ptr<qr::Logger>> open_logger(const qr::Config& config,
                                                      const Arguments& arguments,
                                                      const qr::LoggerOptions& options) {
  constexpr auto kRetryPeriod = std::chrono::milliseconds(200);
  const auto started = std::chrono::steady_clock::now();
  std::string told;
  for (;;) {
    auto logger = qr::Logger::create(config, arguments.out, options);
    const std::chrono::duration<double> waited = std::chrono::steady_clock::now() - started;
    if (logger.ok() || logger.error().code != core::ErrorCode::kDevice ||
        !arguments.wait_for_devices || cli::interrupted() ||
        (options.duration_s > 0.0 && waited.count() >= options.duration_s)) {
      return logger;
    }
    if (logger.error().message != told) {
      told = logger.error().message;
      core::remark("ravencal-encoders: waiting: {}\n", told);
      qr::notify_service_manager(fmt::format("READY=1\nSTATUS=waiting: {}", told));
    }
    qr::notify_service_manager("WATCHDOG=1");
    std::this_thread::sleep_for(kRetryPeriod);
  }
}

/// The ROS bridge, if it is wanted; it gets rows through `options`.
core::Result<std::unique_ptr<qr::RosBridge>> open_ros(const qr::Config& config,
                                                      const Arguments& arguments,
                                                      qr::LoggerOptions& options) {
  if (!arguments.publish_ros) return std::unique_ptr<qr::RosBridge>();
  qr::RosBridgeOptions ros;
  for (const auto& encoder : config.encoders) ros.joints.push_back(encoder.axis.joint);
  ros.robot_recording = std::filesystem::path(arguments.out).replace_extension(".robot.db");
  if (const auto arm = config.meta.find("arm"); arm != config.meta.end()) ros.arm = arm->second;
  RAVENCAL_ASSIGN_OR_RETURN(auto bridge, qr::RosBridge::create(ros));
  options.on_row = [to = bridge.get()](std::int64_t t_ns, std::span<const qr::AxisSample> row) {
    to->offer(t_ns, row);
  };
  return bridge;
}

/// Closes the robot's recording and prints its totals; false if data was lost.
bool close_ros(qr::RosBridge& bridge, const Arguments& arguments) {
  const core::Status closed = bridge.finish();
  const qr::RosBridgeStatus status = bridge.status();
  if (!closed.ok()) (void)complain(closed.error());
  if (!status.trouble.empty()) core::remark("ravencal-encoders: ROS: {}\n", status.trouble);
  if (!arguments.json) {
    core::say("ROS: {} moments published, {} left out; {} robot states recorded\n",
              status.published, status.not_published, status.states);
    if (status.states > 0) {
      const std::string stem = std::filesystem::path(arguments.out).replace_extension("").string();
      core::say("next: ravencal merge {0}.robot.db {1} --out {0}.merged.db\n", stem, arguments.out);
    }
  }
  return closed.ok() && status.states_refused == 0;
}

int record_encoders(const Arguments& arguments) {
  auto config = qr::load_config(arguments.config);
  if (!config.ok()) return complain(config.error());
  if (!arguments.replay.empty())
    qr::replay_instead(*config, arguments.replay, arguments.replay_speed);
  qr::LoggerOptions options = arguments.logger;
  for (const auto& text : arguments.pose) {
    auto pose = parse_pose(text, *config);
    if (!pose.ok()) return complain(pose.error());
    options.pose_si.insert(*pose);
  }
  cli::catch_interrupts();
  auto ros = open_ros(*config, arguments, options);
  if (!ros.ok()) return complain(ros.error());
  auto logger = open_logger(*config, arguments, options);
  if (!logger.ok()) {
    const int code = complain(logger.error());
    if (code == cli::kDevice && !arguments.wait_for_devices) {
      core::remark(
          "nothing was recorded; 'ravencal-encoders --config {} --check-setup' gives the "
          "remedy, --wait-for-devices waits for the device\n",
          arguments.config);
    }
    return code;
  }
  running_logger = logger->get();
  (void)std::signal(SIGUSR1, home_again);
  qr::notify_service_manager("READY=1\nSTATUS=recording");
  Display display(arguments.json);
  const core::Status status =
      (*logger)->run(cli::interrupted, [&](const qr::LoggerStatus& now) { display.show(now); });
  (void)std::signal(SIGUSR1, SIG_IGN);
  running_logger = nullptr;
  qr::notify_service_manager("STOPPING=1");
  const bool ros_complete = *ros == nullptr || close_ros(**ros, arguments);
  const int code = status.ok() ? int{cli::kOk} : complain(status.error());
  if (code != cli::kOk && !(*logger)->failed()) return code;
  return (*logger)->failed() || !ros_complete ? cli::kDevice : cli::kOk;
}

int check_setup(const Arguments& arguments) {
  auto config = qr::load_config(arguments.config);
  if (!config.ok()) return complain(config.error());
  cli::catch_interrupts();
  const auto say = [](const qr::SetupFinding& finding) {
    const char* mark = finding.verdict == qr::Verdict::kGood      ? "  ok  "
                       : finding.verdict == qr::Verdict::kWarning ? " note "
                                                                  : " BAD  ";
    core::say("{}{}\n", mark, finding.text);
  };
  // The wiggle test needs a person at a terminal.
  const qr::SetupOptions options{isatty(STDIN_FILENO) != 0};
  const bool good = qr::check_setup(*config, options, say, cli::interrupted);
  if (!options.wiggle) core::say(" note the wiggle test was left out: it needs a terminal\n");
  core::say("{}\n", good ? "set-up is good" : "set-up needs the remedies above");
  return good ? cli::kOk : cli::kDevice;
}

cli::Paths robot_recording_beside(const CLI::App& app) {
  if (app.count("--publish-ros") == 0) return {};
  return {cli::path_of(app, "--out").replace_extension(".robot.db")};
}

int parse_and_run(int argc, char** argv) {
  cli::end_cleanly_at_signals();
  CLI::App app{"Reads the joint encoders of a robot and records every joint's true position."};
  app.set_version_flag("--version", core::kVersion);
  app.footer(
      "example:\n  ravencal-encoders --config encoders.toml --out truth.db --home --duration-s "
      "600\n"
      "exit code: 0 complete, 2 usage, 3 configuration or disk, 4 a device failed or data was "
      "lost\n"
      "(the recording is valid and says what is missing).\n");
  Arguments arguments;
  app.add_option("--config", arguments.config, "encoders, lines, scales (.toml)")->required();
  auto* out = app.add_option("--out", arguments.out, "recording to write (.db)");
  app.add_option("--duration-s", arguments.logger.duration_s, "stop after this time; 0: at Ctrl-C")
      ->check(cli::not_negative());
  app.add_flag(
      "--home", arguments.logger.home,
      "find every joint's zero from its hard stop while the robot homes; again at SIGUSR1");
  app.add_option("--pose", arguments.pose,
                 "the resting robot's pose now, e.g. shoulder=30deg insertion=400mm: sets zeros");
  app.add_flag("--edges", arguments.logger.every_edge, "one row per edge instead of a fixed rate");
  auto* replay = app.add_option("--replay", arguments.replay,
                                "take a recording made with --edges in place of the devices");
  app.add_option("--replay-speed", arguments.replay_speed,
                 "1: with its timing; 0: as fast as possible")
      ->check(cli::not_negative())
      ->needs(replay);
  app.add_flag("--publish-ros", arguments.publish_ros,
               "publish joint_enc and ext_jpos for ROS 1, and record ravenstate as OUT.robot.db");
  app.add_flag("--json", arguments.json, "one line of status per second, on standard output");
  app.add_option("--realtime-priority", arguments.logger.realtime_priority,
                 "SCHED_FIFO priority of the reader threads; 0: none")
      ->check(CLI::Range(0, 99));
  app.add_flag("--wait-for-devices", arguments.wait_for_devices,
               "wait for a device that is missing at the start instead of giving up");
  app.add_flag("--check-setup", arguments.check_setup,
               "go through devices, permissions, levels and directions, record nothing")
      ->excludes(out);
  const cli::FileOptions files = {.read = {"--config", "--replay"},
                                  .written = {"--out"},
                                  .also_written = robot_recording_beside};
  cli::declare_files(app, files);
  cli::check_numbers(app);
  cli::add_documentation(app, "ravencal-encoders");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return cli::explain(app, error);
  }
  if (arguments.check_setup) return check_setup(arguments);
  if (arguments.out.empty()) {
    core::remark("ravencal-encoders: --out is required (or --check-setup)\n");
    return cli::kUsage;
  }
  if (const core::Status status = cli::check_files(app, files); !status.ok())
    return complain(status.error());
  return record_encoders(arguments);
}

}  // namespace

int main(int argc, char** argv) {
  return cli::run_program("ravencal-encoders", [&] { return parse_and_run(argc, argv); });
}
