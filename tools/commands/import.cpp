// SPDX-License-Identifier: Apache-2.0
#include <memory>

#include "commands/command.hpp"
#include "commands/commands.hpp"
#include "commands/origin_options.hpp"
#include "core/terminal.hpp"
#include "exchange/load.hpp"
#include "record/recording_writer.hpp"
#include "record/summary.hpp"

namespace ravencal::commands {
namespace {

struct ImportArguments {
  std::string source;
  std::string out;
  OriginOptions origin;
  record::LoadOptions load;
};

core::Status run(const ImportArguments& arguments) {
  RAVENCAL_ASSIGN_OR_RETURN(record::Recording recording,
                            exchange::load_recording(arguments.source, arguments.load));
  const std::pair<const char*, const std::string*> said[] = {
      {"robot", &arguments.origin.robot},
      {"controller", &arguments.origin.controller},
      {"coordinates", &arguments.origin.coordinates}};
  for (const auto& [key, value] : said) {
    if (!value->empty()) recording.meta[key] = *value;
  }
  RAVENCAL_RETURN_IF_ERROR(warn_of_implausible({&recording}));
  RAVENCAL_RETURN_IF_ERROR(record::write_recording(recording, arguments.out, true));
  core::say("{}: {} rows, {} channels\n", arguments.out, recording.rows(),
            recording.channels.size());
  if (recording.meta["profile"] == "generic" && recording.calibratable_joints().empty()) {
    core::say(
        "no joint has both an estimate and a truth, so that nothing can be trained or diagnosed: a "
        "profile file gives roles (`export` writes one beside its .csv), or names such as "
        "estimate.elbow_rad and truth.elbow_rad\n");
  }
  const auto joined = recording.meta.find("joined");
  if (joined != recording.meta.end()) core::say("{}\n", joined->second);
  const auto dropped = recording.meta.find("dropped_rows");
  if (dropped != recording.meta.end()) {
    core::say("{} rows dropped; `ravencal info {}` lists them\n", dropped->second, arguments.out);
  }
  for (const record::Event& event : recording.events)
    if (event.kind == "unwrapped") core::say("{}\n", event.detail);
  for (const std::string& assumption : record::assumptions_of(recording, arguments.out))
    core::say("{}\n", assumption);
  return {};
}

}  // namespace

void add_import(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<ImportArguments>();
  CLI::App* command =
      app.add_subcommand("import", "Import a table, a bag or a damaged recording as a recording");
  command
      ->add_option("source", arguments->source,
                   "File to read (.csv, .npz, .mat, .h5, .mcap, .db3, .bag, .db)")
      ->required();
  command->add_option("--out", arguments->out, "Recording to create (.db)")->required();
  (void)add_load_options(*command, arguments->load);
  add_origin_options(*command, arguments->origin);
  command->add_flag("--force,--overwrite")->description("Replace a recording of that name");
  command->footer(
      "The truth of a bag keeps its stamps; `ravencal merge run3.bag run3.bag` also removes its\n"
      "transport delay.\n"
      "Examples: ravencal import run3.csv --profile raven2 --arm gold --coordinates motor --out "
      "run3.db\n"
      "          ravencal import run3.bag --profile raven2-bag --arm gold --out run3.db\n"
      "          ravencal import run3.npz --profile my_robot.toml --out run3.db");
  on_call(*command, exit_code, {.read = {"source", "--profile"}, .written = {"--out"}},
          [arguments] { return run(*arguments); });
}

}  // namespace ravencal::commands
