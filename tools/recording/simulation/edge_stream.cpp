// SPDX-License-Identifier: Apache-2.0
#include "simulation/edge_stream.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "core/version.hpp"

namespace ravencal::simulation {
namespace {

namespace qr = quadrature_reader;

// The authors' set-up (func_raven_joint_encodersIII.py flips the first channel): counts fall as the
// shoulder's angle rises. quadrature_reader/encoders.toml says the same.
constexpr std::array<double, 3> kSigns = {-1.0, 1.0, 1.0};
constexpr std::int64_t kClockPeriodNs = 10'000'000'000;  // as the driver notes it

std::vector<record::Channel> channels_of(const physics::Plant& plant) {
  std::vector<record::Channel> channels;
  for (const physics::Joint& joint : plant.joints) {
    channels.push_back({joint.name + ".counts", "counts", record::Role::kTruthReading, joint.name});
    channels.push_back({joint.name + ".lines", "1", record::Role::kStatus, joint.name});
  }
  return channels;
}

}  // namespace

std::int64_t EncoderClock::at(std::int64_t robot_ns) const {
  return robot_ns + offset_ns + std::llround(1e-6 * drift_ppm * static_cast<double>(robot_ns));
}

core::Result<EdgeStream> EdgeStream::create(const std::filesystem::path& path,
                                            const physics::Plant& plant, const EncoderClock& clock,
                                            bool overwrite) {
  const std::map<std::string, std::string> meta = {
      {"robot", "RAVEN-II"},
      {"arm", plant.robot.arm},
      {"serial", "simulated"},
      {"source", "ravencal simulate: a digital twin, not a robot"},
      {"clock", "CLOCK_MONOTONIC"},
      {"rows", "one per edge"},
      {"software_version", core::kVersion}};
  RAVENCAL_ASSIGN_OR_RETURN(
      record::RecordingWriter writer,
      record::RecordingWriter::create_whole(path, meta, channels_of(plant), overwrite));
  return EdgeStream(std::move(writer), plant, clock);
}

EdgeStream::EdgeStream(record::RecordingWriter writer, const physics::Plant& plant,
                       const EncoderClock& clock)
    : writer_(std::move(writer)),
      clock_(clock),
      counters_(plant.joints.size()),
      row_(2 * plant.joints.size()) {
  for (std::size_t i = 0; i < plant.joints.size(); ++i) {
    qr::EncodeSettings settings;
    settings.counts_per_unit = kSigns[i] / plant.joints[i].joint_encoder_resolution_ji;
    settings.axis = static_cast<std::uint8_t>(i);
    encoders_.emplace_back(settings);
  }
}

core::Status EdgeStream::observe(std::int64_t t_ns, const Eigen::Vector3d& joints_ji) {
  if (t_ns >= next_clock_offset_ns_) RAVENCAL_RETURN_IF_ERROR(write_clock_offset(t_ns));
  readings_.clear();
  for (std::size_t i = 0; i < encoders_.size(); ++i)
    encoders_[i].move_to(clock_.at(t_ns), joints_ji[static_cast<Eigen::Index>(i)], readings_);
  std::stable_sort(readings_.begin(), readings_.end(),
                   [](const auto& x, const auto& y) { return x.t_ns < y.t_ns; });
  for (const qr::Reading& reading : readings_) {
    qr::QuadratureDecoder& counter = counters_[reading.axis];
    double& counts = row_[2 * std::size_t{reading.axis}];
    double& lines = row_[2 * std::size_t{reading.axis} + 1];
    const bool level = reading.value != 0;
    if (reading.kind == qr::ReadingKind::kLevels) {
      counter.on_levels((reading.value & 1) != 0, (reading.value & 2) != 0);
      lines = static_cast<double>(reading.value);
    } else {
      counter.on_edge(reading.line, level);
      const double bit = reading.line == qr::Line::kA ? 1.0 : 2.0;
      lines += level ? bit : -bit;
    }
    counts = static_cast<double>(counter.count());
    // The first levels of all joints are one row.
    if (reading.kind == qr::ReadingKind::kLevels && &reading != &readings_.back()) continue;
    last_row_ns_ = std::max(last_row_ns_, reading.t_ns);
    RAVENCAL_RETURN_IF_ERROR(writer_.append(last_row_ns_, row_));
  }
  return {};
}

core::Status EdgeStream::write_clock_offset(std::int64_t t_ns) {
  next_clock_offset_ns_ = t_ns + kClockPeriodNs;
  const std::int64_t stamp_ns = clock_.at(t_ns);
  return writer_.append_event(
      {stamp_ns, "clock_offset",
       fmt::format(R"({{"clock":"CLOCK_REALTIME","minus_monotonic_ns":{},"uncertainty_ns":0}})",
                   t_ns - stamp_ns)});
}

core::Status EdgeStream::finish() { return writer_.finish(); }

}  // namespace ravencal::simulation
