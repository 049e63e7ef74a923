// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <pybind11/eigen.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <cmath>
#include <filesystem>
#include <optional>
#include <utility>

#include "core/temporary_folder.hpp"
#include "physics/plant.hpp"
#include "python/long_work.hpp"
#include "python/module.hpp"
#include "python/recording.hpp"
#include "record/load.hpp"
#include "record/recording_writer.hpp"
#include "simulation/follow.hpp"
#include "simulation/session.hpp"
#include "trajectory/trajectory.hpp"

namespace ravencal::python {
namespace {

namespace fs = std::filesystem;
using OptionalPath = std::optional<fs::path>;

/// A trajectory by its arrays: times [rows] and joints [rows, joints of the plant].
trajectory::Trajectory trajectory_of_arrays(const std::vector<double>& t_s,
                                            const Eigen::MatrixXd& joints_ji,
                                            const physics::Plant& plant) {
  const auto refuse = [](const std::string& why) {
    return Failure(core::data_error("trajectory: " + why));
  };
  const auto rows = static_cast<Eigen::Index>(t_s.size());
  const std::size_t joints = plant.joints.size();
  if (rows < 2 || joints_ji.rows() != rows ||
      joints_ji.cols() != static_cast<Eigen::Index>(joints)) {
    throw refuse(
        fmt::format("{} times and joints of shape {} x {}; it needs at least two times, and the "
                    "{} joints of {} for each",
                    rows, joints_ji.rows(), joints_ji.cols(), joints, plant.source));
  }
  if (!joints_ji.allFinite()) throw refuse("a joint is not a number");
  trajectory::Trajectory made;
  made.joints = trajectory::joints_of(plant);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const double time_s = t_s[static_cast<std::size_t>(i)];
    if (!std::isfinite(time_s) || (i > 0 && !(time_s > made.t_s.back())))
      throw refuse(fmt::format("row {}: time {} s does not rise", i, time_s));
    made.t_s.push_back(time_s);
    made.joints_ji.emplace_back(joints_ji.row(i));
  }
  succeed(trajectory::check_limits(made, plant, "trajectory"));
  return made;
}

trajectory::Trajectory trajectory_of(const py::object& given, const physics::Plant& plant) {
  if (!py::isinstance<py::tuple>(given))
    return value_of(trajectory::read_for_plant(given.cast<fs::path>(), plant));
  const auto [t_s, joints_ji] = given.cast<std::pair<std::vector<double>, Eigen::MatrixXd>>();
  return trajectory_of_arrays(t_s, joints_ji, plant);
}

physics::Plant loaded(physics::Plant plant, const std::optional<double>& payload_g) {
  if (payload_g && !(*payload_g >= 0.0))
    throw Failure(core::usage_error(fmt::format("payload_g: {} is below 0", *payload_g)));
  if (payload_g) plant.payload.mass_kg = *payload_g / 1000.0;
  return plant;
}

std::string name_of(const fs::path& file) { return file.filename().string(); }

std::shared_ptr<HeldRecording> simulate(const physics::Plant& given, const py::object& trajectory,
                                        const OptionalPath& out, const OptionalPath& edges,
                                        simulation::SessionOptions options,
                                        const std::optional<double>& payload_g,
                                        const py::object& progress) {
  const physics::Plant plant = loaded(given, payload_g);
  const trajectory::Trajectory motion = trajectory_of(trajectory, plant);
  options.trajectory_name =
      py::isinstance<py::tuple>(trajectory) ? "arrays" : name_of(trajectory.cast<fs::path>());
  options.edges = edges;
  const auto work = [&](Watch& watch) -> core::Result<record::Recording> {
    RAVENCAL_ASSIGN_OR_RETURN(const core::TemporaryFolder folder, core::TemporaryFolder::create());
    const fs::path file = out.value_or(folder.path() / "simulation.db");
    RAVENCAL_RETURN_IF_ERROR(
        simulation::record_session(plant, motion, file, options,
                                   [&](double share) { return watch.go_on(share, "simulation"); }));
    return record::load_recording(file, {});
  };
  auto made = std::make_shared<HeldRecording>(HeldRecording{away_from_python(progress, work)});
  if (!out) {
    made->recording.source =
        fmt::format("simulation of {}, seed {}", name_of(plant.source), options.seed);
  }
  return made;
}

std::shared_ptr<HeldRecording> follow(const physics::Plant& given,
                                      const RecordingPointer& recording, const OptionalPath& out,
                                      bool overwrite, const std::optional<double>& payload_g,
                                      const simulation::FollowOptions& options) {
  if (!(options.restart_s > 0.0)) {
    throw Failure(
        core::usage_error(fmt::format("restart_s: {} is not above 0", options.restart_s)));
  }
  const physics::Plant plant = loaded(given, payload_g);
  const auto work = [&](const Watch&) -> core::Result<simulation::FollowResult> {
    RAVENCAL_ASSIGN_OR_RETURN(simulation::FollowResult followed,
                              simulation::follow_recording(plant, recording->recording, options));
    if (out) {
      RAVENCAL_RETURN_IF_ERROR(record::write_recording(followed.recording, *out, overwrite));
      followed.recording.source = out->string();
    } else {
      followed.recording.source =
          fmt::format("{}, simulated", name_of(recording->recording.source));
    }
    return followed;
  };
  simulation::FollowResult followed = away_from_python(py::none(), work);
  return std::make_shared<HeldRecording>(
      HeldRecording{std::move(followed.recording), {}, {}, std::move(followed.joints)});
}

}  // namespace

void add_simulation(py::module_& module) {
  using Recording = std::shared_ptr<const HeldRecording>;
  module.def(
      "simulate",
      [](const physics::Plant& plant, const py::object& trajectory, const OptionalPath& out,
         bool overwrite, const OptionalPath& edges, std::uint64_t seed, std::uint64_t homing_seed,
         const std::optional<double>& payload_g, const std::optional<double>& rate_hz,
         double rehome_every_s, std::uint32_t rehomings, bool drift, const py::object& progress) {
        simulation::SessionOptions options;
        options.overwrite = overwrite;
        options.seed = seed;
        options.homing_seed = homing_seed;
        options.rate_hz = rate_hz;
        options.rehome_every_s = rehome_every_s;
        options.rehomings = rehomings;
        options.drift = drift;
        return simulate(plant, trajectory, out, edges, options, payload_g, progress);
      },
      "Simulates a plant along a trajectory.", py::arg("plant"), py::arg("trajectory"),
      py::kw_only(), py::arg("out") = py::none(), py::arg("overwrite") = false,
      py::arg("edges") = py::none(), py::arg("seed") = 1, py::arg("homing_seed") = 1,
      py::arg("payload_g") = py::none(), py::arg("rate_hz") = py::none(),
      py::arg("rehome_every_s") = 0.0, py::arg("rehomings") = 0, py::arg("drift") = false,
      py::arg("progress") = py::none());
  module.def(
      "simulate",
      [](const physics::Plant& plant, const std::shared_ptr<HeldRecording>& recording,
         const OptionalPath& out, bool overwrite, const std::optional<double>& payload_g,
         double restart_s, bool open_loop) {
        return follow(plant, Recording(recording), out, overwrite, payload_g,
                      {.restart_s = restart_s, .open_loop = open_loop});
      },
      "Simulates any robot along a recording of it.", py::arg("plant"), py::kw_only(),
      py::arg("follow"), py::arg("out") = py::none(), py::arg("overwrite") = false,
      py::arg("payload_g") = py::none(), py::arg("restart_s") = 1.0, py::arg("open_loop") = false);
}

}  // namespace ravencal::python
