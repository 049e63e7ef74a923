// SPDX-License-Identifier: Apache-2.0
//
// Simulates a case and its twins, and measures what its manifest says: the size of each effect is
// the difference to a twin that lacks it but shares motion and noise, the floor the difference
// between two draws of the noise.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "core/version.hpp"
#include "prove/generator/beyond.hpp"
#include "prove/generator/case.hpp"

namespace ravencal::prove {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using Json = nlohmann::ordered_json;

constexpr double kFloorRunS = 60.0;
/// A robot that lags its command by more than this share of its range is stuck; such a case is
/// invalid.
constexpr double kMostBehind = 0.05;
constexpr int kMostTries = 8;

/// Truth minus estimate, and drive effort at the joint through a moving mean of 0.2 s.
struct Channels {
  VectorXd position, effort;
};

VectorXd moving_mean(const VectorXd& x, Index half) {
  VectorXd sum(x.size() + 1);
  sum[0] = 0.0;
  for (Index i = 0; i < x.size(); ++i) sum[i + 1] = sum[i] + x[i];
  VectorXd out(x.size());
  for (Index i = 0; i < x.size(); ++i) {
    const Index a = std::max<Index>(0, i - half), b = std::min(x.size(), i + half + 1);
    out[i] = (sum[b] - sum[a]) / static_cast<double>(b - a);
  }
  return out;
}

Channels channels_of(const record::Recording& recording, const NominalJoint& joint,
                     double rate_hz) {
  using record::Role;
  const auto truth = recording.column(Role::kJointTruth, joint.name);
  const auto estimate = recording.column(Role::kJointEstimate, joint.name);
  const auto torque = recording.column(Role::kDriveTorque, joint.name);
  Channels c;
  c.position = recording.samples.col(*truth) - recording.samples.col(*estimate);
  c.effort = moving_mean(recording.samples.col(*torque) * (joint.reduction / joint.gearbox_ratio),
                         static_cast<Index>(0.1 * rate_hz));
  return c;
}

double rms(const VectorXd& x) {
  double sum = 0.0;
  Index count = 0;
  for (const double value : x) {
    if (!std::isfinite(value)) continue;
    sum += value * value;
    ++count;
  }
  return count > 0 ? std::sqrt(sum / static_cast<double>(count)) : 0.0;
}

double rms_difference(const VectorXd& a, const VectorXd& b) {
  const Index n = std::min(a.size(), b.size());
  return rms(a.head(n) - b.head(n));
}

/// Recordings with only the channels that the tool gets.
record::Recording as_given(const record::Recording& whole, const Session& session) {
  record::Recording out = whole;
  out.channels.clear();
  std::vector<Index> kept;
  for (std::size_t c = 0; c < whole.channels.size(); ++c) {
    const record::Role role = whole.channels[c].role;
    if (role == record::Role::kDriveTorque && !session.with_torque) continue;
    if (role == record::Role::kJointTruth && !session.with_truth) continue;
    kept.push_back(static_cast<Index>(c));
    out.channels.push_back(whole.channels[c]);
  }
  out.samples.resize(whole.samples.rows(), static_cast<Index>(kept.size()));
  for (std::size_t c = 0; c < kept.size(); ++c)
    out.samples.col(static_cast<Index>(c)) = whole.samples.col(kept[c]);
  // The same metadata for every case.
  out.meta = {
      {"robot", "sealed case"}, {"source", "ravencal prove"}, {"software_version", core::kVersion}};
  return out;
}

class Maker {
 public:
  Maker(const CaseDesign& design, const std::function<bool()>& look)
      : design_(design), look_(look) {}

  core::Result<CaseFiles> make() {
    const SessionSeeds seeds{design_.motion_seed, design_.noise_seed};
    Session all = session_of(design_);
    RAVENCAL_ASSIGN_OR_RETURN(record::Recording whole, whole_run(all, seeds));
    for (int tries = 1; tries < kMostTries && !follows(whole); ++tries) {
      for (Subject& s : design_.subjects) s.amplitude *= 0.5;
      all = session_of(design_);
      RAVENCAL_ASSIGN_OR_RETURN(whole, whole_run(all, seeds));
    }
    RAVENCAL_RETURN_IF_ERROR(measure_floors(all, whole));
    Json subjects = Json::array();
    for (std::size_t i = 0; i < design_.subjects.size(); ++i) {
      if (design_.subjects[i].amplitude == 0.0) continue;
      RAVENCAL_ASSIGN_OR_RETURN(const record::Recording twin,
                                whole_run(session_of(design_, i), seeds));
      subjects.push_back(subject_json(design_.subjects[i], all, whole, twin));
    }
    CaseFiles files;
    Session second = all;
    second.duration_s = design_.held_out_s;
    RAVENCAL_ASSIGN_OR_RETURN(
        const record::Recording held_out,
        whole_run(second, {design_.held_out_seed, design_.held_out_seed ^ 0x5bd1e995U}));
    files.recording = as_given(whole, all);
    files.held_out = as_given(held_out, all);
    files.plant = plant_text(design_.nominal);
    files.manifest = manifest(std::move(subjects), all);
    return files;
  }

 private:
  core::Result<record::Recording> whole_run(Session session, const SessionSeeds& seeds) const {
    session.with_torque = session.with_truth = true;
    return design_.world->run(session, seeds, look_);
  }

  [[nodiscard]] bool follows(const record::Recording& recording) const {
    using record::Role;
    return std::all_of(
        design_.nominal.joints.begin(), design_.nominal.joints.end(), [&](const NominalJoint& j) {
          const VectorXd desired =
              recording.samples.col(*recording.column(Role::kDesiredPosition, j.name));
          const VectorXd is =
              recording.samples.col(*recording.column(Role::kJointEstimate, j.name));
          return rms(desired - is) < kMostBehind * (j.range.high - j.range.low);
        });
  }

  core::Status measure_floors(const Session& all, const record::Recording& whole) {
    Session other = all;
    other.planned_s = all.duration_s;
    other.duration_s = std::min(kFloorRunS, all.duration_s);
    RAVENCAL_ASSIGN_OR_RETURN(
        const record::Recording again,
        whole_run(other, {design_.motion_seed, design_.noise_seed + 0x9e3779b9U}));
    for (const NominalJoint& joint : design_.nominal.joints) {
      const Channels a = channels_of(whole, joint, design_.nominal.row_rate_hz);
      const Channels b = channels_of(again, joint, design_.nominal.row_rate_hz);
      floors_.push_back({rms_difference(a.position, b.position) / std::sqrt(2.0),
                         rms_difference(a.effort, b.effort) / std::sqrt(2.0)});
    }
    return {};
  }

  Json subject_json(const Subject& s, const Session& all, const record::Recording& with,
                    const record::Recording& without) const {
    const double rate_hz = design_.nominal.row_rate_hz;
    const NominalJoint& joint = design_.nominal.joints[s.joint];
    // An effect may show in several joints and both channels; the clearest that is given counts.
    double size = 0.0, floor = 1.0, ratio = -1.0;
    std::string channel = s.kind->stage.in_truth ? "position" : "effort", joint_seen = joint.name;
    for (std::size_t j = 0; j < design_.nominal.joints.size(); ++j) {
      const NominalJoint& seen = design_.nominal.joints[j];
      const Channels a = channels_of(with, seen, rate_hz), b = channels_of(without, seen, rate_hz);
      const double sizes[2] = {rms_difference(a.position, b.position),
                               rms_difference(a.effort, b.effort)};
      const bool given[2] = {all.with_truth, all.with_torque};
      for (std::size_t c = 0; c < 2; ++c) {
        if (j != s.joint && !s.kind->is(kEverywhere)) continue;
        if (!given[c] || sizes[c] / floors_[j][c] <= ratio) continue;
        size = sizes[c];
        floor = floors_[j][c];
        ratio = size / floor;
        channel = c == 0 ? "position" : "effort";
        joint_seen = seen.name;
      }
    }
    if (s.kind->law_rms != nullptr) {
      const JointPhysics& p = all.robot.joints[s.joint];
      const VectorXd effort = with.samples.col(*with.column(record::Role::kDriveTorque, p.name)) *
                              p.reduction / p.gearbox_ratio;
      size = s.kind->law_rms(s, rms(effort), all.duration_s);
      floor = floors_[s.joint][1];
      ratio = all.with_torque ? size / floor : -1.0;
      channel = "command";
    }
    const OwnPart own = own_part(s, all, with, without, ratio);
    return {{"id", s.kind->id},
            {"outside", s.kind->is(kOutside)},
            {"joint", joint.name},
            {"joint_seen", joint_seen},
            {"from", s.from ? design_.nominal.joints[*s.from].name : ""},
            {"stage", s.kind->stage.word},
            {"parameter", s.kind->parameter},
            {"value", reported_value(s)},
            {"amplitude", s.amplitude},
            {"details", s.details},
            {"channel", channel},
            {"size", size},
            {"floor", floor},
            {"size_over_floor", std::max(0.0, ratio)},
            {"imitated_by", own.imitated_by},
            {"own_over_floor", std::max(0.0, own.over_floor)},
            {"testable", ratio >= 0.0},
            {"interval_s", s.interval_s},
            {"position", s.position}};
  }

  struct OwnPart {
    std::string imitated_by;
    double over_floor;
  };
  /// What of the effect neither parameters nor one known effect can imitate, in the channel where
  /// that is clearest.
  OwnPart own_part(const Subject& s, const Session& all, const record::Recording& with,
                   const record::Recording& without, double ratio) const {
    if (s.kind->law_rms != nullptr) return {"", ratio};
    OwnPart own{"", -1.0};
    for (const bool position : {true, false}) {
      if (!(position ? all.with_truth : all.with_torque)) continue;
      const auto imitation =
          best_imitation(with, without, design_.nominal, s.joint, position, s.kind->id);
      const double over = imitation->left / floors_[s.joint][position ? 0 : 1];
      if (over > own.over_floor) own = {imitation->by, over};
    }
    return own;
  }

  /// Slow motion does not excite everything.
  [[nodiscard]] bool excited() const {
    const MotionKind motion = design_.base.motion;
    return std::all_of(design_.subjects.begin(), design_.subjects.end(),
                       [motion](const Subject& s) {
                         return s.amplitude == 0.0 ||
                                ((is_rich(motion) || !s.kind->is(kWantsRich)) &&
                                 (motion != MotionKind::kOneWay || !s.kind->is(kAtReversals)));
                       });
  }

  [[nodiscard]] std::string manifest(Json subjects, const Session& all) const {
    Json floors = Json::object();
    for (std::size_t j = 0; j < floors_.size(); ++j) {
      floors[design_.nominal.joints[j].name] = {{"position", floors_[j][0]},
                                                {"effort", floors_[j][1]}};
    }
    Json off = nullptr;
    if (design_.off) {
      const std::string_view key = design_.off->kind->stated[0].rotary;  // name and unit
      off = {{"id", design_.off->kind->id},
             {"parameter", key.substr(0, key.find('_'))},
             {"joint", design_.nominal.joints[design_.off->joint].name},
             {"factor", design_.off->factor}};
    }
    Json cables = Json::object();
    for (std::size_t j = 1; j < design_.nominal.joints.size(); ++j) {
      const NominalJoint& joint = design_.nominal.joints[j];
      cables[joint.name] = joint.follows_links ? "link" : "drive";
    }
    const Json json = {{"schema", 1},
                       {"case", design_.number},
                       {"kind", word_of(design_.kind)},
                       {"world", design_.world->name},
                       {"engine", design_.world->engine(all)},
                       {"robot", design_.nominal.name},
                       {"motion", word_of(all.motion)},
                       {"rate_hz", design_.nominal.row_rate_hz},
                       {"duration_s", all.duration_s},
                       {"homed_at_s", all.homed_at_s},
                       {"with_truth", all.with_truth},
                       {"with_torque", all.with_torque},
                       {"seeds", {design_.motion_seed, design_.noise_seed, design_.held_out_seed}},
                       {"subjects", std::move(subjects)},
                       {"parameter_off", off},
                       {"cables_follow", cables},
                       {"plant_says_what_cables_follow", design_.nominal.says_ways},
                       {"excited", excited()},
                       {"floors", floors}};
    return json.dump(1) + "\n";
  }

  CaseDesign design_;  ///< amplitudes fall until the robot follows its command
  const std::function<bool()>& look_;
  std::vector<std::array<double, 2>> floors_;  ///< per joint: position, effort
};

}  // namespace

core::Result<CaseFiles> make_case(const CaseDesign& design, const std::function<bool()>& look) {
  return Maker(design, look).make();
}

}  // namespace ravencal::prove
