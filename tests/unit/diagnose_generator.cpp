// SPDX-License-Identifier: Apache-2.0
#include "diagnose_generator.hpp"

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace ravencal::generator {
namespace {

class Noise {
 public:
  explicit Noise(std::uint64_t seed) : engine_(seed) {}
  double white() {
    // Sum of twelve uniforms: normal enough, and the same everywhere.
    double sum = -6.0;
    for (int i = 0; i < 12; ++i) sum += uniform();
    return sum;
  }
  double uniform() { return static_cast<double>(engine_() >> 11U) * 0x1.0p-53; }

 private:
  std::mt19937_64 engine_;
};

/// First-order coloured noise of unit deviation.
class Coloured {
 public:
  Coloured(double time_s, double dt_s) : keep_(std::exp(-dt_s / time_s)) {}
  double step(Noise& noise) {
    return state_ = keep_ * state_ + std::sqrt(1.0 - keep_ * keep_) * noise.white();
  }

 private:
  double keep_;
  double state_ = 0.0;
};

/// Straight runs between random corners, speed approached over 0.4 s.
std::vector<double> zigzag(std::size_t count, double dt_s, Noise& noise) {
  std::vector<double> path(count);
  double q = 0.0, v = 0.0, target = 0.4, speed = 0.06;
  for (double& sample : path) {
    const double wanted = q < target ? speed : -speed;
    v += (wanted - v) * std::min(1.0, dt_s / 0.15);
    q += v * dt_s;
    if ((target > 0.0 && q >= target) || (target <= 0.0 && q <= target)) {
      target = (target > 0.0 ? -1.0 : 1.0) * (0.05 + 0.45 * noise.uniform());
      speed = 0.02 + 0.1 * noise.uniform();
    }
    sample = q;
  }
  return path;
}

double at(const std::vector<double>& x, double index) {
  const double clamped = std::clamp(index, 0.0, static_cast<double>(x.size() - 1));
  const auto low = static_cast<std::size_t>(clamped);
  const double share = clamped - static_cast<double>(low);
  return low + 1 < x.size() ? x[low] * (1.0 - share) + x[low + 1] * share : x[low];
}

}  // namespace

record::Recording make_recording(const HiddenPhysics& hidden, const Scene& scene) {
  Noise noise(scene.seed);
  const double dt_s = 1.0 / scene.rate_hz;
  const auto count = static_cast<std::size_t>(scene.duration_s * scene.rate_hz);
  const auto one = zigzag(count, dt_s, noise);
  const auto two = zigzag(count, dt_s, noise);

  record::Recording recording;
  recording.source = "generated";
  using record::Role;
  recording.channels = {{"one.estimate", "rad", Role::kJointEstimate, "one"},
                        {"two.estimate", "rad", Role::kJointEstimate, "two"}};
  if (scene.with_truth)
    recording.channels.push_back({"one.truth", "rad", Role::kJointTruth, "one"});
  if (scene.with_torque)
    recording.channels.push_back({"one.torque", "N_m", Role::kDriveTorque, "one"});
  recording.samples.resize(static_cast<Eigen::Index>(count),
                           static_cast<Eigen::Index>(recording.channels.size()));

  Coloured fast(0.5, dt_s), slow(15.0, dt_s), torque_noise(1.0, dt_s);
  double follower = one.front();
  double bristle = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const double t_s = static_cast<double>(i) * dt_s;
    recording.t_ns.push_back(static_cast<std::int64_t>(t_s * 1e9));
    recording.samples(row, 0) = one[i];
    recording.samples(row, 1) = two[i];
    follower = std::clamp(follower, one[i] - hidden.gap_half_rad, one[i] + hidden.gap_half_rad);
    const double late = at(one, static_cast<double>(i) - hidden.delay_s * scene.rate_hz) - one[i];
    const double hill = (one[i] - 0.1) / 0.05;
    Eigen::Index column = 2;
    if (scene.with_truth) {
      recording.samples(row, column++) =
          follower + late + hidden.offset_rad + hidden.gain * one[i] + hidden.coupling * two[i] +
          (t_s > 0.5 * scene.duration_s ? hidden.slip_rad : 0.0) +
          hidden.bump_rad * std::exp(-hill * hill) +
          hidden.wave_rad * std::sin(hidden.wave_order * one[i]) +
          scene.noise * 1e-4 * (noise.white() + fast.step(noise) + 0.5 * slow.step(noise));
    }
    if (scene.with_torque) {
      const double next = one[std::min(i + 1, count - 1)];
      const double last = one[i > 0 ? i - 1 : 0];
      const double v = (next - last) / (2.0 * dt_s);
      const double a = (next - 2.0 * one[i] + last) / (dt_s * dt_s);
      bristle = std::clamp(bristle + v * dt_s / 3e-4, -1.0, 1.0);
      recording.samples(row, column) =
          hidden.inertia_kg_m2 * a + hidden.coulomb_n_m * bristle + hidden.viscous_n_m_s * v +
          scene.noise * 0.02 * (noise.white() + torque_noise.step(noise));
    }
  }
  return recording;
}

std::string plant_text(const std::string& effects) {
  std::string text = R"([robot]
name = "two joints"
gravity_m_per_s2 = [0.0, 0.0, 0.0]
tool_joints_rad = [0.0, 0.0, 0.0, 0.0]
)";
  for (const char* name : {"one", "two"}) {
    text +=
        "\n[[joint]]\nname = \"" + std::string(name) +
        "\"\nkind = \"revolute\"\nmotor_inertia_kg_m2 = 2.0\ngearbox_ratio = 1.0\nreduction = 1.0\n"
        "joint_encoder_resolution_rad = 1e-5\n";
    if (std::string(name) == "one") text += effects;
  }
  return text;
}

}  // namespace ravencal::generator
