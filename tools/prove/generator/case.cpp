// SPDX-License-Identifier: Apache-2.0
#include "prove/generator/case.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace ravencal::prove {
namespace {

constexpr int kBlock = 20;
constexpr double kSmallest = 0.3, kGross = 15.0;  // sizes over the floor

std::vector<std::size_t> shuffled(std::size_t count, Random random) {
  std::vector<std::size_t> order(count);
  std::iota(order.begin(), order.end(), std::size_t{0});
  for (std::size_t i = count; i > 1; --i) std::swap(order[i - 1], order[random.below(i)]);
  return order;
}

/// Kind of case `number`, and how many of that kind came before it.
std::pair<CaseKind, int> place_in_mix(int number, std::uint64_t seed) {
  constexpr std::array<std::pair<CaseKind, int>, 5> kMix = {{{CaseKind::kControl, 6},
                                                             {CaseKind::kSingle, 7},
                                                             {CaseKind::kPair, 3},
                                                             {CaseKind::kOutside, 2},
                                                             {CaseKind::kParameter, 2}}};
  const int block = number / kBlock;
  const auto order = shuffled(kBlock, Random(seed, fmt::format("block {}", block)));
  auto slot = static_cast<int>(order[static_cast<std::size_t>(number % kBlock)]);
  for (const auto& [kind, count] : kMix) {
    if (slot < count) return {kind, block * count + slot};
    slot -= count;
  }
  return {CaseKind::kControl, 0};
}

/// Every kind comes equally often: rounds through a shuffled list.
const SubjectKind& kind_in_turn(std::span<const SubjectKind> kinds, int turn, std::uint64_t seed,
                                std::string_view name) {
  const auto count = static_cast<int>(kinds.size());
  const auto order = shuffled(kinds.size(), Random(seed, fmt::format("{} {}", name, turn / count)));
  return kinds[order[static_cast<std::size_t>(turn % count)]];
}

char robot_for(std::span<const SubjectKind* const> kinds, Random& random) {
  char robot = random.uniform() < 0.65 ? 'r' : 'a';
  for (const SubjectKind* kind : kinds)
    if (kind->robot != 'b') robot = kind->robot;
  return robot;
}

bool agree(const SubjectKind& a, const SubjectKind& b) {
  const bool robots = a.robot == 'b' || b.robot == 'b' || a.robot == b.robot;
  return robots && a.id != b.id;
}

OffParameter draw_off(const CaseDesign& design, Random& random) {
  const std::size_t joint = random.below(design.nominal.joints.size());
  std::vector<OffParameter> possible;
  for (const char* id : {"compliance", "coulomb_friction", "viscous_friction", "joint_friction"}) {
    const SubjectKind* kind = kind_of(id);
    if (kind->stated_by(design.nominal.joints[joint]) &&
        (is_rich(design.base.motion) || !kind->is(kWantsRich)))
      possible.push_back({kind, joint});
  }
  OffParameter off = possible[random.below(possible.size())];
  const double far = random.uniform(3.0, 6.0) * kTolerance;
  off.factor = random.uniform() < 0.5 ? 1.0 + far : 1.0 / (1.0 + far);
  return off;
}

struct Plan {
  CaseKind kind;
  std::vector<const SubjectKind*> subjects;
  std::vector<double> over_floor;  ///< 0: a decoy
};

CaseDesign build(const Plan& plan, int number, const CaseOptions& options, Random random) {
  CaseDesign design;
  design.number = number;
  design.kind = plan.kind;
  design.motion_seed = random.bits();
  design.noise_seed = random.bits();
  design.held_out_seed = random.bits();
  const bool wants_rich = std::any_of(plan.subjects.begin(), plan.subjects.end(),
                                      [](const SubjectKind* k) { return k->is(kWantsRich); });
  const bool wants_law = std::any_of(plan.subjects.begin(), plan.subjects.end(),
                                     [](const SubjectKind* k) { return k->law_rms != nullptr; });
  design.world = &world_of(options.world, number);
  const CaseNeeds needs{wants_rich, wants_law, options.duration_s, options.held_out_s};
  const RecordingForm form = design.world->draw_form(needs, random);
  design.nominal = robot_for(plan.subjects, random) == 'r' ? draw_raven(random) : draw_axis(random);
  design.nominal.row_rate_hz = form.rate_hz;
  design.world->draw_plant(needs, design.nominal, random);
  Random ways(options.seed, fmt::format("ways {}", number));
  draw_ways(design.nominal, ways);
  const auto figures =
      motion_figures(design.nominal, form.motion, form.duration_s, design.motion_seed);
  for (const SubjectKind* kind : plan.subjects)
    design.subjects.push_back(
        draw_subject(*kind, design.nominal, figures, form.duration_s, random));
  for (std::size_t i = 0; i < plan.subjects.size(); ++i) {
    Subject& s = design.subjects[i];
    const NominalJoint& joint = design.nominal.joints[s.joint];
    const double floor = typical_floor(joint.prismatic, !s.kind->stage.in_truth);
    s.amplitude = plan.over_floor[i] > 0.0
                      ? amplitude_for(s, design.nominal, figures, plan.over_floor[i] * floor)
                      : 0.0;
  }
  for (const Subject& s : design.subjects) conceal(s, design.nominal);
  design.truth = within_tolerance(design.nominal, random);
  design.base.motion = form.motion;
  if (plan.kind == CaseKind::kParameter) {
    design.off = draw_off(design, random);
    // The factor is against the plant, whatever the draw within tolerance was.
    const auto value = design.off->kind->stated[0].value;
    design.truth.joints[design.off->joint].*value =
        design.nominal.joints[design.off->joint].*value * design.off->factor;
  }
  design.base = exact_session(design.truth);
  design.world->draw_laws(design.nominal, form.duration_s, design.base, random);
  design.base.motion = form.motion;
  design.base.duration_s = form.duration_s;
  design.held_out_s = form.held_out_s;
  add_noise(design.base, random);
  const double missing = random.uniform();
  design.base.with_torque = missing >= 0.1;
  design.base.with_truth = missing < 0.9;
  return design;
}

Plan plan_of(int number, std::uint64_t seed, Random& random) {
  const auto [kind, turn] = place_in_mix(number, seed);
  Plan plan{kind, {}, {}};
  const auto all = vocabulary_kinds();
  const auto any = [&]() -> const SubjectKind* { return &all[random.below(all.size())]; };
  switch (kind) {
    case CaseKind::kControl:
    case CaseKind::kParameter:
      plan.subjects = {any()};
      plan.over_floor = {0.0};
      break;
    case CaseKind::kSingle:
      plan.subjects = {&kind_in_turn(all, turn, seed, "singles")};
      plan.over_floor = {random.log_uniform(kSmallest, kGross)};
      break;
    case CaseKind::kPair: {
      const SubjectKind* first = &kind_in_turn(all, turn, seed, "pairs");
      const SubjectKind* second = any();
      while (!agree(*first, *second)) second = any();
      plan.subjects = {first, second};
      plan.over_floor = {random.log_uniform(3.0, kGross), random.log_uniform(3.0, kGross)};
      break;
    }
    case CaseKind::kOutside: {
      const SubjectKind* first = &kind_in_turn(outside_kinds(), turn, seed, "outside");
      const SubjectKind* decoy = any();
      while (!agree(*first, *decoy)) decoy = any();
      plan.subjects = {first, decoy};
      plan.over_floor = {random.log_uniform(5.0, kGross), 0.0};
      break;
    }
  }
  return plan;
}

}  // namespace

std::string_view word_of(CaseKind kind) {
  constexpr std::array<std::string_view, 5> kWords = {"control", "single", "pair", "outside",
                                                      "parameter"};
  return kWords[static_cast<std::size_t>(kind)];
}

CaseDesign draw_case(int number, const CaseOptions& options) {
  Random random(options.seed, fmt::format("case {}", number));
  const Plan plan = plan_of(number, options.seed, random);
  return build(plan, number, options, random);
}

CaseDesign draw_gross_case(int number, const CaseOptions& options) {
  Random random(options.seed, fmt::format("gross case {}", number));
  const auto all = vocabulary_kinds();
  const Plan plan{CaseKind::kSingle, {&all[random.below(all.size())]}, {kGross}};
  return build(plan, number, options, random);
}

CaseDesign draw_case_with(const SubjectKind& kind, double over_floor, int number,
                          const CaseOptions& options) {
  Plan plan{over_floor > 0.0 ? CaseKind::kSingle : CaseKind::kControl, {&kind}, {over_floor}};
  return build(plan, number, options, Random(options.seed, fmt::format("lone case {}", number)));
}

Session session_of(const CaseDesign& design, std::optional<std::size_t> without) {
  Session session = design.base;
  for (std::size_t i = 0; i < design.subjects.size(); ++i) {
    if (without != i) apply(design.subjects[i], design.subjects[i].amplitude, session);
  }
  return session;
}

}  // namespace ravencal::prove
