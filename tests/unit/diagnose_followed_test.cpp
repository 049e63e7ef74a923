// SPDX-License-Identifier: Apache-2.0
//
// Joints that other joints move: their own loops follow them there, friction of their drives the
// drives. Static poses, one every 0.7 s, on random walks, or zig-zags.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "diagnose_generated.hpp"

namespace ravencal::diagnose {
namespace {

constexpr double kNoise_rad = 1e-3;

/// Uneven steps up to 0.1 rad that turn now and then, within +-0.8 rad.
std::vector<double> walk(int count, std::mt19937_64& engine) {
  const auto uniform = [&] { return static_cast<double>(engine() >> 11U) * 0x1.0p-53; };
  std::vector<double> path;
  double q = 0.0, sign = 1.0;
  for (int i = 0; i < count; ++i) {
    if (uniform() < 0.12 || std::abs(q + sign * 0.1) > 0.8) sign = q > 0.0 ? -1.0 : 1.0;
    if (uniform() < 0.1) sign = -sign;
    q = std::clamp(q + sign * 0.1 * uniform(), -0.8, 0.8);
    path.push_back(q);
  }
  return path;
}

/// The rest of a slack of that half-width: what is dragged along stays where it is inside of it.
class Dragged {
 public:
  explicit Dragged(double half_width) : half_width_(half_width) {}
  double follow(double x) { return at_ = std::clamp(at_, x - half_width_, x + half_width_); }

 private:
  double half_width_;
  double at_ = 0.0;
};

/// Joint "one" as `place` has it for the positions that both are believed to have.
template <typename Place>
record::Recording poses(Place&& place) {
  constexpr int kRows = 1500;
  std::mt19937_64 engine(11);
  const auto one = walk(kRows, engine);
  const auto two = walk(kRows, engine);
  record::Recording r;
  r.source = "poses";
  r.channels = {{"one.estimate", "rad", record::Role::kJointEstimate, "one"},
                {"two.estimate", "rad", record::Role::kJointEstimate, "two"},
                {"one.truth", "rad", record::Role::kJointTruth, "one"}};
  r.samples.resize(kRows, 3);
  for (int i = 0; i < kRows; ++i) {
    const auto n = static_cast<std::size_t>(i);
    double noise = -6.0;
    for (int k = 0; k < 12; ++k) noise += static_cast<double>(engine() >> 11U) * 0x1.0p-53;
    r.t_ns.push_back(static_cast<std::int64_t>(i) * 700'000'000);
    r.samples.row(i) << one[n], two[n], place(one[n], two[n]) + kNoise_rad * noise;
  }
  return r;
}

double error_of(const Report& report, const std::string& joint) {
  for (const HeldOut& h : report.held_out) {
    if (h.joint == joint) return h.after;
  }
  return 1e300;
}

TEST(Followed, ALoopFollowsTheJointWhereAnotherMovesIt) {
  constexpr double kCoupling = 0.4, kHalfWidth_rad = 0.05;
  Dragged link(kHalfWidth_rad);
  const Report report =
      diagnosed(poses([&](double one, double two) { return link.follow(one + kCoupling * two); }));
  // A loop over the joint's own motion leaves 14 times as much as the noise, and asks for one of
  // joint two's.
  EXPECT_LT(error_of(report, "one"), 3.0 * kNoise_rad) << report.verdict.text;
  EXPECT_TRUE(std::none_of(report.effects.begin(), report.effects.end(), [](const NamedEffect& e) {
    return e.id != "coupling" && !e.from.empty();
  })) << report.verdict.text;
  const auto coupling =
      std::find_if(report.effects.begin(), report.effects.end(),
                   [](const NamedEffect& e) { return e.id == "coupling" && e.from == "two"; });
  ASSERT_NE(coupling, report.effects.end()) << report.verdict.text;
  EXPECT_NEAR(coupling->parameters.front().value, kCoupling, 0.01);
}

TEST(Followed, ALaterJointDragsThisOneThroughASlackThatClosesWithinItsRange) {
  constexpr double kDrag = 0.3, kHalfWidth_rad = 0.15;
  Dragged cable(kHalfWidth_rad);
  const Report report =
      diagnosed(poses([&](double one, double two) { return one + kDrag * cable.follow(two); }));
  EXPECT_LT(error_of(report, "one"), 5.0 * kNoise_rad) << report.verdict.text;
  const auto loop =
      std::find_if(report.effects.begin(), report.effects.end(),
                   [](const NamedEffect& e) { return e.id == "hysteresis" && e.from == "two"; });
  ASSERT_NE(loop, report.effects.end()) << report.verdict.text;
  EXPECT_NEAR(std::abs(loop->parameters[0].value), kDrag * kHalfWidth_rad, 0.005);
  EXPECT_NEAR(loop->parameters[1].value, 2.0 * kHalfWidth_rad, 0.05);
}

}  // namespace
}  // namespace ravencal::diagnose
