// SPDX-License-Identifier: Apache-2.0
#include "choice/sessions.hpp"

#include <algorithm>
#include <cmath>

#include "choice/input_selection.hpp"
#include "core/students_t.hpp"

namespace ravencal::choice {
namespace {

void set_to(const std::vector<int>& sessions, const std::vector<Eigen::Index>& known,
            JointRows& rows) {
  rows.session.clear();
  for (const Eigen::Index row : known)
    rows.session.push_back(sessions[static_cast<std::size_t>(row)]);
  rows.sessions = 1 + *std::max_element(rows.session.begin(), rows.session.end());
}

/// Stretches of a session whose means are compared: long, because neighbours resemble each other.
constexpr Eigen::Index kStretches = 8;

/// Standard error of the mean of one session's rows, SI.
double constant_error(const std::vector<double>& left) {
  const auto rows = static_cast<Eigen::Index>(left.size());
  const Eigen::Map<const Eigen::VectorXd> values(left.data(), rows);
  std::vector<double> means;
  for (Eigen::Index k = 0; k < kStretches; ++k) {
    const Eigen::Index begin = k * rows / kStretches;
    const Eigen::Index count = (k + 1) * rows / kStretches - begin;
    if (count > 0) means.push_back(values.segment(begin, count).mean());
  }
  return standard_error(means);
}

}  // namespace

std::vector<double> homing_constants(const std::vector<double>& constants,
                                     const Eigen::VectorXd& left, const JointRows& rows) {
  std::vector<std::vector<double>> of_session(static_cast<std::size_t>(rows.sessions));
  for (Eigen::Index row = 0; row < left.size(); ++row) {
    const int session = rows.session[static_cast<std::size_t>(row)];
    of_session[static_cast<std::size_t>(session)].push_back(left[row]);
  }
  std::erase_if(of_session, [](const std::vector<double>& values) { return values.empty(); });
  struct Known {
    double constant;
    double error;
  };
  std::vector<Known> known;
  for (std::size_t s = 0; s < constants.size(); ++s)
    known.push_back({constants[s], constant_error(of_session[s])});
  std::sort(known.begin(), known.end(),
            [](const Known& a, const Known& b) { return a.constant < b.constant; });
  const double certain = core::students_t_975(static_cast<double>(kStretches - 1));
  std::vector<double> homings;
  for (auto first = known.begin(); first != known.end();) {
    const auto next = std::find_if(first, known.end(), [&](const Known& other) {
      return other.constant - first->constant > certain * std::hypot(first->error, other.error);
    });
    double sum = 0.0;
    for (auto one = first; one != next; ++one) sum += one->constant;
    homings.push_back(sum / static_cast<double>(next - first));
    first = next;
  }
  return homings;
}

void set_sessions(SessionRule rule, const Rows& all, const std::vector<Eigen::Index>& known,
                  const std::vector<Eigen::Index>& columns, JointRows& rows) {
  if (rule == SessionRule::kNone)
    return set_to(std::vector<int>(all.session.size(), 0), known, rows);
  if (rule == SessionRule::kRecording) return set_to(all.recording, known, rows);
  set_to(all.session, known, rows);
  if (all.own_session == all.session || !rows.held_out.by_recording) return;
  const std::vector<double> shared = probe(columns, rows, UnseenConstant::kMean);
  set_to(all.own_session, known, rows);
  const std::vector<double> own = probe(columns, rows, UnseenConstant::kMean);
  if (simplest_of_best({shared, own}) == 0) set_to(all.session, known, rows);
}

}  // namespace ravencal::choice
