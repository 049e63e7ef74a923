// SPDX-License-Identifier: Apache-2.0
#include "physics/robot_model/body_places.hpp"

#include <algorithm>
#include <cmath>
#include <memory>

namespace ravencal::physics {
namespace {

using Eigen::Index;
using Eigen::Isometry3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

template <std::size_t N>
bool alike(const std::array<double, N>& one, const std::array<double, N>& other) {
  return std::equal(one.begin(), one.end(), other.begin(),
                    [](double a, double b) { return std::abs(a - b) <= kSameNumber; });
}

}  // namespace

bool same_frame(const Frame& one, const Frame& other) {
  return one.carried_by == other.carried_by && alike(one.position_m, other.position_m) &&
         alike(one.rotation, other.rotation) && alike(one.axis, other.axis);
}

Isometry3d pose_of(const Frame& f) {
  const Quaterniond turn(f.rotation[0], f.rotation[1], f.rotation[2], f.rotation[3]);
  return Eigen::Translation3d(f.position_m[0], f.position_m[1], f.position_m[2]) *
         turn.normalized();
}

std::vector<Isometry3d> link_frames(const Plant& plant) {
  std::vector<Isometry3d> frames;
  for (const Joint& joint : plant.joints) {
    const auto carrier = plant.joint_index(joint.frame->carried_by);
    const Isometry3d at = pose_of(*joint.frame);
    frames.push_back(carrier ? frames[*carrier] * at : at);
  }
  return frames;
}

std::vector<Isometry3d> body_frames(const mjModel& model) {
  const std::unique_ptr<mjData, decltype(&mj_deleteData)> data(mj_makeData(&model), &mj_deleteData);
  std::fill_n(data->qpos, model.nq, 0.0);
  mj_kinematics(&model, data.get());
  std::vector<Isometry3d> frames;
  for (Index b = 0; b < model.nbody; ++b) {
    const mjtNum* q = data->xquat + 4 * b;
    const Vector3d at = Eigen::Map<const Vector3d>(data->xpos + 3 * b);
    frames.emplace_back(Eigen::Translation3d(at) * Quaterniond(q[0], q[1], q[2], q[3]));
  }
  return frames;
}

}  // namespace ravencal::physics
