// SPDX-License-Identifier: Apache-2.0
#include "core/known_words.hpp"

#include <gtest/gtest.h>

namespace ravencal::core {
namespace {

TEST(KnownWords, SayWhichOneWasLikelyMeant) {
  const std::vector<std::string> known = {"rad", "deg", "N_m", "inertia", "stiffness", "level"};
  EXPECT_EQ(likely_meant("intertia", known), "inertia");
  EXPECT_EQ(likely_meant("n_m", known), "N_m");
  EXPECT_EQ(likely_meant("stiffness_n_m_per_rad", known), "stiffness");
  EXPECT_EQ(likely_meant("furlong", known), std::nullopt);
  EXPECT_EQ(likely_meant("", known), std::nullopt);
}

TEST(KnownWords, AreListedBehindTheGuess) {
  EXPECT_EQ(instead_of("degg", {"rad", "deg"}), "; did you mean 'deg'? known: rad, deg");
  EXPECT_EQ(instead_of("furlong", {"rad", "deg"}), "; known: rad, deg");
}

}  // namespace
}  // namespace ravencal::core
