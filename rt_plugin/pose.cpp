// SPDX-License-Identifier: Apache-2.0
#include "rt_plugin/pose.hpp"

#include <array>
#include <cmath>
#include <cstddef>

namespace ravencal::rt {
namespace {

constexpr double kMicrometresPerMetre = 1e6;

struct Frame {
  std::array<double, 9> rotation{1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};  ///< row-major
  std::array<double, 3> position_m{};
};

std::array<double, 3> rotate(const std::array<double, 9>& rotation,
                             const std::array<double, 3>& vector) noexcept {
  std::array<double, 3> result{};
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t k = 0; k < 3; ++k) result[row] += rotation[3 * row + k] * vector[k];
  }
  return result;
}

Frame operator*(const Frame& a, const Frame& b) noexcept {
  Frame result;
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t column = 0; column < 3; ++column) {
      double sum = 0.0;
      for (std::size_t k = 0; k < 3; ++k) {
        sum += a.rotation[3 * row + k] * b.rotation[3 * k + column];
      }
      result.rotation[3 * row + column] = sum;
    }
  }
  result.position_m = rotate(a.rotation, b.position_m);
  for (std::size_t k = 0; k < 3; ++k) result.position_m[k] += a.position_m[k];
  return result;
}

Frame inverse(const Frame& frame) noexcept {
  Frame result;
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t column = 0; column < 3; ++column) {
      result.rotation[3 * row + column] = frame.rotation[3 * column + row];
    }
  }
  result.position_m = rotate(result.rotation, frame.position_m);
  for (double& value : result.position_m) value = -value;
  return result;
}

/// One joint after Craig: a turn by the twist about x, then by theta about z and d along it.
Frame joint_frame(double twist_rad, double theta_rad, double d_m) noexcept {
  const double ct = std::cos(twist_rad);
  const double st = std::sin(twist_rad);
  const double c = std::cos(theta_rad);
  const double s = std::sin(theta_rad);
  return {{c, -s, 0.0, s * ct, c * ct, -st, s * st, c * st, ct}, {0.0, -st * d_m, ct * d_m}};
}

Frame insertion_frame(const core::ArmGeometry& arm, const float joints_ji[3]) noexcept {
  Frame frame;
  for (std::size_t j = 0; j < 3; ++j) {
    const auto position_ji = static_cast<double>(joints_ji[j]);
    const bool slides = j == 2;
    frame = frame * joint_frame(arm.twist_rad[j],
                                arm.joint_offset_rad[j] + (slides ? 0.0 : position_ji),
                                slides ? position_ji : 0.0);
  }
  return frame;
}

std::int32_t to_um(double position_m) noexcept {
  // Beyond this, a conversion would be undefined; no arm reaches so far.
  constexpr double kFurthest_um = 2e9;
  const double um = position_m * kMicrometresPerMetre;
  if (!(um > -kFurthest_um && um < kFurthest_um)) return 0;
  return static_cast<std::int32_t>(um < 0.0 ? um - 0.5 : um + 0.5);
}

}  // namespace

void move_pose(const core::ArmGeometry& arm, const float from_ji[3], const float to_ji[3],
               std::int32_t position_um[3], float rotation[9]) noexcept {
  Frame pose;
  for (std::size_t k = 0; k < 3; ++k) {
    pose.position_m[k] = static_cast<double>(position_um[k]) / kMicrometresPerMetre;
  }
  for (std::size_t k = 0; k < 9; ++k) pose.rotation[k] = static_cast<double>(rotation[k]);
  pose = insertion_frame(arm, to_ji) * inverse(insertion_frame(arm, from_ji)) * pose;
  for (std::size_t k = 0; k < 3; ++k) position_um[k] = to_um(pose.position_m[k]);
  for (std::size_t k = 0; k < 9; ++k) rotation[k] = static_cast<float>(pose.rotation[k]);
}

}  // namespace ravencal::rt
