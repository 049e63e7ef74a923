// SPDX-License-Identifier: Apache-2.0
//
// Sealed cases in which nothing is hidden. Their generator and diagnose share no physics.
#include <gtest/gtest.h>

#include "diagnose/diagnose.hpp"
#include "prove/generator/case.hpp"

namespace {

using namespace ravencal;
using namespace ravencal::prove;

/// Rows at 50 Hz pass the displacement over which friction builds up at once.
TEST(ProveControls, RaiseNoAlarmByHowFrictionBuildsUp) {
  const CaseOptions options{.seed = 911};
  for (const int number : {21, 24}) {
    const CaseDesign design = draw_case(number, options);
    ASSERT_EQ(design.kind, CaseKind::kControl) << number;
    const auto files = make_case(design, {});
    ASSERT_TRUE(files.ok()) << files.error().message;
    const auto plant = physics::parse_plant(files->plant, "plant.toml");
    ASSERT_TRUE(plant.ok()) << plant.error().message;
    const auto report = diagnose::diagnose({files->recording}, {files->held_out}, *plant, {});
    ASSERT_TRUE(report.ok()) << report.error().message;
    EXPECT_EQ(report->verdict.kind, "nothing_left_out") << number << ": " << report->verdict.text;
  }
}

}  // namespace
