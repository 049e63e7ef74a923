// SPDX-License-Identifier: Apache-2.0
#include "core/catalogue.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "core/units.hpp"

namespace ravencal::core {
namespace {

TEST(Catalogue, NamesThePapersHundredAndTwelveFeatures) {
  const auto in_table = [](const CatalogueEntry& e) { return e.in_paper_table; };
  EXPECT_EQ(std::count_if(catalogue().begin(), catalogue().end(), in_table), 112);
}

TEST(Catalogue, LeavesTheTwoHundredAndEightInputsOfTheAuthorsNotebook) {
  const auto in_notebook = [](const CatalogueEntry& e) {
    return e.field != RavenField::kEncVals && e.field != RavenField::kEncOffsets;
  };
  EXPECT_EQ(std::count_if(catalogue().begin(), catalogue().end(), in_notebook), 208);
}

TEST(Catalogue, FollowsTheColumnsOfTheAuthorsCsv) {
  // Zero-based CSV columns of the authors' recorder, minus the 12 before raven_state.
  EXPECT_EQ(catalogue_index(RavenField::kTime, 0) + 12, 12U);
  EXPECT_EQ(catalogue_index(RavenField::kJpos, 0) + 12, 13U);
  EXPECT_EQ(catalogue_index(RavenField::kType, 0, true) + 12, 33U);
  EXPECT_EQ(catalogue_index(RavenField::kEncVals, 0) + 12, 82U);
  EXPECT_EQ(catalogue_index(RavenField::kMpos, 0) + 12, 130U);
  EXPECT_EQ(catalogue_index(RavenField::kJacF, 5, true) + 12, 251U);
}

TEST(Catalogue, HasUniqueNamesThatAreFoundAgain) {
  std::set<std::string> names;
  for (std::size_t i = 0; i < catalogue().size(); ++i) {
    EXPECT_TRUE(names.insert(catalogue()[i].name).second) << catalogue()[i].name;
    EXPECT_EQ(catalogue_index_of(catalogue()[i].name), i);
  }
  EXPECT_EQ(catalogue_index_of("jpos.nothing"), std::nullopt);
}

TEST(Catalogue, GivesEveryValueAUnitThatConvertsToItsSiUnit) {
  for (const CatalogueEntry& entry : catalogue()) {
    const auto unit = find_unit(entry.message_unit);
    ASSERT_TRUE(unit.has_value()) << entry.name << " " << entry.message_unit;
    EXPECT_EQ(unit->si_name, entry.si_unit) << entry.name;
  }
}

TEST(Catalogue, KnowsThatTheInsertionIsPublishedInMetresTimesDegreesPerRadian) {
  const CatalogueEntry& insertion = catalogue()[catalogue_index(RavenField::kJpos, 2)];
  EXPECT_EQ(insertion.name, "jpos.insertion");
  EXPECT_EQ(insertion.si_unit, "m");
  EXPECT_NEAR(22.918 * find_unit(insertion.message_unit)->to_si, 0.400, 1e-4);
}

}  // namespace
}  // namespace ravencal::core
