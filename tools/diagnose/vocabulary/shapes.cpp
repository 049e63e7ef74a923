// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <utility>

#include "diagnose/model/pulses.hpp"
#include "diagnose/track/filter.hpp"
#include "diagnose/vocabulary/candidates.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using physics::Prediction;

/// Places of a bump and its half widths, as shares of the range of motion.
constexpr double kFirstPlace = 0.15;
constexpr double kLastPlace = 0.9;
constexpr double kPlaceStep = 0.1;
constexpr double kHalfWidths[] = {0.1, 0.2};
/// Times in which something may change, over the length of the recording.
constexpr double kDrifts[] = {0.2, 0.5};
constexpr double kWarmUpS = 60.0;
/// Of the greatest speed: below, the direction of motion is not clear.
constexpr double kSlow = 1e-3;

VectorXd bump(const Track& track, std::size_t joint, double centre, double half_width) {
  return track.forced.motors[joint].q.unaryExpr([&](double q) {
    const double x = (q - centre) / half_width;
    return std::abs(x) < 1.0 ? 0.5 * (1.0 + std::cos(std::numbers::pi * x)) : 0.0;
  });
}

VectorXd direction(const Track& track, std::size_t joint) {
  const VectorXd& v = track.forced.motors[joint].v;
  const double least = kSlow * v.cwiseAbs().maxCoeff() + 1e-300;
  return v.array() / (v.array().abs() + least);
}

VectorXd nothing(const Track& track, const Prediction&) { return VectorXd::Zero(track.rows()); }

class Shapes {
 public:
  Shapes(const Scales& scales, Likelihood& training, Likelihood* held_out,
         std::vector<Candidate>& out)
      : s_(scales), training_(training), held_out_(held_out), out_(out) {}

  void over_position() {
    const std::size_t j = s_.joint;
    for (const double width : kHalfWidths) {
      for (double place = kFirstPlace; place < kLastPlace; place += kPlaceStep) {
        const double centre = s_.lowest + place * s_.range;
        const double half_width = width * s_.range;
        const std::string where = fmt::format("position at {:.3g}", centre);
        const ShapeFunction at = [j, centre, half_width](const Track& track, const Prediction&) {
          return bump(track, j, centre, half_width);
        };
        add(ChannelKind::kPosition, where, 1e-3 * s_.position, at);
        add(ChannelKind::kDrive, where, 0.2 * s_.load, at);
        add(ChannelKind::kDrive, where + " and direction", 0.2 * s_.load,
            [j, centre, half_width](const Track& track, const Prediction&) -> VectorXd {
              return bump(track, j, centre, half_width).cwiseProduct(direction(track, j));
            });
      }
    }
  }

  void of_drive() {
    const std::size_t j = s_.joint;
    for (const double share : kDrifts) {
      const double time_s = share * s_.length_s;
      add(ChannelKind::kDrive, "load and time", 0.1,
          [j, time_s](const Track& track, const Prediction& plant) -> VectorXd {
            return plant.effort[j].array() * (1.0 - (-track.forced.t_s.array() / time_s).exp());
          });
    }
    // Its change over time: what stays is dry friction.
    add(ChannelKind::kDrive, "direction and time", 0.2 * s_.load,
        [j](const Track& track, const Prediction&) -> VectorXd {
          const VectorXd cooling = (-track.forced.t_s.array() / kWarmUpS).exp();
          return direction(track, j).array() * (cooling.array() - cooling.mean());
        });
    add(ChannelKind::kDrive, "rate of the effort", 0.01,
        [j](const Track& track, const Prediction& plant) -> VectorXd {
          return first_difference(tent(plant.effort[j], track.tent_rows), track.period_s);
        });
    add(ChannelKind::kDrive, "position", 0.5 * s_.load / s_.position,
        [j, middle = s_.lowest + 0.5 * s_.range](const Track& track, const Prediction&)
            -> VectorXd { return track.forced.motors[j].q.array() - middle; });
    add(ChannelKind::kDrive, "speed", 0.1 * s_.load,
        [j](const Track& track, const Prediction&) -> VectorXd {
          const VectorXd& v = track.forced.motors[j].v;
          return v.cwiseProduct(v.cwiseAbs()) / std::max(1e-12, v.squaredNorm() / v.size());
        });
  }

  void of_position() {
    if (!s_.weight) return;
    const std::size_t j = s_.joint;
    add(ChannelKind::kPosition, "load", 5e-4 * s_.position,
        [j](const Track&, const Prediction& plant) -> VectorXd {
          const double greatest = plant.tension[j].cwiseAbs().maxCoeff() + 1e-300;
          return (plant.tension[j].array() / greatest).cube();
        });
  }

  /// What the given law leaves of the recorded command at moments of its own.
  void pulses() {
    for (std::size_t c = 0; c < training_.channels().size(); ++c) {
      if (!is(c, ChannelKind::kLaw)) continue;
      const State& given = training_.base();
      const auto found = pulses_in(training_.tracks(), s_.joint,
                                   training_.residuals(given, training_.outcome(given))[c]);
      if (!found) continue;
      Candidate candidate = begin("");
      candidate.id = "input_disturbance";
      candidate.kind = CandidateKind::kPulses;
      Parameter size = coefficient(c, "size", std::abs(found->size), nothing);
      ByRecording columns;
      for (std::size_t r = 0; r < found->on_s.size(); ++r) {
        const Track& track = training_.tracks()[r];
        columns.push_back(tent(share_on(track, found->on_s[r]), track.tent_rows));
      }
      training_.set_shape(*size.shape, std::move(columns));
      size.effect = candidate.id;
      size.unit = s_.prismatic ? "N" : "N_m";
      candidate.sizes = {std::move(size)};
      describe(*found, candidate);
      out_.push_back(std::move(candidate));
    }
  }

  /// A sine of a frequency that the screen sets.
  void tone(ChannelKind kind, double size) {
    for (std::size_t c = 0; c < training_.channels().size(); ++c) {
      if (!is(c, kind)) continue;
      Candidate candidate = begin("time");
      candidate.kind = CandidateKind::kTone;
      for (const char* part : {"sine", "cosine"})
        candidate.sizes.push_back(coefficient(c, part, size, nothing));
      out_.push_back(std::move(candidate));
    }
  }

 private:
  [[nodiscard]] bool is(std::size_t channel, ChannelKind kind) const {
    const Channel& c = training_.channels()[channel];
    return c.joint == s_.joint && c.kind == kind;
  }

  [[nodiscard]] Candidate begin(const std::string& circumstance) const {
    Candidate c;
    c.id = "unknown";
    c.kind = CandidateKind::kShape;
    c.joint = s_.joint;
    c.circumstance = circumstance;
    return c;
  }

  /// How many pulses there are, how long on average, and when each begins in its recording.
  void describe(const Pulses& pulses, Candidate& candidate) const {
    std::vector<double>& start = candidate.starts.emplace_back();
    const auto say = [&](const std::string& name, const char* unit, double value) {
      Parameter& p = candidate.forms.emplace_back();
      p.effect = candidate.id;
      p.name = name;
      p.unit = unit;
      p.joint = s_.joint;
      p.reaches = Reaches::kShape;
      p.held = true;
      p.in_plant = false;
      p.set = [](State&, double) {};
      start.push_back(value);
    };
    double on_s = 0.0;
    std::vector<double> begins_s;
    for (std::size_t r = 0; r < pulses.on_s.size(); ++r) {
      for (const auto& [begin_s, end_s] : pulses.on_s[r]) {
        on_s += end_s - begin_s;
        begins_s.push_back(training_.tracks()[r].begins_s + begin_s);
      }
    }
    const auto count = static_cast<double>(begins_s.size());
    say("count", "1", count);
    say("duration", "s", on_s / count);
    for (std::size_t k = 0; k < begins_s.size(); ++k)
      say(fmt::format("begin_{}", k + 1), "s", begins_s[k]);
  }

  void add(ChannelKind kind, const std::string& circumstance, double size,
           const ShapeFunction& function) {
    for (std::size_t c = 0; c < training_.channels().size(); ++c) {
      if (!is(c, kind)) continue;
      Candidate candidate = begin(circumstance);
      candidate.sizes = {coefficient(c, circumstance, size, function)};
      out_.push_back(std::move(candidate));
    }
  }

  Parameter coefficient(std::size_t channel, const std::string& name, double size,
                        const ShapeFunction& function) {
    const std::size_t shape = training_.add_shape(channel, function);
    if (held_out_ != nullptr) held_out_->add_shape(channel, function);
    Parameter p;
    p.effect = "unknown";
    p.name = name;
    p.joint = s_.joint;
    p.reaches = Reaches::kShape;
    p.shape = shape;
    p.scale = size;
    p.deviation = kUnknownSize;
    p.step = 1.0;
    p.set = [shape](State& state, double value) { state.shapes[shape] = value; };
    return p;
  }

  const Scales& s_;
  Likelihood& training_;
  Likelihood* held_out_;
  std::vector<Candidate>& out_;
};

}  // namespace

void add_shapes(const Scales& scales, Likelihood& training, Likelihood* held_out,
                std::vector<Candidate>& candidates) {
  Shapes shapes(scales, training, held_out, candidates);
  shapes.over_position();
  if (scales.truth) shapes.tone(ChannelKind::kPosition, 5e-4 * scales.position);
  if (scales.truth) shapes.of_position();
  if (!scales.effort) return;
  shapes.tone(ChannelKind::kDrive, 0.1 * scales.load);
  shapes.of_drive();
  if (scales.law) shapes.pulses();
}

}  // namespace ravencal::diagnose
