// SPDX-License-Identifier: Apache-2.0
#include "diagnose/track/input.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>
#include <set>

#include "core/units.hpp"
#include "record/plausibility.hpp"
#include "record/summary.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using record::Recording;
using record::Role;

/// Share of the command's variance by which two logs of one command may differ. Source: on the
/// twin, sessions of one trajectory, each from a homing of its own, differ by less than a
/// ten-thousandth, and other motions of the same kind by a third and more; this lies between by the
/// same factor.
constexpr double kMostCommandMissed = 0.005;

core::Status check_held_out_from(const Recordings& training, double from_s) {
  const auto longest = std::max_element(
      training.begin(), training.end(),
      [](const Recording& a, const Recording& b) { return recorded_s(a) < recorded_s(b); });
  const auto refuse = [&](std::string_view why) {
    return core::usage_error(
        fmt::format("--held-out-from {:g}: {}; {} ends at {:.6g} s: give a time between 0 and that",
                    from_s, why, longest->source, recorded_s(*longest)));
  };
  if (!(from_s <= recorded_s(*longest))) return refuse("no recording is that long");
  if (!(from_s > 0.0)) return refuse("leaves no row to fit");
  return {};
}

/// Units in which a drive's input may come; the first is the one that the plant asks for.
std::vector<std::string> input_units(const physics::Drive& drive) {
  // A share of full scale has no unit, whatever the drive turns it into.
  if (drive.dac_counts_per_n_m != 0.0) return {"dac_counts", "1"};
  if (drive.input == "voltage_v") return {"V", "1"};
  if (drive.input == "current_a") return {"A", "1"};
  if (drive.input == "force_n") return {"N", "N_m", "1"};
  return {"N_m", "N", "1"};
}

/// Units in which the plant can take that channel of the joint; empty: any.
std::vector<std::string> units_of(Role role, const physics::Joint& joint) {
  const bool revolute = joint.kind == physics::JointKind::kRevolute;
  switch (role) {
    case Role::kDesiredPosition:
    case Role::kJointEstimate:
    case Role::kJointTruth:
      return {revolute ? "rad" : "m"};
    case Role::kMotorPosition:
      return revolute ? std::vector<std::string>{"rad"} : std::vector<std::string>{"rad", "m"};
    case Role::kDriveTorque:
      return {"N_m", "N"};
    case Role::kDriveInput:
      return input_units(joint.drive);
    default:
      return {};
  }
}

core::Status check_units(const Recording& recording, const physics::Plant& plant) {
  for (const record::Channel& channel : recording.channels) {
    const auto index = plant.joint_index(channel.joint);
    if (!index) continue;
    const physics::Joint& joint = plant.joints[*index];
    // Where the drive's effort was recorded, nobody asks what its input was.
    const bool unused =
        channel.role == Role::kDriveInput && recording.column(Role::kDriveTorque, joint.name);
    const std::vector<std::string> fit = units_of(channel.role, joint);
    if (unused || fit.empty() || std::find(fit.begin(), fit.end(), channel.unit) != fit.end())
      continue;
    const bool input = channel.role == Role::kDriveInput;
    return core::data_error(fmt::format(
        "{}: channel {} ({} of joint '{}') is in {}, but the plant {} takes {}; "
        "correct the channel's unit or the plant's {}",
        recording.source, channel.name, record::name_of(channel.role), joint.name, channel.unit,
        plant.source, fmt::join(fit, " or "), input ? "[joint.drive]" : "kind"));
  }
  return {};
}

/// A load that the plant names is part of every effort: without it nothing can be predicted.
core::Status check_external_loads(const Recording& recording, const physics::Plant& plant) {
  for (const physics::Joint& joint : plant.joints) {
    if (!joint.external_load || recording.column(joint.external_load->channel)) continue;
    std::vector<std::string> loads;
    for (const record::Channel& channel : recording.channels)
      if (channel.role == Role::kLoad) loads.push_back(channel.name);
    return core::data_error(
        fmt::format("{}: has no channel '{}', the [joint.external_load] of joint '{}' in {}; "
                    "recorded loads: {}",
                    recording.source, joint.external_load->channel, joint.name, plant.source,
                    loads.empty() ? "none" : fmt::format("{}", fmt::join(loads, ", "))));
  }
  return {};
}

std::string meta_or_empty(const Recording& recording, const std::string& key) {
  const auto it = recording.meta.find(key);
  return it == recording.meta.end() ? "" : it->second;
}

/// Simulators often count from zero: stamps that nowhere overlap count from each start.
std::int64_t shift_ns(const Recording& real, const Recording& simulated) {
  const bool overlap =
      simulated.t_ns.front() < real.t_ns.back() && real.t_ns.front() < simulated.t_ns.back();
  return overlap ? 0 : simulated.t_ns.front() - real.t_ns.front();
}

/// Fills the samples of `out`, and says how many rows the simulation covers.
Index interpolate(const Recording& simulated, std::int64_t shift, Recording& out) {
  std::size_t after = 1;
  Index covered = 0;
  for (Index i = 0; i < out.rows(); ++i) {
    const std::int64_t t = out.t_ns[static_cast<std::size_t>(i)] + shift;
    while (after + 1 < simulated.t_ns.size() && simulated.t_ns[after] < t) ++after;
    const std::int64_t t0 = simulated.t_ns[after - 1];
    const std::int64_t t1 = simulated.t_ns[after];
    if (t < t0 || t > t1) continue;
    const double share = t1 > t0 ? static_cast<double>(t - t0) / static_cast<double>(t1 - t0) : 0.0;
    const auto row = static_cast<Index>(after);
    out.samples.row(i) =
        (1.0 - share) * simulated.samples.row(row - 1) + share * simulated.samples.row(row);
    ++covered;
  }
  return covered;
}

/// Standard deviation of the finite values; 0 of fewer than two.
double deviation_of(const Eigen::Ref<const VectorXd>& x) {
  const auto finite = x.array().isFinite();
  const double count = finite.cast<double>().sum();
  if (count < 2.0) return 0.0;
  const double mean = finite.select(x.array(), 0.0).sum() / count;
  return std::sqrt(finite.select((x.array() - mean).square(), 0.0).sum() / count);
}

core::Status commanded_like(const Recording& real, const Recording& aligned) {
  for (const record::Channel& channel : real.channels) {
    if (channel.role != Role::kDesiredPosition) continue;
    const auto own = real.column(channel.role, channel.joint);
    const auto other = aligned.column(channel.role, channel.joint);
    if (!other) continue;
    const VectorXd desired = real.samples.col(*own);
    const double apart = deviation_of(desired - aligned.samples.col(*other));
    const double allowed = std::sqrt(kMostCommandMissed) * deviation_of(desired);
    if (apart <= allowed) continue;
    const core::DisplayUnit unit = core::display_unit(channel.unit);
    return core::data_error(fmt::format(
        "{}: is of another motion than {}: the desired position of joint {} differs by {:.3g} of "
        "{:.3g} {} RMS, and {:.3g} {} is the most; give a simulation of the same motion, in the "
        "order of the recordings",
        aligned.source, real.source, channel.joint, apart * unit.per_si,
        deviation_of(desired) * unit.per_si, unit.name, allowed * unit.per_si, unit.name));
  }
  return {};
}

}  // namespace

std::vector<const Recording*> in_order(const Recordings& training, const Recordings& held_out) {
  std::vector<const Recording*> all;
  for (const Recordings* list : {&training, &held_out})
    for (const Recording& recording : *list) all.push_back(&recording);
  return all;
}

bool is_effort_of_no_joint(const record::Channel& channel) {
  return channel.role == Role::kFeature && channel.joint.empty() &&
         (channel.unit == "N" || channel.unit == "N_m");
}

bool looks_at(const record::Channel& channel) {
  if (channel.role == Role::kTruthReading) return false;
  return channel.role != Role::kFeature || is_effort_of_no_joint(channel);
}

std::string file_name(const Recording& recording) {
  return std::filesystem::path(recording.source).filename().string();
}

double recorded_s(const Recording& recording) {
  if (recording.t_ns.empty()) return 0.0;
  return 1e-9 * static_cast<double>(recording.t_ns.back() - recording.t_ns.front());
}

core::Status check_input(const Recordings& training, const Recordings& held_out,
                         const physics::Plant& plant, std::optional<double> held_out_from_s) {
  if (held_out_from_s) RAVENCAL_RETURN_IF_ERROR(check_held_out_from(training, *held_out_from_s));
  for (const Recording* recording : in_order(training, held_out)) {
    RAVENCAL_RETURN_IF_ERROR(check_units(*recording, plant));
    RAVENCAL_RETURN_IF_ERROR(check_external_loads(*recording, plant));
  }
  const auto implausible = record::plausibility_warnings(in_order(training, held_out));
  return implausible.ok() ? core::Status() : implausible.error();
}

std::vector<std::string> input_notes(const Recordings& training, const Recordings& held_out,
                                     std::optional<double> held_out_from_s) {
  std::vector<std::string> notes;
  for (const Recording* recording : in_order(training, held_out)) {
    for (std::string& assumption : record::assumptions_of(*recording, file_name(*recording)))
      notes.push_back(std::move(assumption));
    for (const record::Implausibility& doubt : record::implausibilities(*recording))
      notes.push_back(fmt::format("{}: {}", file_name(*recording), doubt.sentence));
    const std::string dropped = meta_or_empty(*recording, "dropped_rows");
    if (!dropped.empty())
      notes.push_back(fmt::format("{} rows of {} cannot be read and are left out", dropped,
                                  file_name(*recording)));
  }
  if (!held_out_from_s) return notes;
  for (const Recording& recording : training) {
    if (recorded_s(recording) < *held_out_from_s)
      notes.push_back(
          fmt::format("{} ends at {:.6g} s, before --held-out-from {:g}: all of it is "
                      "fitted",
                      file_name(recording), recorded_s(recording), *held_out_from_s));
  }
  return notes;
}

core::Result<Recording> at_times_of(const Recording& real, const Recording& simulated,
                                    std::vector<std::string>& notes) {
  if (simulated.rows() < 2 || real.rows() < 1) {
    return core::data_error(
        fmt::format("{}: too few rows to stand for {}", simulated.source, real.source));
  }
  Recording out;
  out.channels = simulated.channels;
  out.events = real.events;
  out.t_ns = real.t_ns;
  out.source = simulated.source;
  out.samples.setConstant(real.rows(), simulated.samples.cols(),
                          std::numeric_limits<double>::quiet_NaN());
  const std::int64_t shift = shift_ns(real, simulated);
  if (shift != 0)
    notes.push_back(fmt::format(
        "the times of {} and {} nowhere overlap, so that each counts from its own start",
        file_name(simulated), file_name(real)));
  const Index covered = interpolate(simulated, shift, out);
  const auto covers = [&](const std::string& what) {
    return fmt::format("covers {} of {} rows of {}", covered, real.rows(), what);
  };
  if (covered * 2 < real.rows()) {
    return core::data_error(fmt::format(
        "{}: {}; give a simulation of the same motion or command, in the order of the recordings",
        simulated.source, covers(real.source)));
  }
  if (covered < real.rows())
    notes.push_back(fmt::format("{} {}; the others are not looked at", file_name(simulated),
                                covers(file_name(real))));
  RAVENCAL_RETURN_IF_ERROR(commanded_like(real, out));
  return out;
}

std::string recorded_joints(const Recordings& training) {
  std::map<std::string, std::set<std::string_view>> roles;
  for (const Recording& recording : training) {
    for (const record::Channel& channel : recording.channels)
      if (!channel.joint.empty()) roles[channel.joint].insert(record::name_of(channel.role));
  }
  if (roles.empty()) return "nothing of any joint";
  std::vector<std::string> words;
  for (const auto& [joint, of_joint] : roles)
    words.push_back(fmt::format("{} ({})", joint, fmt::join(of_joint, ", ")));
  return fmt::format("{}", fmt::join(words, ", "));
}

}  // namespace ravencal::diagnose
