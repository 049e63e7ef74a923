// SPDX-License-Identifier: Apache-2.0
#include "learn/evaluate.hpp"

#include <fmt/format.h>

#include <memory>

#include "cli/exit_code.hpp"
#include "commands/commands.hpp"
#include "learn/calibration_report.hpp"
#include "learn/onnx_file.hpp"
#include "learn/whole_file.hpp"
#include "record/load.hpp"
#include "report/report.hpp"

namespace ravencal::commands {
namespace {

struct Arguments {
  std::string model;
  std::vector<std::string> recordings;
  std::string json;
  std::string report;
  record::LoadOptions load;
};

core::Status run(const Arguments& arguments) {
  RAVENCAL_ASSIGN_OR_RETURN(const model::CalibrationModel model, learn::read_onnx(arguments.model));
  std::vector<record::Recording> recordings;
  for (const std::string& path : arguments.recordings) {
    RAVENCAL_ASSIGN_OR_RETURN(record::Recording recording,
                              record::load_recording(path, arguments.load));
    recordings.push_back(std::move(recording));
  }
  std::vector<const record::Recording*> pointers;
  for (const record::Recording& recording : recordings) pointers.push_back(&recording);
  RAVENCAL_ASSIGN_OR_RETURN(const learn::Evaluation evaluation, learn::evaluate(model, pointers));
  if (evaluation.rows_without_feature > 0) {
    fmt::print(stderr, "ravencal: warning: {} of {} rows are left out because a feature is lost\n",
               evaluation.rows_without_feature, evaluation.rows);
  }
  fmt::print("{}", learn::evaluation_table(evaluation));
  if (!arguments.json.empty()) {
    RAVENCAL_RETURN_IF_ERROR(
        learn::write_whole_file(arguments.json, learn::evaluation_json(evaluation)));
  }
  if (!arguments.report.empty()) {
    RAVENCAL_RETURN_IF_ERROR(report::write_html(
        learn::make_report(model, evaluation, "evaluated recordings"), arguments.report));
    fmt::print("report: {}\n", arguments.report);
  }
  return {};
}

}  // namespace

void add_evaluate(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand(
      "evaluate", "RMSE and peak error per joint: raw, bias removed, calibrated");
  command->add_option("model", arguments->model, "Model (.onnx)")->required();
  command->add_option("recordings", arguments->recordings, "Recordings (.db, .csv)")->required();
  command->add_option("--json", arguments->json, "Write the figures as JSON");
  command->add_option("--report", arguments->report, "Write a page to look at (.html)");
  command->add_option("--profile", arguments->load.profile, "Profile of .csv recordings");
  command->add_option("--arm", arguments->load.profile_options.arm, "raven2: the calibrated arm")
      ->check(CLI::IsMember({"gold", "green"}))
      ->capture_default_str();
  command->add_flag("--skip-bad", arguments->load.skip_bad, "Drop rows that cannot be read");
  command->footer("Example: ravencal evaluate arm.onnx test.db --json test.json");
  command->callback([arguments, &exit_code] {
    const core::Status status = run(*arguments);
    if (status.ok()) return;
    fmt::print(stderr, "ravencal: {}\n", status.error().message);
    exit_code = cli::exit_code_of(status.error().code);
  });
}

}  // namespace ravencal::commands
