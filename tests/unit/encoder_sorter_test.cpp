// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <vector>

#include "quadrature_reader/sources/edge_sorter.hpp"

namespace ravencal::quadrature_reader {
namespace {

constexpr std::int64_t kHorizon = 1000;

Reading edge(std::int64_t t_ns, Line line) {
  return {t_ns, 1, 0, ReadingKind::kEdge, line, Fault::kNone};
}

std::vector<Reading> released(EdgeSorter& sorter, std::int64_t now_ns) {
  std::vector<Reading> out;
  sorter.release(now_ns, out);
  EXPECT_EQ(out.back().kind, ReadingKind::kAlive);
  EXPECT_EQ(out.back().t_ns, now_ns - kHorizon);
  out.pop_back();
  return out;
}

TEST(EdgeSorter, BringsTheQueuesOfTwoLinesIntoOneOrder) {
  EdgeSorter sorter(kHorizon);
  for (const std::int64_t t : {100, 300, 500}) sorter.add_edge(edge(t, Line::kA));
  for (const std::int64_t t : {200, 400, 600}) sorter.add_edge(edge(t, Line::kB));
  const auto out = released(sorter, 10'000);
  ASSERT_EQ(out.size(), 6U);
  for (std::size_t i = 0; i < out.size(); ++i)
    EXPECT_EQ(out[i].t_ns, static_cast<std::int64_t>(100 * (i + 1)));
}

TEST(EdgeSorter, HoldsAnEdgeUntilItsNeighboursMustHaveArrived) {
  EdgeSorter sorter(kHorizon);
  sorter.add_edge(edge(5000, Line::kA));
  EXPECT_TRUE(released(sorter, 5500).empty());
  sorter.add_edge(edge(4900, Line::kB));
  const auto out = released(sorter, 6000);
  ASSERT_EQ(out.size(), 2U);
  EXPECT_EQ(out[0].t_ns, 4900);
}

TEST(EdgeSorter, CountsTheGapsOfTheSequenceNumberExactly) {
  EdgeSorter sorter(kHorizon);
  sorter.add_edge(edge(100, Line::kA), 1);
  sorter.add_edge(edge(300, Line::kB), 7);
  sorter.add_edge(edge(200, Line::kB), 2);
  const auto out = released(sorter, 10'000);
  ASSERT_EQ(out.size(), 4U);
  EXPECT_EQ(out[2].kind, ReadingKind::kLost);
  EXPECT_EQ(out[2].value, 4);
  EXPECT_TRUE(sorter.wants_levels(0));
}

TEST(EdgeSorter, LetsLevelsThroughOnlyWhereNoEdgeWasNear) {
  EdgeSorter sorter(kHorizon);
  sorter.add_levels(0, 1000, 2);
  sorter.add_edge(edge(1500, Line::kA));
  EXPECT_EQ(released(sorter, 10'000).size(), 1U) << "the edge withdraws the levels";
  sorter.add_levels(0, 1600, 3);
  EXPECT_TRUE(released(sorter, 20'000).empty()) << "too soon after the edge";
  sorter.add_levels(0, 30'000, 3);
  const auto out = released(sorter, 40'000);
  ASSERT_EQ(out.size(), 1U);
  EXPECT_EQ(out[0].kind, ReadingKind::kLevels);
  EXPECT_FALSE(sorter.wants_levels(0));
}

TEST(EdgeSorter, PutsALossAfterTheLastEdgeThatWasKept) {
  EdgeSorter sorter(kHorizon);
  sorter.add_edge(edge(100, Line::kA));
  sorter.add_loss(0, 100);
  sorter.add_edge(edge(900, Line::kA));
  const auto out = released(sorter, 10'000);
  ASSERT_EQ(out.size(), 3U);
  EXPECT_EQ(out[1].kind, ReadingKind::kLost);
}

}  // namespace
}  // namespace ravencal::quadrature_reader
