// SPDX-License-Identifier: Apache-2.0
//
// The black box beside ours, the leak test as a whole, and cases from real recordings.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "prove/baselines.hpp"
#include "prove/black_box.hpp"
#include "prove/leak.hpp"
#include "prove/real_cases.hpp"
#include "record/load.hpp"

namespace {

using namespace ravencal;
using namespace ravencal::prove;
using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;

/// A joint that goes to and fro at random speeds.
Signals wandering(std::uint64_t seed, Eigen::Index rows) {
  Random random(seed, "wandering");
  Signals s;
  for (Eigen::VectorXd* x : {&s.t_s, &s.q, &s.v, &s.a, &s.weight, &s.side}) x->resize(rows);
  for (Eigen::Index i = 0; i < rows; ++i) {
    s.t_s[i] = 0.01 * static_cast<double>(i);
    s.q[i] = random.uniform(-1.0, 1.0);
    s.v[i] = random.normal();
    s.a[i] = random.normal();
    s.side[i] = s.v[i] > 0.0 ? 1.0 : -1.0;
    s.weight[i] = std::sin(s.q[i]);
  }
  return s;
}

Eigen::VectorXd bent(const Signals& s) {
  return 1e-3 * ((4.0 * s.q.array()).sin() + 0.5 * s.side.array() * s.q.array().square()).matrix();
}

TEST(ProveBlackBox, LearnsWhatIsNotLinearAndTheSameEveryTime) {
  const Signals fit = wandering(1, 3000), test = wandering(2, 1000);
  const Eigen::VectorXd y = bent(fit), held_out = bent(test);
  const double before = std::sqrt(held_out.squaredNorm() / 1000.0);
  const double after = black_box_rmse(fit, y, test, held_out);
  EXPECT_LT(after, 0.25 * before);
  EXPECT_EQ(after, black_box_rmse(fit, y, test, held_out));
}

TEST(ProveBlackBox, TakesNothingOffWhatItsInputsDoNotTell) {
  const Signals fit = wandering(1, 3000), test = wandering(2, 1000);
  Random random(3, "noise");
  Eigen::VectorXd y(3000), held_out(1000);
  for (double& value : y) value = random.normal();
  for (double& value : held_out) value = random.normal();
  EXPECT_GT(black_box_rmse(fit, y, test, held_out),
            0.95 * std::sqrt(held_out.squaredNorm() / 1000.0));
}

TEST(ProveBlackBox, StandsBesideTheOthersAndNamesNothing) {
  CaseOptions options;
  options.seed = 2;
  options.duration_s = 20.0;
  options.held_out_s = 10.0;
  const CaseDesign design = draw_case(0, options);
  const auto files = make_case(design, {});
  ASSERT_TRUE(files.ok());
  const Json said = run_baselines(files.value().recording, files.value().held_out, design.nominal);
  for (const char* method : {"bic_forward", "stlsq", "lasso", "everything", "black_box"}) {
    ASSERT_TRUE(said.contains(method)) << method;
    EXPECT_FALSE(said[method]["held_out"].empty()) << method;
  }
  EXPECT_TRUE(said["black_box"]["named"].is_null());
  EXPECT_TRUE(said["lasso"]["named"].is_array());
}

TEST(ProveLeakTest, RingsWhereAHiddenEffectShowsInTheFormOfItsFiles) {
  ProofOptions options;
  options.seed = 4;
  options.jobs = 1;
  LeakOptions leak;
  leak.pairs = 14;
  leak.duration_s = 5.0;
  leak.planted = [](CaseFiles& files) {
    files.plant += "# one more line\n";
    files.recording.meta["effects"] = "1";
    files.recording.events.push_back({0, "note", ""});
  };
  const auto rung = leak_test(options, leak);
  ASSERT_TRUE(rung.ok()) << rung.error().message;
  EXPECT_EQ(rung.value()["pairs"], 14);
  EXPECT_FALSE(rung.value()["at_chance"].get<bool>());
  EXPECT_GT(rung.value()["ci95"][0].get<double>(), 0.5);
}

TEST(ProveReal, SaysWhichRecordingIsNotThere) {
  const core::Status status = have_real_recordings("/nowhere", "/nowhere");
  ASSERT_FALSE(status.ok());
  EXPECT_NE(status.error().message.find("/nowhere/"), std::string::npos);
  EXPECT_NE(status.error().message.find("--data"), std::string::npos);
}

TEST(ProveReal, WritesTheInjectedRippleAtTheJointAndAddsItAtTheCapstan) {
  const fs::path data = RAVENCAL_DATA_DIR;
  if (!fs::exists(data / "raven2_uiuc")) GTEST_SKIP() << "no real recordings at RAVENCAL_DATA_DIR";
  const fs::path house = fs::path(RAVENCAL_SOURCE_DIR) / "tools";
  int seen = 0;
  for (const RealCase& real : real_cases()) {
    if (real.set != "raven2_uiuc" || real.track != "injected") continue;
    ++seen;
    const auto files = make_real_case(real, data, house, 1);
    ASSERT_TRUE(files.ok()) << files.error().message;
    record::LoadOptions load;
    load.profile = (house / "profiles" / "raven2_uiuc.toml").string();
    const auto plain = record::load_recording(data / real.set / real.recording, load);
    ASSERT_TRUE(plain.ok());
    const auto column = plain.value().column(record::Role::kDriveTorque, real.joint);
    ASSERT_TRUE(column.has_value());
    const double most =
        (files.value().recording.samples.col(*column) - plain.value().samples.col(*column))
            .cwiseAbs()
            .maxCoeff();
    const Json manifest = Json::parse(files.value().manifest);
    EXPECT_NEAR(most, 0.03, 1e-4);
    EXPECT_NEAR(manifest["subjects"][0]["value"].get<double>(), most * 121.5 / 12.25, 1e-3);
  }
  EXPECT_EQ(seen, 1);
}

}  // namespace
