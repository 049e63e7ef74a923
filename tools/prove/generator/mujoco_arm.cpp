// SPDX-License-Identifier: Apache-2.0
#include "prove/generator/mujoco_arm.hpp"

#include <fmt/format.h>
#include <mujoco/mujoco.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <mutex>

namespace ravencal::prove {
namespace {

using Eigen::Index;

std::string numbers(const Vector3d& v) {
  return fmt::format("{:.17g} {:.17g} {:.17g}", v[0], v[1], v[2]);
}

std::string xml_of(const Chain& chain) {
  std::string open, close;
  for (const ChainLink& link : chain.links()) {
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(link.alpha_rad, Vector3d::UnitX()) *
                                  Eigen::AngleAxisd(link.theta_rad, Vector3d::UnitZ()));
    const Vector3d place(link.a_m, -std::sin(link.alpha_rad) * link.d_m,
                         std::cos(link.alpha_rad) * link.d_m);
    // About its only axis a lone link may have moments that no solid has; MuJoCo wants a solid.
    const Vector3d moments = chain.links().size() == 1
                                 ? Vector3d(Vector3d::Constant(link.inertia_kg_m2[2]))
                                 : link.inertia_kg_m2;
    open += fmt::format(
        "<body pos=\"{}\" quat=\"{:.17g} {:.17g} {:.17g} {:.17g}\"><joint type=\"{}\" axis=\"0 0 "
        "1\"/><inertial pos=\"{}\" mass=\"{:.17g}\" diaginertia=\"{}\"/>",
        numbers(place), turn.w(), turn.x(), turn.y(), turn.z(), link.prismatic ? "slide" : "hinge",
        numbers(link.com_m), std::max(link.mass_kg, 1e-9), numbers(moments));
    close += "</body>";
  }
  return fmt::format(
      "<mujoco><compiler angle=\"radian\" boundmass=\"0\" boundinertia=\"0\"/><option "
      "gravity=\"{}\"/>"
      "<worldbody>{}{}</worldbody></mujoco>",
      numbers(chain.gravity()), open, close);
}

/// MuJoCo's parser keeps state of its own.
std::mutex parser;

}  // namespace

struct MujocoArm::Impl {
  mjModel* model = nullptr;
  mjData* data = nullptr;
  Impl() = default;
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl() {
    if (data != nullptr) mj_deleteData(data);
    if (model != nullptr) mj_deleteModel(model);
  }
};

core::Result<MujocoArm> MujocoArm::create(const Chain& chain) {
  const std::string xml = xml_of(chain);
  auto impl = std::make_unique<Impl>();
  std::array<char, 500> error{};
  {
    const std::lock_guard<std::mutex> lock(parser);
    auto files = std::make_unique<mjVFS>();
    mj_defaultVFS(files.get());
    mj_makeEmptyFileVFS(files.get(), "chain.xml", static_cast<int>(xml.size()));
    std::memcpy(files->filedata[0], xml.data(), xml.size());
    impl->model =
        mj_loadXML("chain.xml", files.get(), error.data(), static_cast<int>(error.size()));
    mj_deleteVFS(files.get());
  }
  if (impl->model != nullptr) impl->data = mj_makeData(impl->model);
  if (impl->data == nullptr)
    return core::Error{core::ErrorCode::kData,
                       fmt::format("MuJoCo refused the arm: {}", error.data())};
  return MujocoArm(std::move(impl));
}

MujocoArm::MujocoArm(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
MujocoArm::MujocoArm(MujocoArm&&) noexcept = default;
MujocoArm& MujocoArm::operator=(MujocoArm&&) noexcept = default;
MujocoArm::~MujocoArm() = default;

ChainDynamics MujocoArm::at(const Vector3d& joints, const Vector3d& velocities) const {
  const int count = impl_->model->nv;
  for (int i = 0; i < count; ++i) {
    impl_->data->qpos[i] = joints[i];
    impl_->data->qvel[i] = velocities[i];
  }
  mj_fwdPosition(impl_->model, impl_->data);
  mj_fwdVelocity(impl_->model, impl_->data);
  std::array<mjtNum, 9> mass{};
  mj_fullM(impl_->model, mass.data(), impl_->data->qM);
  ChainDynamics dynamics;
  for (int i = 0; i < count; ++i) {
    dynamics.bias[i] = impl_->data->qfrc_bias[i];
    for (int k = 0; k < count; ++k)
      dynamics.mass(i, k) = mass[static_cast<std::size_t>(i * count + k)];
  }
  return dynamics;
}

}  // namespace ravencal::prove
