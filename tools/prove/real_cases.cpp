// SPDX-License-Identifier: Apache-2.0
#include "prove/real_cases.hpp"

#include <cmath>

#include "prove/workspace.hpp"
#include "record/load.hpp"

namespace ravencal::prove {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using record::Role;

constexpr const char* kEmpsViscous =
    "\n  [[joint.effect]]\n  id = \"viscous_friction\"\n  damping_n_s_per_m = 203.5\n";
constexpr const char* kEmpsCoulomb =
    "\n  [[joint.effect]]\n  id = \"coulomb_friction\"\n  level_n = 20.39\n";
constexpr const char* kEmps = "Janot, Gautier, Brunot 2019 (IDIM-LS)";
/// Joint over recorded torque, which is at the gearbox output: reduction / 12.25.
constexpr double kUiucElbow = 121.5 / 12.25, kUiucInsertion = 2158.6 / 12.25;
constexpr const char* kUiuc = "least squares on the first 60 %, README of the recording";

std::size_t index_at(const record::Recording& r, double share) {
  return static_cast<std::size_t>(share * static_cast<double>(r.rows()));
}

/// Adds the effect to the recorded truth or effort.
core::Status inject(const RealCase& real, record::Recording& r) {
  const auto missing = [&real](const char* what) {
    return core::Error{core::ErrorCode::kData,
                       fmt::format("{}: joint {} has no {}", real.recording, real.joint, what)};
  };
  auto position = r.column(Role::kJointEstimate, real.joint);
  if (!position) position = r.column(Role::kMotorPosition, real.joint);
  if (!position) return missing("position");
  const VectorXd q = r.samples.col(*position);
  if (real.stage == "drive") {
    bool any = false;
    for (const Role role : {Role::kDriveTorque, Role::kDriveInput}) {
      const auto column = r.column(role, real.joint);
      if (!column || any) continue;
      if (real.id == "torque_ripple")
        r.samples.col(*column) +=
            (real.value / real.per_recorded * (real.order * q.array()).sin()).matrix();
      any = true;
    }
    return any ? core::Status() : core::Status(missing("effort"));
  }
  const auto truth = r.column(Role::kJointTruth, real.joint);
  if (!truth) return missing("truth");
  if (real.id == "gain_error") r.samples.col(*truth) += real.value * q;
  if (real.id == "eccentricity")
    r.samples.col(*truth) += (real.value * (real.order * q.array()).sin()).matrix();
  if (real.id == "coupling") {
    const auto other = r.column(Role::kJointEstimate, real.from);
    if (!other) return missing("other joint");
    r.samples.col(*truth) += real.value * r.samples.col(*other);
  }
  if (real.id == "slip") {
    const auto at = static_cast<Index>(index_at(r, 0.55));
    r.samples.col(*truth).tail(r.rows() - at).array() += real.value;
  }
  return {};
}

std::vector<std::pair<double, double>> interval_of(const RealCase& real,
                                                   const record::Recording& r) {
  const auto seconds = [&r](std::size_t i) {
    return static_cast<double>(r.t_ns[i] - r.t_ns.front()) * 1e-9;
  };
  std::vector<std::pair<double, double>> out;
  if (real.id == "slip") out = {{seconds(index_at(r, 0.55)), seconds(r.t_ns.size() - 1)}};
  if (real.id == "input_disturbance") {  // 0.5 s on every second second from 0.344 s
    for (double t_s = 0.344; t_s < 24.8; t_s += 1.0) out.emplace_back(t_s, t_s + 0.5);
  }
  return out;
}

}  // namespace

const std::vector<RealCase>& real_cases() {
  static const std::vector<RealCase> kCases = {
      {"ablated", "emps", "emps_train.csv", kEmpsViscous, "coulomb_friction", "carriage", "",
       "drive", "level", 20.39, 0, kEmps},
      {"ablated", "emps", "emps_train.csv", kEmpsCoulomb, "viscous_friction", "carriage", "",
       "drive", "damping", 203.5, 0, kEmps},
      {"ablated", "emps", "emps_test_pulses.csv", "", "input_disturbance", "carriage", "",
       "command", "size", 175.75, 0, "5 V times 35.15 N/V, README of the recording"},
      {"ablated", "raven2_uiuc", "raven2_joint123.csv", "", "coulomb_friction", "shoulder", "",
       "drive", "level", 0.044 * 136.196255507 / 12.25, 0, kUiuc},
      {"ablated", "raven2_uiuc", "raven2_joint123.csv", "", "coulomb_friction", "elbow", "",
       "drive", "level", 0.087 * kUiucElbow, 0, kUiuc},
      {"ablated", "raven2_uiuc", "raven2_joint123.csv", "", "coulomb_friction", "insertion", "",
       "drive", "level", 0.074 * kUiucInsertion, 0, kUiuc},
      {"ablated", "raven2_uiuc", "raven2_joint123.csv", "", "gravity", "shoulder", "", "drive", "",
       0, 0, ""},
      {"ablated", "dvrk_berkeley", "train_random.csv", "", "homing_offset", "q4", "",
       "transmission", "", 0, 0, ""},
      {"ablated", "dvrk_berkeley", "train_random.csv", "", "coupling", "q6", "q5", "transmission",
       "", 0, 0, ""},
      {"ablated", "bam_xl330", "xl330_kp400_sin_time_square.csv", "", "controller_gain", "pendulum",
       "", "command", "ratio", 0.5, 0,
       "divisor 256 measured, 128 in the manual, README of the recording"},
      {"injected", "emps", "emps_train.csv", std::string(kEmpsViscous) + kEmpsCoulomb,
       "torque_ripple", "carriage", "", "drive", "amplitude", 12.0, 314.16, "added"},
      {"injected", "raven2_uiuc", "raven2_joint123.csv", "", "torque_ripple", "elbow", "", "drive",
       "amplitude", 0.03 * kUiucElbow, 2.0 * kUiucElbow, "added", kUiucElbow},
      {"injected", "dvrk_berkeley", "train_random.csv", "", "gain_error", "q1", "", "transmission",
       "ratio", 0.02, 0, "added"},
      {"injected", "dvrk_berkeley", "train_random.csv", "", "coupling", "q2", "q1", "transmission",
       "error", 0.02, 0, "added"},
      {"injected", "dvrk_berkeley", "train_random.csv", "", "slip", "q1", "", "transmission",
       "size", 0.008, 0, "added"},
      {"injected", "dvrk_berkeley", "train_random.csv", "", "eccentricity", "q2", "",
       "transmission", "amplitude", 0.003, 40.0, "added"},
  };
  return kCases;
}

core::Status have_real_recordings(const std::filesystem::path& data,
                                  const std::filesystem::path& house) {
  for (const RealCase& real : real_cases()) {
    for (const auto& path :
         {data / real.set / real.recording, house / "profiles" / (real.set + ".toml"),
          house / "plants" / (real.set + ".toml")}) {
      if (!std::filesystem::exists(path))
        return core::Error{core::ErrorCode::kIo,
                           fmt::format("{}: is not there; the real cases need it. Give its folder "
                                       "by --data or --house, or leave --data out",
                                       path.string())};
    }
  }
  return {};
}

core::Result<CaseFiles> make_real_case(const RealCase& real, const std::filesystem::path& data,
                                       const std::filesystem::path& house, std::uint64_t seed) {
  record::LoadOptions load;
  load.profile = (house / "profiles" / (real.set + ".toml")).string();
  CaseFiles files;
  RAVENCAL_ASSIGN_OR_RETURN(files.recording,
                            record::load_recording(data / real.set / real.recording, load));
  RAVENCAL_ASSIGN_OR_RETURN(files.plant,
                            core::read_whole_file(house / "plants" / (real.set + ".toml")));
  // A term that the plant still has would conceal nothing.
  if (files.plant.find(fmt::format("id = \"{}\"", real.id)) != std::string::npos)
    return core::Error{core::ErrorCode::kData,
                       fmt::format("{}: the plant has {}, which the case wants left out",
                                   (house / "plants" / (real.set + ".toml")).string(), real.id)};
  files.plant += real.plant_addition;
  if (real.track == "injected") RAVENCAL_RETURN_IF_ERROR(inject(real, files.recording));
  Json subject = {{"id", real.id},
                  {"outside", false},
                  {"joint", real.joint},
                  {"joint_seen", real.joint},
                  {"from", real.from},
                  {"stage", real.stage},
                  {"parameter", real.parameter},
                  {"value", real.value},
                  {"value_from", real.source},
                  {"amplitude", real.value},
                  {"channel", ""},
                  {"testable", true},
                  {"interval_s", interval_of(real, files.recording)},
                  {"position", Json::array()}};
  const Json manifest = {{"schema", 1},
                         {"case", 0},
                         {"track", real.track},
                         {"kind", real.track},
                         {"robot", fmt::format("{}/{}", real.set, real.recording)},
                         {"motion", "as recorded"},
                         {"seeds", {seed}},
                         {"subjects", Json::array({subject})},
                         {"parameter_off", nullptr},
                         {"floors", Json::object()}};
  files.manifest = manifest.dump(1) + "\n";
  return files;
}

}  // namespace ravencal::prove
