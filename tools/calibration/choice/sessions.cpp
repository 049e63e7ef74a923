// SPDX-License-Identifier: Apache-2.0
#include "choice/sessions.hpp"

#include <algorithm>

#include "choice/input_selection.hpp"

namespace ravencal::choice {
namespace {

void set_to(const std::vector<int>& sessions, const std::vector<Eigen::Index>& known,
            JointRows& rows) {
  rows.session.clear();
  for (const Eigen::Index row : known)
    rows.session.push_back(sessions[static_cast<std::size_t>(row)]);
  rows.sessions = 1 + *std::max_element(rows.session.begin(), rows.session.end());
}

}  // namespace

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
