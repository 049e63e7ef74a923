// SPDX-License-Identifier: Apache-2.0
#include "conceal/conceal.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "conceal/kinds.hpp"

namespace ravencal::conceal {
namespace {

constexpr int kTries = 5;            // for one size
constexpr int kDraws = 40;           // of places, until the motion shows one
constexpr double kNearEnough = 0.2;  // of a size's logarithm
constexpr double kLongestStride = 16.0;

std::size_t below(std::size_t count, physics::RandomSource& random) {
  const auto drawn = static_cast<std::size_t>(random.uniform() * static_cast<double>(count));
  return std::min(drawn, count - 1);
}

/// Any kind that some joint lacks is as likely, and any joint that lacks it.
std::optional<std::pair<const Kind*, std::size_t>> draw_kind(const physics::Plant& plant,
                                                             physics::RandomSource& random) {
  std::vector<const Kind*> possible;
  for (const Kind& kind : kinds())
    if (!joints_without(kind, plant).empty()) possible.push_back(&kind);
  if (possible.empty()) return std::nullopt;
  const Kind* kind = possible[below(possible.size(), random)];
  const std::vector<std::size_t> joints = joints_without(*kind, plant);
  return std::pair{kind, joints[below(joints.size(), random)]};
}

/// The twin in the motion for which sizes are chosen.
struct Trial {
  const physics::Plant& plant;
  const trajectory::Trajectory& motion;
  std::uint64_t seed;
  std::filesystem::path scratch;
};

struct Attempt {
  double size = 0.0;
  Visibility visibility;
};

/// Steps towards the size that is seen as `target` scatters; empty where the arm does not bear it
/// or the motion does not show it.
std::optional<Attempt> sized(const Place& place, double target, const Observed& plain,
                             const Trial& trial) {
  double size = std::min(place.start, place.most);
  for (int attempt = 0; attempt < kTries; ++attempt) {
    const auto traces = observe(with_effect(trial.plant, place.joint, effect_of(place, size)),
                                trial.motion, trial.seed, trial.scratch);
    if (!traces.ok()) return std::nullopt;
    const Visibility visibility = visibility_at(place.joint, plain, *traces);
    if (!std::isfinite(visibility.most()) || visibility.most() <= 0.0) return std::nullopt;
    if (std::abs(std::log(visibility.most() / target)) < kNearEnough)
      return Attempt{size, visibility};
    if (size >= place.most && visibility.most() < target)
      return visibility.most() >= kLeastSize ? std::optional(Attempt{size, visibility})
                                             : std::nullopt;
    const double stride =
        std::clamp(target / visibility.most(), 1.0 / kLongestStride, kLongestStride);
    size = std::min(size * stride, place.most);
  }
  return std::nullopt;
}

}  // namespace

core::Result<Hidden> conceal(const physics::Plant& plant, const trajectory::Trajectory& motion,
                             std::uint64_t seed, const std::filesystem::path& scratch,
                             const std::function<bool()>& look) {
  const Trial trial{plant, motion, seed, scratch};
  RAVENCAL_ASSIGN_OR_RETURN(const Observed plain, observe_scatter(plant, motion, seed, scratch));
  physics::RandomSource random(seed);
  for (int draw = 0; draw < kDraws; ++draw) {
    if (!look()) return core::Error{core::ErrorCode::kUsage, "stopped; nothing was written"};
    const auto drawn = draw_kind(plant, random);
    if (!drawn) break;
    const double target = kLeastSize * std::pow(kMostSize / kLeastSize, random.uniform());
    const Place place = draw_place(*drawn->first, drawn->second, plant, plain, target, random);
    const auto found = sized(place, target, plain, trial);
    if (!found) continue;
    return Hidden{place.joint, effect_of(place, found->size), std::string(place.kind->parameter),
                  found->visibility};
  }
  return core::Error{core::ErrorCode::kData,
                     fmt::format("{}: the joints have every effect that could be hidden, or this "
                                 "motion shows none of them",
                                 plant.source)};
}

}  // namespace ravencal::conceal
