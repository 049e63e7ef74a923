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
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

/// What the ten numbers of a link ask of a body in motion: force, and moment about a point.
using Per = Eigen::Matrix<double, 3, kInertialNumbers>;
using Spatial = Eigen::Matrix<double, 6, 1>;  ///< as the library has them: rotation first

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

VectorXd inertial_numbers(const Plant& plant) {
  VectorXd out = VectorXd::Zero(kInertialNumbers * static_cast<Index>(plant.joints.size()));
  const auto add = [&](Index at, double mass_kg, const std::array<double, 3>& com_m) {
    const Vector3d c(com_m[0], com_m[1], com_m[2]);
    const Vector3d squares = c.cwiseAbs2();
    out[at] += mass_kg;
    out.segment<3>(at + 1) += mass_kg * c;
    out.segment<3>(at + 4) += mass_kg * (Vector3d::Constant(squares.sum()) - squares);
    out.segment<3>(at + 7) -= mass_kg * Vector3d(c[0] * c[1], c[0] * c[2], c[1] * c[2]);
  };
  for (std::size_t j = 0; j < plant.joints.size(); ++j) {
    const Link& link = plant.joints[j].link;
    const Index at = kInertialNumbers * static_cast<Index>(j);
    add(at, link.mass_kg, link.com_m);
    for (Index i = 0; i < 3; ++i)
      out[at + 4 + i] += link.inertia_kg_m2[static_cast<std::size_t>(i)];
  }
  add(out.size() - kInertialNumbers, plant.payload.mass_kg, plant.payload.com_m);
  return out;
}

struct RigidBodies::Impl {
  ModelPointer model;
  std::unique_ptr<mjData, decltype(&mj_deleteData)> data{nullptr, &mj_deleteData};
  std::vector<Index> dofs;      ///< of the plant's joints
  std::vector<Index> bodies;    ///< of their links
  std::vector<Index> joint_of;  ///< of each degree of freedom

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

  void move(const VectorXd& positions_ji, const VectorXd& velocities_ji,
            const VectorXd& accelerations_ji) {
    for (std::size_t j = 0; j < dofs.size(); ++j) {
      data->qvel[dofs[j]] = velocities_ji[static_cast<Index>(j)];
      data->qacc[dofs[j]] = accelerations_ji[static_cast<Index>(j)];
    }
    place(positions_ji);
    mj_comVel(model.get(), data.get());
  }

  /// Of each body, as the library has velocities; weight is an acceleration of the ground.
  [[nodiscard]] std::vector<Spatial> accelerations() const {
    std::vector<Spatial> out(static_cast<std::size_t>(model->nbody), Spatial::Zero());
    out[0].tail<3>() = -Eigen::Map<const Vector3d>(model->opt.gravity);
    for (Index b = 1; b < model->nbody; ++b) {
      Spatial& of = out[static_cast<std::size_t>(b)];
      of = out[static_cast<std::size_t>(model->body_parentid[b])];
      for (Index d = model->body_dofadr[b]; d < model->body_dofadr[b] + model->body_dofnum[b]; ++d)
        of += data->qvel[d] * Eigen::Map<const Spatial>(data->cdof_dot + 6 * d) +
              data->qacc[d] * Eigen::Map<const Spatial>(data->cdof + 6 * d);
    }
    return out;
  }

  /// Efforts of one link's numbers on the joints that carry it.
  void add_link(Index link, const Spatial& acceleration, MatrixXd& out) const {
    const Index body = bodies[static_cast<std::size_t>(link)];
    const Eigen::Map<const Spatial> velocity(data->cvel + 6 * body);
    const Matrix3d turn =
        Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(data->xmat + 9 * body);
    const Vector3d at =
        Eigen::Map<const Vector3d>(data->xpos + 3 * body) -
        Eigen::Map<const Vector3d>(data->subtree_com + 3 * model->body_rootid[body]);
    const Vector3d spin = velocity.head<3>(), spin_up = acceleration.head<3>();
    const Vector3d origin = acceleration.tail<3>() + spin_up.cross(at) +
                            spin.cross(velocity.tail<3>() + spin.cross(at));
    Per force = Per::Zero(), moment = Per::Zero();
    force.col(0) = origin;
    const auto add_second = [&](Index column, const Matrix3d& about) {
      moment.col(column) = about * spin_up + spin.cross(about * spin);
    };
    for (Index i = 0; i < 3; ++i) {
      const Vector3d along = turn.col(i), next = turn.col((i + 1) % 3);
      force.col(1 + i) = spin_up.cross(along) + spin.cross(spin.cross(along));
      moment.col(1 + i) = along.cross(origin);
      add_second(4 + i, along * along.transpose());
      constexpr std::array<Index, 3> kProducts = {7, 9, 8};  // xy, yz, zx
      add_second(kProducts.at(static_cast<std::size_t>(i)),
                 along * next.transpose() + next * along.transpose());
    }
    for (Index c = 0; c < kInertialNumbers; ++c) moment.col(c) += at.cross(force.col(c));
    for (Index b = body; b > 0; b = model->body_parentid[b]) {
      if (model->body_dofnum[b] == 0) continue;
      const Index dof = model->body_dofadr[b];
      const Eigen::Map<const Spatial> axis(data->cdof + 6 * dof);
      out.block<1, kInertialNumbers>(joint_of[static_cast<std::size_t>(dof)],
                                     kInertialNumbers * link) =
          axis.head<3>().transpose() * moment + axis.tail<3>().transpose() * force;
    }
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
    impl->bodies.push_back(impl->model->jnt_bodyid[id]);
  }
  impl->joint_of.resize(impl->dofs.size());
  for (std::size_t j = 0; j < impl->dofs.size(); ++j)
    impl->joint_of[static_cast<std::size_t>(impl->dofs[j])] = static_cast<Index>(j);
  impl->set_masses(plant);
  return RigidBodies(std::move(impl));
}

RigidBodies::RigidBodies(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
RigidBodies::RigidBodies(RigidBodies&&) noexcept = default;
RigidBodies& RigidBodies::operator=(RigidBodies&&) noexcept = default;
RigidBodies::~RigidBodies() = default;

VectorXd RigidBodies::efforts(const VectorXd& positions_ji, const VectorXd& velocities_ji,
                              const VectorXd& accelerations_ji) {
  impl_->move(positions_ji, velocities_ji, accelerations_ji);
  VectorXd of_dofs(impl_->model->nv);
  mj_rne(impl_->model.get(), impl_->data.get(), 1, of_dofs.data());
  return of_dofs(impl_->dofs);
}

MatrixXd RigidBodies::efforts_per_number(const VectorXd& positions_ji,
                                         const VectorXd& velocities_ji,
                                         const VectorXd& accelerations_ji) {
  impl_->move(positions_ji, velocities_ji, accelerations_ji);
  const std::vector<Spatial> accelerations = impl_->accelerations();
  const auto links = static_cast<Index>(impl_->bodies.size());
  MatrixXd out = MatrixXd::Zero(links, kInertialNumbers * links);
  for (Index link = 0; link < links; ++link)
    impl_->add_link(
        link,
        accelerations[static_cast<std::size_t>(impl_->bodies[static_cast<std::size_t>(link)])],
        out);
  return out;
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
