// SPDX-License-Identifier: Apache-2.0
#include "physics/rigid_bodies.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "physics/mujoco_model.hpp"

namespace ravencal::physics {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

template <std::size_t N>
std::string spaced(const std::array<double, N>& values) {
  return fmt::format("{:.17g}", fmt::join(values, " "));
}

/// A body of unit mass: the library refuses solids that no plant is kept from stating, so that
/// masses and moments are set afterwards.
std::string inertial(const std::array<double, 3>& com_m) {
  return fmt::format("<inertial pos=\"{}\" mass=\"1\" diaginertia=\"1 1 1\"/>", spaced(com_m));
}

/// A joint's body with those that it carries.
std::string body_of(const Plant& plant, std::size_t j) {
  const Joint& joint = plant.joints[j];
  const Frame& frame = *joint.frame;
  std::string text = fmt::format(
      "<body name=\"body{}\" pos=\"{}\" quat=\"{}\"><joint name=\"joint{}\" type=\"{}\" "
      "axis=\"{}\"/>{}",
      j, spaced(frame.position_m), spaced(frame.rotation), j,
      joint.kind == JointKind::kPrismatic ? "slide" : "hinge", spaced(frame.axis),
      inertial(joint.link.com_m));
  if (j + 1 == plant.joints.size())
    text += fmt::format("<body name=\"payload\" pos=\"{}\">{}</body>", spaced(plant.payload.com_m),
                        inertial({}));
  for (std::size_t k = j + 1; k < plant.joints.size(); ++k)
    if (plant.joints[k].frame->carried_by == joint.name) text += body_of(plant, k);
  return text + "</body>";
}

std::string model_of(const Plant& plant) {
  std::string bodies;
  for (std::size_t j = 0; j < plant.joints.size(); ++j)
    if (plant.joints[j].frame->carried_by.empty()) bodies += body_of(plant, j);
  return fmt::format(
      "<mujoco><compiler angle=\"radian\"/><option gravity=\"{}\"/><worldbody>{}</worldbody>"
      "</mujoco>",
      spaced(plant.robot.gravity_m_per_s2), bodies);
}

}  // namespace

bool has_frames(const Plant& plant) {
  return !plant.joints.empty() && plant.joints.front().frame.has_value();
}

struct RigidBodies::Impl {
  ModelPointer model;
  std::unique_ptr<mjData, decltype(&mj_deleteData)> data{nullptr, &mj_deleteData};
  std::vector<Index> dofs;  ///< of the plant's joints

  void set_mass(const std::string& body, double mass_kg, const std::array<double, 3>& moments) {
    const int id = mj_name2id(model.get(), mjOBJ_BODY, body.c_str());
    model->body_mass[id] = mass_kg;
    std::copy(moments.begin(), moments.end(), model->body_inertia + 3 * static_cast<Index>(id));
  }

  void set_masses(const Plant& plant) {
    // Of bodies whose inertia never changes the library would keep what it compiled.
    std::fill_n(model->dof_simplenum, model->nv, 0);
    std::fill_n(model->body_simple, model->nbody, static_cast<mjtByte>(0));
    for (std::size_t j = 0; j < plant.joints.size(); ++j) {
      const Link& link = plant.joints[j].link;
      set_mass(fmt::format("body{}", j), link.mass_kg, link.inertia_kg_m2);
    }
    set_mass("payload", plant.payload.mass_kg, {});
    std::copy_n(model->body_mass, model->nbody, model->body_subtreemass);
    for (Index b = model->nbody - 1; b > 0; --b)
      model->body_subtreemass[model->body_parentid[b]] += model->body_subtreemass[b];
  }

  void place(const VectorXd& positions_ji) {
    for (std::size_t j = 0; j < dofs.size(); ++j)
      data->qpos[dofs[j]] = positions_ji[static_cast<Index>(j)];
    mj_kinematics(model.get(), data.get());
    mj_comPos(model.get(), data.get());
  }
};

core::Result<RigidBodies> RigidBodies::create(const Plant& plant) {
  auto impl = std::make_unique<Impl>();
  CompiledModel compiled = compile_model(model_of(plant), "plant.xml");
  if (!compiled.model)
    return core::data_error(
        fmt::format("{}: MuJoCo refuses its bodies: {}", plant.source, compiled.refusal));
  impl->model = std::move(compiled.model);
  impl->data.reset(mj_makeData(impl->model.get()));
  for (std::size_t j = 0; j < plant.joints.size(); ++j) {
    const int id = mj_name2id(impl->model.get(), mjOBJ_JOINT, fmt::format("joint{}", j).c_str());
    impl->dofs.push_back(impl->model->jnt_dofadr[id]);
  }
  impl->set_masses(plant);
  return RigidBodies(std::move(impl));
}

RigidBodies::RigidBodies(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
RigidBodies::RigidBodies(RigidBodies&&) noexcept = default;
RigidBodies& RigidBodies::operator=(RigidBodies&&) noexcept = default;
RigidBodies::~RigidBodies() = default;

VectorXd RigidBodies::efforts(const VectorXd& positions_ji, const VectorXd& velocities_ji,
                              const VectorXd& accelerations_ji) {
  mjData& data = *impl_->data;
  for (std::size_t j = 0; j < impl_->dofs.size(); ++j) {
    data.qvel[impl_->dofs[j]] = velocities_ji[static_cast<Index>(j)];
    data.qacc[impl_->dofs[j]] = accelerations_ji[static_cast<Index>(j)];
  }
  impl_->place(positions_ji);
  mj_comVel(impl_->model.get(), &data);
  VectorXd of_dofs(impl_->model->nv);
  mj_rne(impl_->model.get(), &data, 1, of_dofs.data());
  return of_dofs(impl_->dofs);
}

MatrixXd RigidBodies::mass_matrix(const VectorXd& positions_ji) {
  impl_->place(positions_ji);
  mj_crb(impl_->model.get(), impl_->data.get());
  const Index count = impl_->model->nv;
  MatrixXd full(count, count);
  mj_fullM(impl_->model.get(), full.data(), impl_->data->qM);
  return full(impl_->dofs, impl_->dofs);
}

}  // namespace ravencal::physics
