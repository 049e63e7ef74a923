// SPDX-License-Identifier: Apache-2.0
//
// Hours of the digital twin with everything going wrong at random: no number, frozen and jumping
// clocks, stale states, encoder jumps, lost cycle ends, E-stops, homings, pedals, new weights and
// weights at fault. The output must never leave the envelope and the counters must add up.
// RAVENCAL_SOAK_TICKS sets the length; 21600000 is six hours of the robot's time.
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <limits>
#include <numeric>
#include <random>

#include "core/run_level.hpp"
#include "physics/plant.hpp"
#include "physics/raven_twin.hpp"
#include "plugin_host/robot_state.hpp"
#include "rt/rig.hpp"
#include "rt/witness.hpp"

namespace ravencal::test {
namespace {

using Eigen::Vector3d;

/// Inputs that the twin keeps within range in sound work, of both kinds of lag.
model::CalibrationModel any_model(std::uint64_t seed) {
  model::CalibrationModel model = make_model(
      {plain("jpos.shoulder"), plain("jpos.elbow"), plain("jpos.insertion"), plain("tau.elbow"),
       plain("mvel.elbow"), lagged("jpos.elbow", 2), with_play("mpos.shoulder", 1.0F)},
      {16, 16}, seed);
  model.input.mean << 0.7, 1.4, 0.38, 0.0, 0.0, 1.4, 90.0;
  model.input.scale << 0.7, 0.8, 0.15, 2.0, 50.0, 0.8, 120.0;
  model.input_min = model.input.mean - model.input.scale;
  model.input_max = model.input.mean + model.input.scale;
  return model;
}

std::int64_t ticks_asked_for() {
  constexpr std::int64_t kShort = 400'000;
  const char* const text = std::getenv("RAVENCAL_SOAK_TICKS");
  return text == nullptr ? kShort : std::atoll(text);
}

class Soak {
 public:
  Soak()
      : plant_(*physics::load_plant(RAVENCAL_SOURCE_DIR "/tools/plants/raven2.toml")),
        twin_(std::move(physics::RavenTwin::create(plant_, 1)).value()),
        witness_(rig.config) {
    for (std::uint64_t i = 0; i < 4; ++i) {
      weights_.push_back(write_weights(any_model(i), "soak" + std::to_string(i)));
    }
    weights_.push_back(write_weights(make_model_with_a_flaw(), "soak_flaw"));
    rig.enable();
    home();
  }

  void run(std::int64_t ticks) {
    while (done < ticks && wrong.empty()) {
      if (left_ == 0) choose();
      --left_;
      cycle();
    }
  }

  Rig rig;
  std::string wrong;
  std::int64_t done = 0;
  std::uint64_t loads = 0;
  std::uint64_t homings = 0;

 private:
  enum class Trouble {
    kNone,
    kNotFinite,
    kInfinite,
    kFrozenClock,
    kJumpingClock,
    kStaleState,
    kEncoderJump,
    kLostCycleEnd,
    kFarOut,
    kEmergencyStop,
    kPedalUp,
    kDisabled,
    kHoming,
    kSwap,
    kFlaw,
    kCount
  };

  int below(int limit) { return static_cast<int>(random_() % static_cast<unsigned>(limit)); }

  /// What goes wrong next, and for how many ticks; sound work for some seconds in between.
  void choose() {
    if (trouble_ != Trouble::kNone) {
      recover();
      trouble_ = Trouble::kNone;
      left_ = 200 + below(6000);
      return;
    }
    trouble_ = static_cast<Trouble>(1 + below(static_cast<int>(Trouble::kCount) - 1));
    left_ = 1 + below(below(4) == 0 ? 2000 : 30);
    if (trouble_ == Trouble::kHoming) {
      if (below(10) == 0) home();
    } else if (trouble_ == Trouble::kSwap) {
      load(static_cast<std::size_t>(below(4)));
    } else if (trouble_ == Trouble::kFlaw && below(5) == 0) {
      load(4);
    } else if (trouble_ == Trouble::kDisabled) {
      rig.enable(false);
    }
  }

  void recover() {
    if (trouble_ == Trouble::kDisabled) rig.enable();
    if (rig.output.state == RAVENCAL_STATE_FAULT) {
      rig.api().reset(rig.instance.get());
      step(rig.state);
      load(static_cast<std::size_t>(below(4)));
      rig.enable();
    }
  }

  void load(std::size_t which) {
    if (!rig.instance.load(weights_[which]).ok()) wrong = "a load was refused";
    ++loads;
    step(rig.state);  // takes it, so that none is replaced before it was
  }

  void home() {
    ++homings;
    rig.api().set_mode(rig.instance.get(), RAVENCAL_MODE_SHADOW);
    twin_.home([&] {
      ravencal_state state = rig.state;
      state.t_ns = twin_.t_ns();
      state.runlevel = core::kInit;
      for (ravencal_arm& arm : state.arm) arm.joints_ready = 0;
      step(state);
    });
    rig.enable();
    desired_ji_ = twin_.estimate_ji();
    target_ji_ = desired_ji_;
  }

  void step(const ravencal_state& state) {
    rig.api().step(rig.instance.get(), &state, &rig.output);
    ++done;
    const std::string now = witness_.see(state, rig.output);
    if (wrong.empty()) wrong = now;
  }

  void cycle() {
    plugin_host::fill_state(plugin_host::to_si(twin_.begin_cycle()), twin_.t_ns(), true, rig.state);
    rig.state.runlevel = trouble_ == Trouble::kEmergencyStop ? core::kEmergencyStop
                         : trouble_ == Trouble::kPedalUp     ? core::kPedalUp
                                                             : core::kPedalDown;
    ravencal_state state = rig.state;
    disturb(state);
    step(state);
    move();
    plugin_host::fill_state(plugin_host::to_si(twin_.end_cycle(desired_ji_)), state.t_ns, true,
                            rig.state);
    if (trouble_ != Trouble::kLostCycleEnd) {
      rig.api().observe_cycle_end(rig.instance.get(), &rig.state);
    }
  }

  void disturb(ravencal_state& state) {
    ravencal_arm& arm = state.arm[0];
    switch (trouble_) {
      case Trouble::kNotFinite:
        arm.jpos_ji[below(3)] = std::numeric_limits<float>::quiet_NaN();
        break;
      case Trouble::kInfinite:
        arm.mvel_rad_per_s[1] = -std::numeric_limits<float>::infinity();
        break;
      case Trouble::kFrozenClock:
        state.t_ns = frozen_.t_ns;
        break;
      case Trouble::kJumpingClock:
        state.t_ns += (below(2) == 0 ? 1 : -1) * std::int64_t{below(1'000'000'000)};
        break;
      case Trouble::kStaleState:
        state = frozen_;
        break;
      case Trouble::kEncoderJump:
        arm.enc_counts[below(3)] += below(2'000'000) - 1'000'000;
        break;
      case Trouble::kFarOut:
        arm.jpos_ji[below(3)] += static_cast<float>(below(100) - 50);
        break;
      case Trouble::kFlaw:
        arm.jpos_ji[0] = 0.75F;  // the corner of make_model_with_a_flaw
        arm.jpos_ji[1] = -0.24F;
        break;
      default:
        frozen_ = state;
        break;
    }
  }

  /// Towards a target at the authors' speeds; a new one when it is reached.
  void move() {
    const Vector3d fastest(0.038e-3, 0.052e-3, 0.005e-3);
    if ((target_ji_ - desired_ji_).cwiseAbs().maxCoeff() < 1e-4) {
      const auto share = [&] { return static_cast<double>(below(1000)) * 1e-3; };
      target_ji_ = {0.35 + 0.7 * share(), 0.96 + 0.96 * share(), 0.33 + 0.09 * share()};
    }
    desired_ji_ += (target_ji_ - desired_ji_).cwiseMin(fastest).cwiseMax(-fastest);
  }

  physics::Plant plant_;
  physics::RavenTwin twin_;
  Witness witness_;
  std::vector<std::filesystem::path> weights_;
  std::mt19937_64 random_{11};
  Trouble trouble_ = Trouble::kSwap;
  int left_ = 0;
  ravencal_state frozen_{};
  Vector3d desired_ji_ = Vector3d::Zero();
  Vector3d target_ji_ = Vector3d::Zero();

 public:
  [[nodiscard]] std::string check() const { return witness_.check(rig.instance.counters()); }
};

TEST(Soak, NeverLeavesTheEnvelopeAndCountsEveryTick) {
  Soak soak;
  const std::int64_t ticks = ticks_asked_for();
  soak.run(ticks);
  ASSERT_EQ(soak.wrong, "");
  EXPECT_EQ(soak.check(), "");
  const ravencal_counters counters = soak.rig.instance.counters();
  EXPECT_GE(counters.ticks, static_cast<std::uint64_t>(ticks));
  EXPECT_LE(counters.swaps, soak.loads);
  std::string states;
  for (std::size_t state = 0; state < RAVENCAL_STATE_COUNT; ++state) {
    EXPECT_GT(counters.ticks_in_state[state], 0U)
        << plugin_host::state_name(static_cast<int>(state));
    states += std::string(" ") + plugin_host::state_name(static_cast<int>(state)) + " " +
              std::to_string(counters.ticks_in_state[state]);
  }
  EXPECT_GT(counters.ticks_in_state[RAVENCAL_STATE_ACTIVE] +
                counters.ticks_in_state[RAVENCAL_STATE_FADING_IN],
            counters.ticks / 2);
  std::printf("%llu ticks, %llu transitions, %llu swaps, %llu rollbacks, %llu homings;%s\n",
              static_cast<unsigned long long>(counters.ticks),
              static_cast<unsigned long long>(counters.transitions),
              static_cast<unsigned long long>(counters.swaps),
              static_cast<unsigned long long>(counters.rollbacks),
              static_cast<unsigned long long>(soak.homings), states.c_str());
}

}  // namespace
}  // namespace ravencal::test
