// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <memory>

#include "commands/command.hpp"
#include "commands/commands.hpp"
#include "core/terminal.hpp"
#include "exchange/load.hpp"
#include "exchange/table_file.hpp"
#include "exchange/table_summary.hpp"
#include "learn/model_description.hpp"
#include "learn/onnx_file.hpp"
#include "model/blob_writer.hpp"
#include "physics/plant.hpp"
#include "record/summary.hpp"

namespace ravencal::commands {
namespace {

struct InfoArguments {
  std::string file;
  bool json = false;
  record::LoadOptions load;
};

core::Result<std::string> describe_recording(const InfoArguments& arguments) {
  RAVENCAL_ASSIGN_OR_RETURN(const auto recording,
                            exchange::load_if_described(arguments.file, arguments.load));
  if (!recording) {
    RAVENCAL_ASSIGN_OR_RETURN(const record::Table table,
                              exchange::read_table(arguments.file, arguments.load));
    return arguments.json ? exchange::describe_in_json(table) + "\n"
                          : exchange::describe_in_words(table);
  }
  const record::Summary summary = record::summarise(*recording);
  return arguments.json ? record::describe_in_json(*recording, summary) + "\n"
                        : record::describe_in_words(*recording, summary);
}

core::Result<std::string> describe_plant_file(const InfoArguments& arguments) {
  RAVENCAL_ASSIGN_OR_RETURN(const physics::Plant plant, physics::load_plant(arguments.file));
  return arguments.json ? physics::describe_plant_in_json(plant) + "\n"
                        : physics::describe_plant(plant);
}

core::Result<std::string> describe_model(const InfoArguments& arguments) {
  RAVENCAL_ASSIGN_OR_RETURN(const model::CalibrationModel model, learn::read_onnx(arguments.file));
  return arguments.json ? learn::describe_in_json(model) + "\n" : learn::describe_in_words(model);
}

core::Result<std::string> describe_weights(const InfoArguments& arguments) {
  return arguments.json ? model::describe_blob_json(arguments.file)
                        : model::describe_blob(arguments.file);
}

/// Which function describes which kind of file.
struct FileKind {
  std::string_view extension;
  core::Result<std::string> (*describe)(const InfoArguments&);
};
constexpr std::array kFileKinds = {
    FileKind{".onnx", describe_model},      FileKind{".blob", describe_weights},
    FileKind{".toml", describe_plant_file}, FileKind{".xml", describe_plant_file},
    FileKind{".urdf", describe_plant_file},
};

core::Result<std::string> describe(const InfoArguments& arguments) {
  const std::string extension = std::filesystem::path(arguments.file).extension().string();
  for (const FileKind& kind : kFileKinds) {
    if (kind.extension == extension) return kind.describe(arguments);
  }
  if (extension == ".db" || extension == ".bag" || exchange::is_table(arguments.file))
    return describe_recording(arguments);
  std::string known;
  for (const FileKind& kind : kFileKinds) known += std::string(kind.extension) + ", ";
  return core::usage_error(fmt::format("{}: unknown kind of file; known: {}.db, .bag, {}",
                                       arguments.file, known,
                                       fmt::join(exchange::table_extensions(), ", ")));
}

}  // namespace

void add_info(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<InfoArguments>();
  CLI::App* command =
      app.add_subcommand("info", "Describe a recording, model, weights or plant in words");
  command->add_option("file", arguments->file, "File to describe")->required();
  command->add_flag("--json", arguments->json, "Print JSON");
  (void)add_load_options(*command, arguments->load);
  command->footer(
      "Files: recording, table (.csv, .npz, .npy, .mat, .h5, .mcap, .db3), model (.onnx), weights\n"
      "(.blob), plant (.toml), robot model (.xml, .urdf). Of a table without --profile: its "
      "columns.\n"
      "Examples: ravencal info run3.db\n"
      "          ravencal info run3.npz");
  on_call(*command, exit_code, {.read = {"file", "--profile"}}, [arguments]() -> core::Status {
    RAVENCAL_ASSIGN_OR_RETURN(const std::string text, describe(*arguments));
    core::say("{}", text);
    return {};
  });
}

}  // namespace ravencal::commands
