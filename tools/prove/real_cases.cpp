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

Index slips_at(Index rows) { return static_cast<Index>(0.55 * static_cast<double>(rows)); }

VectorXd position_itself(const RealCase&, const VectorXd& q, const VectorXd&) { return q; }
VectorXd other_position(const RealCase&, const VectorXd&, const VectorXd& other) { return other; }
VectorXd wave_over_position(const RealCase& real, const VectorXd& q, const VectorXd&) {
  return (real.order * q.array()).sin();
}
VectorXd slipped(const RealCase&, const VectorXd& q, const VectorXd&) {
  VectorXd step = VectorXd::Ones(q.size());
  step.head(slips_at(q.size())).setZero();
  return step;
}

Intervals from_the_slip_on(const record::Recording& r) {
  const auto seconds = [&r](Index i) {
    return static_cast<double>(r.t_ns[static_cast<std::size_t>(i)] - r.t_ns.front()) * 1e-9;
  };
  return {{seconds(slips_at(r.rows())), seconds(r.rows() - 1)}};
}
/// 0.5 s on every second from 0.344 s.
Intervals pulses_of_emps(const record::Recording&) {
  Intervals out;
  for (double t_s = 0.344; t_s < 24.8; t_s += 1.0) out.emplace_back(t_s, t_s + 0.5);
  return out;
}

/// Adds the effect to the recorded truth or effort.
core::Status inject(const RealCase& real, record::Recording& r) {
  const auto column_of = [&r](const std::string& joint, std::initializer_list<Role> roles) {
    std::optional<Index> column;
    for (const Role role : roles)
      if (!column) column = r.column(role, joint);
    return column;
  };
  const auto missing = [&real](const char* what) {
    return core::Error{core::ErrorCode::kData,
                       fmt::format("{}: joint {} has no {}", real.recording, real.joint, what)};
  };
  const auto position = column_of(real.joint, {Role::kJointEstimate, Role::kMotorPosition});
  if (!position) return missing("position");
  const bool drive = real.stage == kDrive.word;
  const auto changed = drive ? column_of(real.joint, {Role::kDriveTorque, Role::kDriveInput})
                             : column_of(real.joint, {Role::kJointTruth});
  if (!changed) return missing(drive ? "effort" : "truth");
  const auto other = column_of(real.from, {Role::kJointEstimate});
  if (!other && !real.from.empty()) return missing("other joint");
  const VectorXd q = r.samples.col(*position);
  r.samples.col(*changed) += real.value / real.per_recorded *
                             real.form(real, q, other ? VectorXd(r.samples.col(*other)) : q);
  return {};
}

}  // namespace

const std::vector<RealCase>& real_cases() {
  static const std::vector<RealCase> kCases = {
      {"ablated", "emps", "emps_train.csv", kEmpsViscous, "coulomb_friction", "carriage", "",
       "drive", "level", 20.39, 0, kEmps},
      {"ablated", "emps", "emps_train.csv", kEmpsCoulomb, "viscous_friction", "carriage", "",
       "drive", "damping", 203.5, 0, kEmps},
      {"ablated", "emps", "emps_test_pulses.csv", "", "input_disturbance", "carriage", "",
       "command", "size", 175.75, 0, "5 V times 35.15 N/V, README of the recording", nullptr,
       pulses_of_emps},
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
       "torque_ripple", "carriage", "", "drive", "amplitude", 12.0, 314.16, "added",
       wave_over_position},
      {"injected", "raven2_uiuc", "raven2_joint123.csv", "", "torque_ripple", "elbow", "", "drive",
       "amplitude", 0.03 * kUiucElbow, 2.0 * kUiucElbow, "added", wave_over_position, nullptr,
       kUiucElbow},
      {"injected", "dvrk_berkeley", "train_random.csv", "", "gain_error", "q1", "", "transmission",
       "ratio", 0.02, 0, "added", position_itself},
      {"injected", "dvrk_berkeley", "train_random.csv", "", "coupling", "q2", "q1", "transmission",
       "error", 0.02, 0, "added", other_position},
      {"injected", "dvrk_berkeley", "train_random.csv", "", "slip", "q1", "", "transmission",
       "size", 0.008, 0, "added", slipped, from_the_slip_on},
      {"injected", "dvrk_berkeley", "train_random.csv", "", "eccentricity", "q2", "",
       "transmission", "amplitude", 0.003, 40.0, "added", wave_over_position},
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
  if (real.form != nullptr) RAVENCAL_RETURN_IF_ERROR(inject(real, files.recording));
  Json subject = {
      {"id", real.id},
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
      {"interval_s", real.interval_s != nullptr ? real.interval_s(files.recording) : Intervals{}},
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
