// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <algorithm>
#include <filesystem>
#include <optional>
#include <utility>

#include "diagnose/diagnose.hpp"
#include "diagnose/given.hpp"
#include "diagnose/report/improved_robot.hpp"
#include "diagnose/report/write_report.hpp"
#include "diagnose/track/input.hpp"
#include "physics/plant.hpp"
#include "python/long_work.hpp"
#include "python/module.hpp"
#include "python/recording.hpp"

namespace ravencal::python {
namespace {

using Held = std::vector<RecordingPointer>;

/// What ravencal.Report hands on.
struct MadeReport {
  diagnose::Report report;
  std::filesystem::path plant_file;
};

/// As the program reads it: of a .db only the channels that a diagnosis looks at.
record::Recording as_read(const record::Recording& recording) {
  if (std::filesystem::path(recording.source).extension() != ".db") return recording;
  std::vector<Eigen::Index> columns;
  record::Recording kept{recording.meta,  {}, recording.t_ns, {}, recording.events,
                         recording.source};
  for (std::size_t c = 0; c < recording.channels.size(); ++c) {
    if (!diagnose::looks_at(recording.channels[c])) continue;
    columns.push_back(static_cast<Eigen::Index>(c));
    kept.channels.push_back(recording.channels[c]);
  }
  kept.samples = recording.samples(Eigen::all, columns);
  return kept;
}

std::vector<record::Recording> as_read(const Held& recordings) {
  std::vector<record::Recording> all;
  for (const RecordingPointer& held : recordings) all.push_back(as_read(held->recording));
  return all;
}

std::vector<diagnose::GivenRecording> given_of(const Held& recordings) {
  std::vector<diagnose::GivenRecording> given;
  for (const RecordingPointer& held : recordings)
    given.push_back({held->recording.source, held->profile, held->range});
  return given;
}

/// Blocks and folds follow the order of the recordings, and the verdict must not.
void put_in_order(Held& recordings) {
  std::stable_sort(recordings.begin(), recordings.end(), [](const auto& one, const auto& other) {
    return one->recording.source < other->recording.source;
  });
}

/// What lies in no file is told apart by the object alone.
void check_once(const Held& training, const Held& held_out) {
  Held all = training;
  all.insert(all.end(), held_out.begin(), held_out.end());
  std::sort(all.begin(), all.end());
  const auto twice = std::adjacent_find(all.begin(), all.end());
  if (twice == all.end()) return;
  throw Failure(core::usage_error(
      fmt::format("{}: is given twice; it counts once", (*twice)->recording.source)));
}

void check(const diagnose::Options& options) {
  const auto refuse = [](std::string why) { return Failure(core::usage_error(std::move(why))); };
  if (!(options.alpha >= diagnose::kLeastAlpha && options.alpha <= diagnose::kMostAlpha)) {
    throw refuse(fmt::format("alpha: {} is not in {} to {}", options.alpha, diagnose::kLeastAlpha,
                             diagnose::kMostAlpha));
  }
  if (options.placebos < 0 || options.placebos > diagnose::kMostPlacebos) {
    throw refuse(
        fmt::format("placebos: {} is not in 0 to {}", options.placebos, diagnose::kMostPlacebos));
  }
}

MadeReport diagnose_recordings(const py::object& training, const py::object& held_out,
                               const physics::Plant& plant, const py::object& simulated,
                               diagnose::Options options, const py::object& progress) {
  check(options);
  Held to_fit = recordings_of(training);
  Held unseen = recordings_of(held_out);
  const Held other = recordings_of(simulated);
  if (to_fit.empty()) throw Failure(core::usage_error("give at least one recording"));
  if (other.empty()) {  // else the order pairs them
    put_in_order(to_fit);
    put_in_order(unseen);
  }
  const diagnose::Given given{given_of(to_fit), given_of(unseen), given_of(other)};
  succeed(diagnose::check_given(given));
  check_once(to_fit, unseen);
  const auto work = [&](Watch& watch) -> core::Result<MadeReport> {
    options.simulated = as_read(other);
    options.look = [&](double share, std::string_view what) { return watch.go_on(share, what); };
    RAVENCAL_ASSIGN_OR_RETURN(diagnose::Report report,
                              diagnose::diagnose(as_read(to_fit), as_read(unseen), plant, options));
    diagnose::add_provenance(given, plant, options, report);
    return MadeReport{std::move(report), plant.source};
  };
  return away_from_python(progress, work);
}

}  // namespace

void add_diagnosis(py::module_& module) {
  py::class_<MadeReport>(module, "_Report")
      .def("json", [](const MadeReport& made) { return diagnose::report_json(made.report); })
      .def("improved", [](const MadeReport& made) { return made.report.improved; })
      .def("write", [](const MadeReport& made, const std::filesystem::path& folder) {
        const py::gil_scoped_release unlocked;
        diagnose::Report report = made.report;
        (void)value_of(diagnose::write_with_robot(report, made.plant_file, folder));
      });
  module.attr("_USUAL_PLACEBOS") = diagnose::kUsualPlacebos;
  module.def("_diagnose",
             [](const py::object& training, const py::object& held_out, const physics::Plant& plant,
                const py::object& simulated, const std::optional<double>& held_out_from_s,
                bool all_rows, double alpha, int placebos, std::uint64_t seed, unsigned threads,
                const py::object& progress) {
               diagnose::Options options;
               options.held_out_from_s = held_out_from_s;
               options.all_rows = all_rows;
               options.alpha = alpha;
               options.placebos = placebos;
               options.seed = seed;
               options.threads = threads;
               return diagnose_recordings(training, held_out, plant, simulated, options, progress);
             });
}

}  // namespace ravencal::python
