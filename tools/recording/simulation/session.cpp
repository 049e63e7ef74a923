// SPDX-License-Identifier: Apache-2.0
#include "simulation/session.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <map>
#include <numbers>
#include <optional>
#include <span>
#include <vector>

#include "core/joint_layout.hpp"
#include "core/outputs.hpp"
#include "core/random.hpp"
#include "physics/raven_twin.hpp"
#include "record/profile.hpp"
#include "record/recording_writer.hpp"
#include "simulation/any_arm.hpp"
#include "simulation/edge_stream.hpp"
#include "simulation/session_parts.hpp"
#include "simulation/truth_stream.hpp"

namespace ravencal::simulation {
namespace {

using Eigen::Vector3d;

constexpr double kApproachS = 5.0;  // smooth move to the trajectory, longer than home ever takes
constexpr double kProgressPeriodS = 1.0;  // simulated time between two looks at the user

/// The raven2 profile's channels, in its order, and the external encoders' raw counts; without
/// both kinds of truth where edges are recorded instead.
core::Result<std::vector<record::Channel>> channels_of(const physics::Plant& plant,
                                                       bool with_truth) {
  record::ProfileOptions options;
  options.arm = plant.robot.arm;
  RAVENCAL_ASSIGN_OR_RETURN(const record::Profile profile, record::load_profile("raven2", options));
  std::vector<record::Channel> channels;
  for (const record::ProfileChannel& channel : profile.channels) {
    if (with_truth || channel.channel.role != record::Role::kJointTruth)
      channels.push_back(channel.channel);
  }
  if (!with_truth) return channels;
  for (const physics::Joint& joint : plant.joints) {
    channels.push_back(
        {"truth_counts." + joint.name, "counts", record::Role::kTruthReading, joint.name});
  }
  return channels;
}

std::map<std::string, std::string> meta_of_twin(const physics::Plant& plant,
                                                const SessionOptions& options) {
  std::map<std::string, std::string> meta = meta_of(plant, options);
  meta["robot"] = "RAVEN-II";
  meta["source"] = "ravencal simulate: a digital twin, not a robot";
  meta["arm"] = plant.robot.arm;
  meta["profile"] = "raven2";
  meta["seed"] = std::to_string(options.seed);
  meta["homing_seed"] = std::to_string(options.homing_seed);
  meta["rehomings"] = std::to_string(options.rehomings);
  meta["drift"] = options.drift ? "1" : "0";
  if (!plant.robot.controller.name.empty()) meta.emplace("controller", plant.robot.controller.name);
  return meta;
}

/// Half-cosine blend from `from` to `to`, share in [0, 1].
Vector3d blend(const Vector3d& from, const Vector3d& to, double share) {
  return from + 0.5 * (1.0 - std::cos(std::numbers::pi * share)) * (to - from);
}

/// Clock of a machine that was switched on before the robot's clock began, with another crystal;
/// offset and drift are of usual size.
EncoderClock clock_of(std::uint64_t seed) {
  core::Random random(seed * 2 + 1);
  EncoderClock clock;
  clock.offset_ns = std::llround(random.uniform(1e13, 2e13));
  clock.drift_ppm = random.uniform(-50.0, 50.0);
  return clock;
}

/// Runs the twin and pairs its messages with the truth stream, or streams the encoders' edges.
class Session {
 public:
  Session(const physics::Plant& plant, physics::RavenTwin twin, record::RecordingWriter writer,
          std::optional<EdgeStream> edges, const SessionOptions& options,
          std::int64_t cycles_per_row)
      : plant_(plant),
        twin_(std::move(twin)),
        writer_(std::move(writer)),
        edges_(std::move(edges)),
        on_truth_(options.on_truth),
        truth_(plant.logger, options.seed * 2 + 1),
        cycles_per_row_(cycles_per_row),
        control_rate_hz_(plant.robot.control_rate_hz) {}

  core::Status home() {
    RAVENCAL_RETURN_IF_ERROR(event("run_level", "1 3"));
    twin_.home([this] { observe(); });
    RAVENCAL_RETURN_IF_ERROR(edges_status_);
    if (!twin_.homed()) {
      return core::Error{
          core::ErrorCode::kData,
          fmt::format("{}: homing failed: a joint never reached its hard stop; check "
                      "dac_threshold_counts against friction and weight",
                      plant_.source)};
    }
    ++summary_.homings;
    RAVENCAL_RETURN_IF_ERROR(event("homing", fmt::format("{}", summary_.homings)));
    return event("run_level", "3 0");
  }

  /// Moves to `to` without recording.
  void approach(const Vector3d& to) {
    const Vector3d from = twin_.estimate_ji();
    const auto cycles = static_cast<std::int64_t>(kApproachS * control_rate_hz_);
    for (std::int64_t i = 1; i <= cycles; ++i) {
      cycle(blend(from, to, static_cast<double>(i) / static_cast<double>(cycles)));
    }
  }

  /// One control cycle; the published message if `wanted`.
  const physics::RavenMessage& cycle(const Vector3d& desired_ji) {
    twin_.begin_cycle();
    observe();
    return twin_.end_cycle(desired_ji);
  }

  core::Status follow(const trajectory::Trajectory& trajectory, double rehome_every_s,
                      const ProgressFunction& progress) {
    const auto cycles =
        static_cast<std::int64_t>(std::floor(trajectory.duration_s() * control_rate_hz_));
    const auto rehome_cycles = static_cast<std::int64_t>(rehome_every_s * control_rate_hz_);
    const auto look_cycles = static_cast<std::int64_t>(kProgressPeriodS * control_rate_hz_);
    for (std::int64_t i = 0; i <= cycles; ++i) {
      const Vector3d desired = trajectory.at(static_cast<double>(i) / control_rate_hz_);
      if (rehome_cycles > 0 && i > 0 && i % rehome_cycles == 0) {
        RAVENCAL_RETURN_IF_ERROR(write_pending(true));
        RAVENCAL_RETURN_IF_ERROR(home());
        approach(desired);
      }
      const std::int64_t t_ns = twin_.t_ns();
      const physics::RavenMessage& message = cycle(desired);
      if (i % cycles_per_row_ == 0) pending_.push_back({t_ns, message});
      RAVENCAL_RETURN_IF_ERROR(write_pending(false));
      RAVENCAL_RETURN_IF_ERROR(edges_status_);
      if (i % look_cycles == 0 &&
          !progress(static_cast<double>(i) /
                    static_cast<double>(std::max<std::int64_t>(1, cycles)))) {
        summary_.interrupted = true;
        RAVENCAL_RETURN_IF_ERROR(event("interrupted", "stopped by the user"));
        break;
      }
    }
    return write_pending(true);
  }

  [[nodiscard]] bool interrupted() const { return summary_.interrupted; }

  core::Result<SessionSummary> finish() {
    summary_.simulated_s = static_cast<double>(twin_.t_ns()) * 1e-9;
    if (edges_) RAVENCAL_RETURN_IF_ERROR(edges_->finish());
    RAVENCAL_RETURN_IF_ERROR(writer_.finish());
    return summary_;
  }

 private:
  struct Row {
    std::int64_t t_ns;
    physics::RavenMessage message;
  };

  core::Status event(std::string_view kind, std::string detail) {
    return writer_.append_event({twin_.t_ns(), std::string(kind), std::move(detail)});
  }

  /// Shows the external encoders where the joints are.
  void observe() {
    const physics::Truth truth = twin_.truth();
    if (on_truth_) on_truth_(twin_.t_ns(), truth.joints_ji);
    if (!edges_) {
      truth_.observe(static_cast<double>(twin_.t_ns()) * 1e-9, truth.encoder_counts);
    } else if (edges_status_.ok()) {
      edges_status_ = edges_->observe(twin_.t_ns(), truth.joints_ji);
    }
  }

  /// Writes the rows whose nearest truth is known by now.
  core::Status write_pending(bool final) {
    while (!pending_.empty()) {
      const Row& row = pending_.front();
      if (edges_) {
        RAVENCAL_RETURN_IF_ERROR(write_row(row, {}));
      } else {
        const auto counts = truth_.nearest(static_cast<double>(row.t_ns) * 1e-9, final);
        if (!counts) break;
        RAVENCAL_RETURN_IF_ERROR(write_row(row, *counts));
      }
      pending_.pop_front();
    }
    return {};
  }

  /// One row: truth by `counts`, what the robot says, the counts; no truth if there are none.
  core::Status write_row(const Row& row, std::span<const std::int64_t> counts) {
    if (summary_.rows == 0) {
      first_row_ns_ = row.t_ns;
      RAVENCAL_RETURN_IF_ERROR(
          writer_.set_meta("origin.time", fmt::format("{}", 1e-9 * static_cast<double>(row.t_ns))));
    }
    values_.clear();
    for (std::size_t i = 0; i < counts.size(); ++i) {
      values_.push_back(static_cast<double>(counts[i]) *
                        plant_.joints[i].joint_encoder_resolution_ji);
    }
    const std::size_t first_field = values_.size();
    values_.insert(values_.end(), row.message.begin(), row.message.end());
    // The authors train on the time since the recording's start.
    values_[first_field + core::catalogue_index(core::RavenField::kTime, 0)] =
        static_cast<double>(row.t_ns - first_row_ns_) * 1e-9;
    values_.insert(values_.end(), counts.begin(), counts.end());
    ++summary_.rows;
    return writer_.append(row.t_ns, values_);
  }

  const physics::Plant& plant_;
  physics::RavenTwin twin_;
  record::RecordingWriter writer_;
  std::optional<EdgeStream> edges_;
  core::Status edges_status_;  // of the last cycle's edges
  std::function<void(std::int64_t, const Vector3d&)> on_truth_;
  TruthStream truth_;
  std::int64_t cycles_per_row_;
  double control_rate_hz_;
  std::deque<Row> pending_;
  std::vector<double> values_;
  std::int64_t first_row_ns_ = 0;
  SessionSummary summary_;
};

/// kUsage where one of the two files is there, unless it may be replaced.
core::Status check_free(const std::filesystem::path& out, const SessionOptions& options) {
  for (const auto& path : {std::optional(out), options.edges}) {
    if (path && !options.overwrite && std::filesystem::exists(*path))
      return core::exists_already(*path);
  }
  return {};
}

core::Result<SessionSummary> run(Session& session, const trajectory::Trajectory& trajectory,
                                 const std::filesystem::path& out, const SessionOptions& options,
                                 const ProgressFunction& progress) {
  for (std::uint32_t homings = 0; homings <= options.rehomings; ++homings) {
    RAVENCAL_RETURN_IF_ERROR(session.home());
  }
  session.approach(trajectory.at(0.0));
  RAVENCAL_RETURN_IF_ERROR(session.follow(trajectory, options.rehome_every_s, progress));
  if (session.interrupted()) {
    SessionOptions replaces_nothing = options;
    replaces_nothing.overwrite = false;
    if (!check_free(out, replaces_nothing).ok()) {
      return core::usage_error(
          fmt::format("{}: stopped early, so that the file stays as it was", out.string()));
    }
  }
  return session.finish();
}

}  // namespace

bool simulation_runs(const physics::Plant& plant) {
  return plant.joints.size() == 3 &&
         std::all_of(plant.joints.begin(), plant.joints.end(),
                     [](const physics::Joint& j) { return j.controller && j.homing; });
}

core::Status check_simulation_runs(const physics::Plant& plant) {
  if (simulation_runs(plant)) return {};
  std::vector<std::string> names;
  for (const physics::Joint& joint : plant.joints) names.push_back(joint.name);
  return core::usage_error(
      fmt::format("{}: this needs a RAVEN arm, three joints each with [joint.controller] and "
                  "[joint.homing], and the plant has {}",
                  plant.source, fmt::join(names, ", ")));
}

core::Result<SessionSummary> record_session(const physics::Plant& plant,
                                            const trajectory::Trajectory& trajectory,
                                            const std::filesystem::path& out,
                                            const SessionOptions& options,
                                            const ProgressFunction& progress) {
  RAVENCAL_ASSIGN_OR_RETURN(const std::int64_t row_cycles, cycles_per_row(plant, options));
  RAVENCAL_RETURN_IF_ERROR(check_free(out, options));
  if (!simulation_runs(plant)) return record_any_arm(plant, trajectory, out, options, progress);
  physics::TwinOptions twin_options;
  twin_options.seed = options.seed;
  twin_options.homing_seed = options.homing_seed;
  twin_options.drift = options.drift;
  RAVENCAL_ASSIGN_OR_RETURN(physics::RavenTwin twin,
                            physics::RavenTwin::create(plant, twin_options));
  RAVENCAL_ASSIGN_OR_RETURN(const std::vector<record::Channel> channels,
                            channels_of(plant, !options.edges));
  RAVENCAL_ASSIGN_OR_RETURN(record::RecordingWriter writer,
                            record::RecordingWriter::create_whole(out, meta_of_twin(plant, options),
                                                                  channels, options.overwrite));
  std::optional<EdgeStream> edges;
  if (options.edges) {
    RAVENCAL_ASSIGN_OR_RETURN(edges, EdgeStream::create(*options.edges, plant,
                                                        clock_of(options.seed), options.overwrite));
  }
  Session session(plant, std::move(twin), std::move(writer), std::move(edges), options, row_cycles);
  return run(session, trajectory, out, options, progress);
}

}  // namespace ravencal::simulation
