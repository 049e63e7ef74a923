// SPDX-License-Identifier: Apache-2.0
//
// Which rows are of a joint at rest.
#include <gtest/gtest.h>

#include <vector>

#include "diagnose/series/rest.hpp"

namespace ravencal::diagnose {
namespace {

/// Speeds, and a command that stands still from `from` to `to`.
Series commanded(const std::vector<double>& speed, Eigen::Index from, Eigen::Index to,
                 Eigen::VectorXd& desired) {
  const auto rows = static_cast<Eigen::Index>(speed.size());
  Series s;
  s.stage = Stage::kDrive;
  s.t_s = Eigen::VectorXd::LinSpaced(rows, 0.0, 0.1 * static_cast<double>(rows - 1));
  s.recording.assign(speed.size(), 0);
  s.fresh.assign(speed.size(), 0);
  s.held_out.assign(speed.size(), 0);
  s.valid.assign(speed.size(), 1);
  s.motion.v = Eigen::Map<const Eigen::VectorXd>(speed.data(), rows);
  s.y = s.motion.q = Eigen::VectorXd::Zero(rows);
  for (Eigen::Index i = 1; i < rows; ++i) s.motion.q[i] = s.motion.q[i - 1] + 0.1 * s.motion.v[i];
  desired = s.motion.q;
  desired.segment(from, to - from).setConstant(desired[from]);
  return s;
}

TEST(RowsAtRest, AreThoseThatSettleUntilTheyHaveMovedOn) {
  std::vector<double> speed(100, 1.0);
  for (std::size_t i = 40; i < 60; ++i) speed[i] = 0.05;
  speed[60] = 0.06;
  Eigen::VectorXd desired;
  Series s = commanded(speed, 40, 60, desired);
  s.presliding = 0.003;  // forgotten after six of them, some after the command moves again
  const auto rest = rows_at_rest(s, desired);
  for (Eigen::Index i = 0; i < s.rows(); ++i)
    EXPECT_EQ(rest[static_cast<std::size_t>(i)] != 0, i >= 40 && i <= 60) << i;
}

TEST(RowsAtRest, AreNotThoseThatMoveSlowlyAsCommanded) {
  std::vector<double> speed(100, 1.0);
  for (std::size_t i = 40; i < 60; ++i) speed[i] = 0.05;
  Eigen::VectorXd desired;
  const Series s = commanded(speed, 0, 0, desired);
  for (const char rest : rows_at_rest(s, desired)) EXPECT_EQ(rest, 0);
  for (const char rest : rows_at_rest(s, {})) EXPECT_EQ(rest, 0);
}

}  // namespace
}  // namespace ravencal::diagnose
