// SPDX-License-Identifier: Apache-2.0
#include "rezero/reading.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <thread>

#include "core/catalogue.hpp"
#include "core/joint_layout.hpp"
#include "core/run_level.hpp"
#include "learn/recording_origin.hpp"
#include "model/hook_view.hpp"
#include "model/scaled_inputs.hpp"
#include "monitor/telemetry_reader.hpp"
#include "monitor/watch.hpp"
#include "rezero/memory.hpp"

namespace ravencal::rezero {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kTicksPeriod{20};
/// With these the prediction is none, or is not of a robot that is homed and stands.
constexpr std::uint32_t kNoReading =
    RAVENCAL_DOUBT_ROBOT_STATE | RAVENCAL_DOUBT_NO_WEIGHTS | RAVENCAL_DOUBT_TIME |
    RAVENCAL_DOUBT_NOT_LATCHED | RAVENCAL_DOUBT_NOT_FINITE | RAVENCAL_DOUBT_OUT_OF_RANGE |
    RAVENCAL_DOUBT_WARMING_UP | RAVENCAL_DOUBT_MAGNITUDE | RAVENCAL_DOUBT_NETWORK |
    RAVENCAL_DOUBT_ENCODER_JUMP | RAVENCAL_DOUBT_DISTANCE;

/// Mean, smallest and largest of what comes one by one.
class Seen {
 public:
  void add(double value) {
    sum_ += value;
    least_ = std::min(least_, value);
    most_ = std::max(most_, value);
    ++count_;
  }
  [[nodiscard]] double mean() const { return sum_ / static_cast<double>(count_); }
  [[nodiscard]] double range() const { return most_ - least_; }
  [[nodiscard]] double least() const { return least_; }
  [[nodiscard]] std::size_t count() const { return count_; }

 private:
  double sum_ = 0.0;
  double least_ = std::numeric_limits<double>::infinity();
  double most_ = -std::numeric_limits<double>::infinity();
  std::size_t count_ = 0;
};

struct Seens {
  explicit Seens(const model::CalibrationModel& model)
      : reading(model.outputs.size()), predicted(model.outputs.size()) {}

  /// As the plugin asks for it: of what differs from the mean, the share that is trusted.
  void add(std::size_t k, const model::CalibrationModel& model, double value, double asked,
           double trusted) {
    const double mean = model.output.mean[static_cast<Eigen::Index>(k)];
    reading[k].add(value);
    predicted[k].add(mean + trusted * (asked - mean));
  }

  [[nodiscard]] std::vector<JointReading> joints(const model::CalibrationModel& model) const {
    std::vector<JointReading> joints;
    for (std::size_t k = 0; k < reading.size(); ++k) {
      joints.push_back({model.outputs[k].joint, model.outputs[k].unit, reading[k].mean(),
                        reading[k].range(), predicted[k].mean()});
    }
    return joints;
  }

  std::vector<Seen> reading;
  std::vector<Seen> predicted;
  Seen confidence;
};

/// The rows of a second.
struct Rows {
  Eigen::Index begin = 0;
  Eigen::Index end = 0;
};

Rows rows_of(const record::Recording& recording, std::optional<double> from_s) {
  const auto& t_ns = recording.t_ns;
  const auto length_ns = static_cast<std::int64_t>(kReading_s * 1e9);
  const std::int64_t from_ns =
      from_s ? t_ns.front() + std::llround(*from_s * 1e9) : t_ns.back() - length_ns;
  const auto begin = std::lower_bound(t_ns.begin(), t_ns.end(), from_ns);
  const auto end = std::upper_bound(begin, t_ns.end(), from_ns + length_ns);
  return {begin - t_ns.begin(), end - t_ns.begin()};
}

core::Status check_origin(const record::Recording& recording,
                          const model::CalibrationModel& model) {
  RAVENCAL_ASSIGN_OR_RETURN(const model::Origin origin, learn::origin_of(recording));
  if (origin.coordinates == model::Coordinates::kCorrected) {
    return core::data_error(
        fmt::format("{}: its joints hold a correction; record the robot's own joints, as raw of "
                    "`ravencal monitor` or with the plugin in shadow",
                    recording.source));
  }
  const auto joined = model::joined(model.origin, origin, recording.source);
  return joined.ok() ? core::Status() : joined.error();
}

/// Encoder offsets of the rows. A recording without them, or with a homing among them, tells none.
std::optional<Homing> homing_of(const record::Recording& recording, const Rows& rows) {
  Homing homing{};
  for (std::size_t j = 0; j < homing.size(); ++j) {
    const auto column = recording.column(
        core::catalogue()[core::catalogue_index(core::RavenField::kEncOffsets, j)].name);
    if (!column) return std::nullopt;
    const double first = recording.samples(rows.begin, *column);
    for (Eigen::Index row = rows.begin; row < rows.end; ++row) {
      if (recording.samples(row, *column) != first) return std::nullopt;
    }
    homing[j] = static_cast<std::int32_t>(std::lround(first));
  }
  return homing;
}

std::vector<double> confidences(const model::CalibrationModel& model,
                                const Eigen::MatrixXd& features) {
  std::vector<double> all(static_cast<std::size_t>(features.rows()), 1.0);
  if (!model.trust) return all;
  const Eigen::VectorXf distances = model.trust->distances(
      model::scaled_inputs<float>(model, features.transpose().cast<float>()));
  for (std::size_t i = 0; i < all.size(); ++i) {
    all[i] = static_cast<double>(model.trust->confidence(distances[static_cast<Eigen::Index>(i)]));
  }
  return all;
}

core::Error no_rows(const record::Recording& recording) {
  return core::data_error(fmt::format(
      "{}: no row of the {:g} s of the reading has every joint and every input of the weights",
      recording.source, kReading_s));
}

/// Slots of the joints that the weights correct; the plugin corrects no others.
core::Result<std::vector<std::size_t>> slots_of(const model::CalibrationModel& model) {
  std::vector<std::size_t> slots;
  for (const model::OutputSpec& output : model.outputs) {
    const auto* const found = std::find(core::kSlotNames.begin(),
                                        core::kSlotNames.begin() + RAVENCAL_JOINTS, output.joint);
    if (found == core::kSlotNames.begin() + RAVENCAL_JOINTS) {
      return core::data_error(
          fmt::format("the plugin corrects shoulder, elbow and insertion; the weights correct {}",
                      output.joint));
    }
    slots.push_back(static_cast<std::size_t>(found - core::kSlotNames.begin()));
  }
  return slots;
}

core::Status check_weights(const ravencal_telemetry_homing& homing, const std::string& name,
                           std::uint32_t weights_checksum) {
  if (homing.weights_checksum == weights_checksum) return {};
  return core::data_error(
      homing.weights_checksum == 0
          ? fmt::format("{}: the plugin has no weights, or is older than 3.3 and knows no constant "
                        "of a homing",
                        name)
          : fmt::format("{}: the plugin runs other weights (checksum {:08x}) than these ({:08x})",
                        name, homing.weights_checksum, weights_checksum));
}

}  // namespace

core::Result<Reading> read_recording(const record::Recording& recording,
                                     const model::CalibrationModel& model,
                                     std::optional<double> from_s) {
  if (recording.rows() == 0) return no_rows(recording);
  RAVENCAL_RETURN_IF_ERROR(check_origin(recording, model));
  RAVENCAL_ASSIGN_OR_RETURN(const model::FeatureMatrix features,
                            model::inputs_of(model, recording));
  const Rows rows = rows_of(recording, from_s);
  const Eigen::Index count = rows.end - rows.begin;
  if (count == 0) return no_rows(recording);
  const Eigen::MatrixXd inputs = features.middleRows(rows.begin, count).cast<double>();
  const Eigen::MatrixXd asked = model.predict(inputs);
  const std::vector<double> trusted = confidences(model, inputs);
  Seens seen(model);
  for (std::size_t k = 0; k < model.outputs.size(); ++k) {
    const auto column = recording.column(model.outputs[k].estimate_channel);
    if (!column) {
      return core::data_error(fmt::format("{}: has no channel '{}', which the weights correct",
                                          recording.source, model.outputs[k].estimate_channel));
    }
    for (Eigen::Index i = 0; i < count; ++i) {
      const double value = recording.samples(rows.begin + i, *column);
      const double confidence = trusted[static_cast<std::size_t>(i)];
      if (!std::isfinite(value) || !inputs.row(i).allFinite()) continue;
      seen.add(k, model, value, asked(i, static_cast<Eigen::Index>(k)), confidence);
      seen.confidence.add(confidence);
    }
    if (seen.reading[k].count() == 0) return no_rows(recording);
  }
  Reading reading{recording.source,
                  seen.joints(model),
                  seen.confidence.least(),
                  homing_of(recording, rows),
                  {}};
  const auto unsettled = unsettled_inputs(model, recording, rows.begin);
  if (!unsettled.empty()) {
    reading.doubts.push_back(
        fmt::format("the recording does not hold enough motion before the reading to know {}; move "
                    "every joint to and fro before it stands at the pose",
                    fmt::join(unsettled, ", ")));
  }
  return reading;
}

core::Result<Reading> read_telemetry(const std::string& name, const model::CalibrationModel& model,
                                     std::uint32_t weights_checksum,
                                     const std::function<bool()>& keep_going) {
  RAVENCAL_ASSIGN_OR_RETURN(const std::vector<std::size_t> slots, slots_of(model));
  RAVENCAL_ASSIGN_OR_RETURN(monitor::TelemetryReader reader, monitor::TelemetryReader::open(name));
  std::vector<monitor::NumberedTick> ticks;
  reader.read(ticks);  // those before lie in the past
  ticks.clear();
  const auto wanted =
      static_cast<std::size_t>(kReading_s * 1e9 / static_cast<double>(reader.tick_ns()));
  const auto begun = Clock::now();
  // A loop that comes ten times too late stands.
  constexpr std::chrono::duration<double> kLongest(10.0 * kReading_s);
  while (ticks.size() < wanted && keep_going() && Clock::now() - begun < kLongest) {
    std::this_thread::sleep_for(kTicksPeriod);
    reader.read(ticks);
  }
  if (ticks.size() < wanted) {
    return core::io_error(fmt::format("{}: only {} of {} ticks came: the control loop stands", name,
                                      ticks.size(), wanted));
  }
  const ravencal_telemetry_homing homing = reader.homing();
  RAVENCAL_RETURN_IF_ERROR(check_weights(homing, name, weights_checksum));
  Seens seen(model);
  std::uint32_t doubts = 0;
  bool pedal_was_up = true;
  for (const monitor::NumberedTick& one : ticks) {
    const ravencal_tick& tick = one.tick;
    const auto confidence = static_cast<double>(tick.confidence);
    doubts |= tick.doubts & kNoReading;
    pedal_was_up = pedal_was_up && tick.runlevel == core::kPedalUp;
    seen.confidence.add(confidence);
    for (std::size_t k = 0; k < slots.size(); ++k) {
      seen.add(k, model, static_cast<double>(tick.jpos_ji[slots[k]]),
               static_cast<double>(tick.predicted_ji[slots[k]]), confidence);
    }
  }
  Reading reading{name, seen.joints(model), seen.confidence.least(), std::nullopt, {}};
  if (homing.is_homed != 0) reading.homing = std::to_array(homing.enc_offset_counts);
  if (!pedal_was_up) {
    reading.doubts.emplace_back(
        "the pedal was not up all the time: a constant is taken with the "
        "pedal up only; release it and ask again");
  }
  if (doubts != 0) {
    reading.doubts.push_back(
        fmt::format("the plugin had doubts: {}", fmt::join(monitor::doubts_in_words(doubts), " ")));
  }
  return reading;
}

}  // namespace ravencal::rezero
