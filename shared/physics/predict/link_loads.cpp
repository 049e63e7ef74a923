// SPDX-License-Identifier: Apache-2.0
#include "physics/predict/link_loads.hpp"

#include <algorithm>
#include <deque>
#include <mutex>
#include <utility>

#include "physics/plant_effort.hpp"
#include "physics/rigid_bodies.hpp"

namespace ravencal::physics {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Plants that are remembered: a fit on several threads asks for as many at once.
constexpr std::size_t kRemembered = 8;

/// The plant with none of its masses, or with its masses but no moments.
Plant stripped(Plant plant, bool keep_moments) {
  for (Joint& joint : plant.joints) {
    joint.link.mass_kg = 0.0;
    if (!keep_moments) joint.link.inertia_kg_m2 = {};
  }
  plant.payload.mass_kg = 0.0;
  return plant;
}

bool same_frames(const Plant& one, const Plant& other) {
  return std::equal(one.joints.begin(), one.joints.end(), other.joints.begin(), other.joints.end(),
                    [](const Joint& a, const Joint& b) { return a.frame == b.frame; });
}

bool same_bodies(const Plant& one, const Plant& other) {
  return one.payload == other.payload &&
         std::equal(one.joints.begin(), one.joints.end(), other.joints.begin(),
                    [](const Joint& a, const Joint& b) { return a.link == b.link; }) &&
         same_frames(one, other);
}

/// Places of the numbers of the links that the joint carries.
std::vector<Index> carried_by(const Plant& plant, std::size_t joint) {
  std::vector<Index> places;
  for (std::size_t link = joint; link < plant.joints.size(); ++link)
    for (Index n = 0; n < kInertialNumbers && carries(plant, joint, link); ++n)
      places.push_back(kInertialNumbers * static_cast<Index>(link) + n);
  return places;
}

VectorXd masses_of(const Plant& plant) {
  VectorXd out(static_cast<Index>(plant.joints.size()) + 1);
  for (std::size_t j = 0; j < plant.joints.size(); ++j)
    out[static_cast<Index>(j)] = plant.joints[j].link.mass_kg;
  out[out.size() - 1] = plant.payload.mass_kg;
  return out;
}

}  // namespace

struct LinkLoads::Recent {
  std::mutex mutex;
  std::deque<std::pair<Plant, std::shared_ptr<const Efforts>>> plants;
};

LinkLoads::LinkLoads(Plant nominal, Masses masses)
    : nominal_(std::move(nominal)), masses_(masses) {}

void LinkLoads::move(const std::vector<Motion>& links) {
  links_ = links;
  recent_ = std::make_shared<Recent>();
  per_number_.clear();
  if (masses_ == Masses::kFixed)
    of_links_ = link_efforts(nominal_, links_);
  else if (has_frames(nominal_))
    move_bodies();
  else
    move_masses();
}

/// A row whose efforts are not finite keeps those before it.
void LinkLoads::move_bodies() {
  core::Result<RigidBodies> bodies = RigidBodies::create(nominal_);
  const auto count = static_cast<Index>(links_.size());
  const Index rows = links_.front().q.size();
  carried_.clear();
  for (std::size_t j = 0; j < links_.size(); ++j) {
    carried_.push_back(carried_by(nominal_, j));
    per_number_.emplace_back(rows, static_cast<Index>(carried_[j].size()));
  }
  VectorXd q(count), v(count), a(count);
  MatrixXd last = MatrixXd::Zero(count, kInertialNumbers * count);
  for (Index i = 0; i < rows; ++i) {
    for (Index j = 0; j < count; ++j) {
      const Motion& link = links_[static_cast<std::size_t>(j)];
      q[j] = link.q[i];
      v[j] = link.v[i];
      a[j] = link.a[i];
    }
    if (q.allFinite()) {
      MatrixXd now = bodies->efforts_per_number(q, v, a);
      if (now.allFinite()) last = std::move(now);
    }
    for (std::size_t j = 0; j < links_.size(); ++j)
      per_number_[j].row(i) = last(static_cast<Index>(j), carried_[j]);
  }
}

/// Efforts are linear in the masses.
void LinkLoads::move_masses() {
  of_links_ = link_efforts(stripped(nominal_, true), links_);
  const std::size_t bodies = nominal_.joints.size() + 1;
  per_number_.assign(links_.size(), MatrixXd(links_.front().q.size(), static_cast<Index>(bodies)));
  const Plant weightless = stripped(nominal_, false);
  for (std::size_t body = 0; body < bodies; ++body) {
    Plant one = weightless;
    (body + 1 < bodies ? one.joints[body].link.mass_kg : one.payload.mass_kg) = 1.0;
    const Efforts per_kg = link_efforts(one, links_);
    for (std::size_t j = 0; j < links_.size(); ++j)
      per_number_[j].col(static_cast<Index>(body)) = per_kg[j];
  }
}

LinkLoads::Efforts LinkLoads::efforts(const Plant& plant) const {
  if (!same_frames(nominal_, plant)) return link_efforts(plant, links_);
  if (per_number_.empty()) return of_links_;
  Efforts out;
  const bool frames = has_frames(plant);
  const VectorXd numbers = frames ? inertial_numbers(plant) : masses_of(plant);
  for (std::size_t j = 0; j < links_.size(); ++j) {
    if (frames)
      out.push_back(per_number_[j] * numbers(carried_[j]));
    else
      out.push_back(of_links_[j] + per_number_[j] * numbers);
  }
  return out;
}

std::shared_ptr<const LinkLoads::Efforts> LinkLoads::remembered(const Plant& plant) const {
  {
    const std::lock_guard lock(recent_->mutex);
    for (const auto& [known, efforts] : recent_->plants)
      if (same_bodies(known, plant)) return efforts;
  }
  auto found = std::make_shared<const Efforts>(efforts(plant));
  const std::lock_guard lock(recent_->mutex);
  recent_->plants.emplace_front(plant, found);
  if (recent_->plants.size() > kRemembered) recent_->plants.pop_back();
  return found;
}

VectorXd LinkLoads::of(const Plant& plant, std::size_t joint) const {
  return (*remembered(plant))[joint];
}

}  // namespace ravencal::physics
