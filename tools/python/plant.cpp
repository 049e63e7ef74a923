// SPDX-License-Identifier: Apache-2.0
#include "physics/plant.hpp"

#include <fmt/format.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <filesystem>
#include <memory>

#include "core/whole_file.hpp"
#include "exchange/table_file.hpp"
#include "guess/guess.hpp"
#include "physics/plant_writer.hpp"
#include "python/arrays.hpp"
#include "python/module.hpp"

namespace ravencal::python {
namespace {

using physics::Plant;

void save_plant(const Plant& plant, const std::filesystem::path& path, bool overwrite) {
  if (!overwrite && std::filesystem::exists(path)) throw Failure(core::exists_already(path));
  succeed(core::write_whole_file(path, physics::plant_text(plant)));
}

/// What guess_profile says of a table.
struct GuessedProfile {
  std::string text, description;
  std::vector<std::string> questions;
};

GuessedProfile guess_profile(const py::object& data, const std::vector<std::string>& joints,
                             bool skip_bad) {
  record::LoadOptions options;
  options.skip_bad = skip_bad;
  const record::Table table =
      py::isinstance<py::dict>(data)
          ? table_of(data.cast<py::dict>(), "arrays")
          : value_of(exchange::read_table(data.cast<std::filesystem::path>(), options));
  const guess::Guess guessed = value_of(guess::guess_profile(table, joints));
  return {guess::profile_text(guessed, table), guess::describe(guessed, table), guessed.questions};
}

}  // namespace

void add_plant(py::module_& module) {
  py::class_<Plant, std::shared_ptr<Plant>>(module, "Plant", "A robot as its simulation has it.")
      .def_static(
          "load",
          [](const std::filesystem::path& path) { return value_of(physics::load_plant(path)); },
          py::arg("path"))
      .def("text", &physics::plant_text)
      .def("save", &save_plant, py::arg("path"), py::kw_only(), py::arg("overwrite") = false)
      .def_property_readonly("name", [](const Plant& plant) { return plant.robot.name; })
      .def_readonly("source", &Plant::source)
      .def_readonly("notes", &Plant::notes)
      .def("_json", &physics::describe_plant_in_json)
      .def("__str__", &physics::describe_plant);
  py::class_<GuessedProfile>(module, "GuessedProfile", "What the columns of a table may be.")
      .def_readonly("text", &GuessedProfile::text)
      .def_readonly("questions", &GuessedProfile::questions)
      .def("__str__", [](const GuessedProfile& guessed) { return guessed.description; });
  module.def("guess_profile", &guess_profile,
             "Says what the columns of a file, or arrays by name, may be.", py::arg("data"),
             py::arg("joints") = std::vector<std::string>(), py::arg("skip_bad") = false);
}

}  // namespace ravencal::python
