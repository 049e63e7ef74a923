// SPDX-License-Identifier: Apache-2.0
#include "learn/evaluate.hpp"

#include <fmt/format.h>

#include <memory>

#include "commands/command.hpp"
#include "commands/commands.hpp"
#include "core/whole_file.hpp"
#include "learn/calibration_report.hpp"
#include "learn/onnx_file.hpp"
#include "record/load.hpp"
#include "report/report.hpp"

namespace ravencal::commands {
namespace {

struct EvaluateArguments {
  std::string model;
  std::vector<std::string> recordings;
  std::string json;
  std::string report;
  record::LoadOptions load;
};

core::Status run(const EvaluateArguments& arguments) {
  RAVENCAL_ASSIGN_OR_RETURN(const model::CalibrationModel model, learn::read_onnx(arguments.model));
  RAVENCAL_ASSIGN_OR_RETURN(const std::vector<record::Recording> recordings,
                            load_recordings(arguments.recordings, arguments.load));
  RAVENCAL_ASSIGN_OR_RETURN(const learn::Evaluation evaluation,
                            learn::evaluate(model, pointers_to(recordings)));
  if (evaluation.rows_without_feature > 0) {
    fmt::print(stderr, "ravencal: warning: {} of {} rows are left out because a feature is lost\n",
               evaluation.rows_without_feature, evaluation.rows);
  }
  for (const std::string& warning : learn::warnings_of(evaluation))
    fmt::print(stderr, "ravencal: warning: {}\n", warning);
  fmt::print("{}", learn::evaluation_table(evaluation));
  if (!arguments.json.empty()) {
    RAVENCAL_RETURN_IF_ERROR(
        core::write_whole_file(arguments.json, learn::evaluation_json(evaluation)));
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
  auto arguments = std::make_shared<EvaluateArguments>();
  CLI::App* command = app.add_subcommand(
      "evaluate", "Print RMSE and peak error per joint: raw, bias removed, calibrated");
  command->add_option("model", arguments->model, "Model (.onnx)")->required();
  command->add_option("recordings", arguments->recordings, "Recordings (.db, .csv)")->required();
  command->add_option("--json", arguments->json, "Write the figures as JSON");
  command->add_option("--report", arguments->report, "Write an HTML page");
  add_load_options(*command, arguments->load);
  command->footer("Example: ravencal evaluate arm.onnx test.db --json test.json");
  on_call(*command, exit_code,
          {.read = {"model", "recordings", "--profile"}, .written = {"--json", "--report"}},
          [arguments] { return run(*arguments); });
}

}  // namespace ravencal::commands
