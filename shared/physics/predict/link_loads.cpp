// SPDX-License-Identifier: Apache-2.0
#include "physics/predict/link_loads.hpp"

#include <algorithm>
#include <deque>
#include <mutex>
#include <utility>

#include "physics/plant_effort.hpp"

namespace ravencal::physics {
namespace {

/// Plants with other frames that are remembered: a fit on several threads asks for as many at once.
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
  return same_frames(one, other) && one.payload == other.payload &&
         std::equal(one.joints.begin(), one.joints.end(), other.joints.begin(),
                    [](const Joint& a, const Joint& b) { return a.link == b.link; });
}

}  // namespace

struct LinkLoads::Recent {
  std::mutex mutex;
  std::deque<std::pair<Plant, std::shared_ptr<const Efforts>>> plants;
};

LinkLoads::LinkLoads(Plant nominal, Masses masses)
    : nominal_(std::move(nominal)), masses_(masses) {}

/// Efforts are linear in the masses.
void LinkLoads::move(const std::vector<Motion>& links) {
  links_ = links;
  recent_ = std::make_shared<Recent>();
  const bool vary = masses_ == Masses::kVary;
  of_links_ = link_efforts(vary ? stripped(nominal_, true) : nominal_, links_);
  if (!vary) return;
  per_kg_.clear();
  const Plant weightless = stripped(nominal_, false);
  for (std::size_t body = 0; body <= nominal_.joints.size(); ++body) {
    Plant one = weightless;
    (body < nominal_.joints.size() ? one.joints[body].link.mass_kg : one.payload.mass_kg) = 1.0;
    per_kg_.push_back(link_efforts(one, links_));
  }
}

std::shared_ptr<const LinkLoads::Efforts> LinkLoads::elsewhere(const Plant& plant) const {
  {
    const std::lock_guard lock(recent_->mutex);
    for (const auto& [known, efforts] : recent_->plants)
      if (same_bodies(known, plant)) return efforts;
  }
  auto efforts = std::make_shared<const Efforts>(link_efforts(plant, links_));
  const std::lock_guard lock(recent_->mutex);
  recent_->plants.emplace_front(plant, efforts);
  if (recent_->plants.size() > kRemembered) recent_->plants.pop_back();
  return efforts;
}

Eigen::VectorXd LinkLoads::of(const Plant& plant, std::size_t joint) const {
  if (!same_frames(nominal_, plant)) return (*elsewhere(plant))[joint];
  Eigen::VectorXd load = of_links_[joint];
  for (std::size_t body = 0; body < per_kg_.size(); ++body) {
    const double mass_kg =
        body < plant.joints.size() ? plant.joints[body].link.mass_kg : plant.payload.mass_kg;
    if (mass_kg != 0.0) load += mass_kg * per_kg_[body][joint];
  }
  return load;
}

}  // namespace ravencal::physics
