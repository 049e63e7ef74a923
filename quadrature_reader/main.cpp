// SPDX-License-Identifier: Apache-2.0
//
// ravencal-encoders: reads the joint encoders and writes a recording.
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>

#include "cli/exit_code.hpp"
#include "cli/interrupt.hpp"
#include "core/version.hpp"
#include "quadrature_reader/live_view.hpp"
#include "quadrature_reader/logger.hpp"
#include "quadrature_reader/service_notify.hpp"

namespace {

using namespace ravencal;
namespace qr = ravencal::quadrature_reader;

struct Arguments {
  std::string config;
  std::string out;
  qr::LoggerOptions logger;
  bool json = false;
};

int complain(const core::Error& error) {
  fmt::print(stderr, "ravencal-encoders: {}\n", error.message);
  return cli::exit_code_of(error.code);
}

/// Shows the state where there is somebody to see it: a table redrawn on a terminal, JSON lines.
class Display {
 public:
  explicit Display(bool json) : json_(json), terminal_(!json && isatty(STDERR_FILENO) != 0) {}

  void show(const qr::LoggerStatus& status) {
    if (calls_++ % kCallsPerSecond == 0) {
      qr::notify_service_manager("WATCHDOG=1");
      if (json_) {
        fmt::print("{}\n", qr::json_of(status));
        std::fflush(stdout);
      }
    }
    if (!status.trouble.empty() && status.trouble != trouble_ && !terminal_) {
      fmt::print(stderr, "ravencal-encoders: {}\n", status.trouble);
    }
    trouble_ = status.trouble;
    if (!terminal_) return;
    const std::string table = qr::table_of(status);
    // Back to the first line of the last table, then clear to the end of the screen.
    if (lines_ > 0) fmt::print(stderr, "\033[{}A\r\033[J", lines_);
    fmt::print(stderr, "{}", table);
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

int record_encoders(const Arguments& arguments) {
  auto config = qr::load_config(arguments.config);
  if (!config.ok()) return complain(config.error());
  auto logger = qr::Logger::create(*config, arguments.out, arguments.logger);
  if (!logger.ok()) return complain(logger.error());
  cli::catch_interrupts();
  qr::notify_service_manager("READY=1");
  Display display(arguments.json);
  const core::Status status =
      (*logger)->run(cli::interrupted, [&](const qr::LoggerStatus& now) { display.show(now); });
  qr::notify_service_manager("STOPPING=1");
  if (!status.ok()) return complain(status.error());
  return (*logger)->failed() ? cli::kDevice : cli::kOk;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Reads the joint encoders of a robot and records every joint's true position."};
  app.set_version_flag("--version", core::kVersion);
  app.footer(
      "example:\n  ravencal-encoders --config encoders.toml --out truth.db --duration-s 600\n"
      "exit code: 0 complete, 2 usage, 3 configuration or disk, 4 a device failed or data was "
      "lost\n"
      "(the recording is valid and says what is missing).\n");
  Arguments arguments;
  app.add_option("--config", arguments.config, "encoders, lines, scales (.toml)")->required();
  app.add_option("--out", arguments.out, "recording to write (.db)")->required();
  app.add_option("--duration-s", arguments.logger.duration_s, "stop after this time; 0: at Ctrl-C")
      ->check(CLI::NonNegativeNumber);
  app.add_flag("--edges", arguments.logger.every_edge, "one row per edge instead of a fixed rate");
  app.add_flag("--json", arguments.json, "one line of status per second, on standard output");
  app.add_option("--realtime-priority", arguments.logger.realtime_priority,
                 "SCHED_FIFO priority of the reader threads; 0: none")
      ->check(CLI::Range(0, 99));
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? cli::kOk : cli::kUsage;
  }
  return record_encoders(arguments);
}
