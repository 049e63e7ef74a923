// SPDX-License-Identifier: Apache-2.0
#include "learn/evaluate.hpp"

#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "cli/exit_code.hpp"
#include "cli/interrupt.hpp"
#include "cli/progress.hpp"
#include "commands/command.hpp"
#include "commands/commands.hpp"
#include "commands/same_seed_option.hpp"
#include "core/terminal.hpp"
#include "core/whole_file.hpp"
#include "exchange/load.hpp"
#include "host/replay.hpp"
#include "learn/calibration_report.hpp"
#include "learn/expectation.hpp"
#include "learn/onnx_file.hpp"
#include "record/load.hpp"
#include "report/report.hpp"
#include "shadow/operation.hpp"

namespace ravencal::commands {
namespace {

struct EvaluateArguments {
  std::string model;
  std::vector<std::string> recordings;
  std::string json;
  std::string report;
  std::string plugin;
  bool same_seed = false;
  record::LoadOptions load;
};

/// What the arm has with the plugin's limits, beside the network's own figures.
core::Result<host::Summary> as_applied(const EvaluateArguments& arguments,
                                       const model::CalibrationModel& model,
                                       const std::vector<record::Recording>& recordings) {
  cli::catch_interrupts();
  cli::Progress progress("evaluate");
  RAVENCAL_ASSIGN_OR_RETURN(
      host::Summary summary,
      host::replay(arguments.plugin, model, pointers_to(recordings), [&](double done) {
        progress.update(done);
        return !cli::interrupted();
      }));
  core::say("\nas the plugin applies it, in {} of {} ticks, each row held until the next:\n{}{}",
            summary.corrected_ticks, summary.ticks, learn::evaluation_table(summary.evaluation),
            host::limits_text(summary));
  return summary;
}

std::string json_of(const learn::Evaluation& evaluation,
                    const std::optional<host::Summary>& applied) {
  const std::string text = learn::evaluation_json(evaluation);
  if (!applied) return text;
  auto json = nlohmann::ordered_json::parse(text);
  json["as_applied"] = nlohmann::ordered_json::parse(learn::evaluation_json(applied->evaluation));
  json["as_applied"]["ticks"] = applied->ticks;
  json["as_applied"]["corrected_ticks"] = applied->corrected_ticks;
  json["as_applied"]["limited_rate"] = applied->counters.limited_rate;
  return json.dump(2) + "\n";
}

/// A recording of `monitor --record` has no truth and needs no model: it says what the plugin did.
core::Status show_operation(const EvaluateArguments& arguments, int& exit_code) {
  RAVENCAL_ASSIGN_OR_RETURN(const std::vector<record::Recording> recordings,
                            exchange::load_recordings({arguments.model}, arguments.load));
  const record::Recording& recording = recordings.front();
  if (!shadow::is_of_monitor(recording)) {
    return core::Error{core::ErrorCode::kUsage,
                       fmt::format("{}: evaluate needs a model and recordings with truth, or a "
                                   "recording of `ravencal monitor --record` alone",
                                   arguments.model)};
  }
  if (!arguments.report.empty() || !arguments.plugin.empty()) {
    return core::Error{core::ErrorCode::kUsage,
                       "a recording of the monitor has no --report and no --as-applied"};
  }
  RAVENCAL_ASSIGN_OR_RETURN(const shadow::Operation operation, shadow::operation_in(recording));
  core::say("{}", shadow::operation_text(operation));
  if (!shadow::findings(operation).empty()) exit_code = cli::kFinding;
  if (arguments.json.empty()) return {};
  return core::write_whole_file(arguments.json, shadow::operation_json(operation));
}

core::Status run(const EvaluateArguments& arguments, int& exit_code) {
  if (arguments.recordings.empty()) return show_operation(arguments, exit_code);
  RAVENCAL_ASSIGN_OR_RETURN(const model::CalibrationModel model, learn::read_onnx(arguments.model));
  RAVENCAL_ASSIGN_OR_RETURN(const std::vector<record::Recording> recordings,
                            exchange::load_recordings(arguments.recordings, arguments.load));
  for (const record::Recording& recording : recordings) {
    if (!shadow::is_of_monitor(recording)) continue;
    return core::Error{core::ErrorCode::kUsage,
                       fmt::format("{}: is a recording of the monitor, which has no truth; give it "
                                   "to evaluate alone",
                                   recording.source)};
  }
  RAVENCAL_RETURN_IF_ERROR(warn_of_implausible(pointers_to(recordings)));
  const learn::SharedSeeds shared = learn::shared_seeds(model.seeds, pointers_to(recordings));
  if (!arguments.same_seed) RAVENCAL_RETURN_IF_ERROR(learn::check_run_seeds(shared));
  RAVENCAL_ASSIGN_OR_RETURN(learn::Evaluation evaluation,
                            learn::evaluate(model, pointers_to(recordings)));
  evaluation.shared = shared;
  print_warnings(learn::warnings_of(evaluation, model, pointers_to(recordings)));
  core::say("{}{}", learn::evaluation_table(evaluation),
            learn::expectation_table(evaluation, true));
  std::optional<host::Summary> applied;
  if (!arguments.plugin.empty()) {
    RAVENCAL_ASSIGN_OR_RETURN(applied, as_applied(arguments, model, recordings));
  }
  if (!arguments.json.empty()) {
    RAVENCAL_RETURN_IF_ERROR(core::write_whole_file(arguments.json, json_of(evaluation, applied)));
  }
  if (!arguments.report.empty()) {
    RAVENCAL_RETURN_IF_ERROR(report::write_html(
        learn::make_report(model, evaluation, "evaluated recordings"), arguments.report));
    core::say("report: {}\n", arguments.report);
  }
  return {};
}

}  // namespace

void add_evaluate(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<EvaluateArguments>();
  CLI::App* command = app.add_subcommand(
      "evaluate", "Print RMSE and peak error per joint: raw, bias removed, calibrated");
  command
      ->add_option("model", arguments->model,
                   "Model (.onnx); or a recording of `monitor --record`, alone")
      ->required();
  command->add_option("recordings", arguments->recordings, "Recordings (.db, .csv)");
  command->add_option("--json", arguments->json, "Write the figures as JSON");
  command->add_option("--report", arguments->report, "Write an HTML page");
  command->add_option("--as-applied", arguments->plugin,
                      "libravencal_plugin.so: also show what the arm has with the plugin's limits, "
                      "as `host --recording` does");
  add_same_seed_option(*command, arguments->same_seed);
  (void)add_load_options(*command, arguments->load);
  command->footer(
      "The table shows the network's own correction. With the pedal down the plugin lets it "
      "change\n"
      "by at most a tenth of a joint's commanded motion: --as-applied shows what is left then.\n"
      "Trained motion: calibrated RMSE of rows within and beyond the speeds and efforts that the\n"
      "training had of the joint.\n"
      "A recording of `monitor --record` says what the plugin did, or in shadow would have done;\n"
      "exit 1: something in it speaks against arming.\n"
      "Example: ravencal evaluate arm.onnx test.db --json test.json\n"
      "         ravencal evaluate first_hour.db");
  on_call(*command, exit_code,
          {.read = {"model", "recordings", "--profile", "--as-applied"},
           .written = {"--json", "--report"},
           .together = true},
          [arguments, &exit_code] { return run(*arguments, exit_code); });
}

}  // namespace ravencal::commands
