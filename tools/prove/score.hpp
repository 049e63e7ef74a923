// SPDX-License-Identifier: Apache-2.0
//
// Scores one opened case: compares the concealed effects with the tool's report. Its only input is
// the manifest and the verdict (proof.hpp).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "prove/proof.hpp"

namespace ravencal::prove {

/// A name given by the tool.
struct Name {
  std::string id, joint, stage;
  std::vector<std::string> ambiguous_with{};
  bool parameter = false;               ///< "out of tolerance", no physics
  double gain = 0.0;                    ///< share of the squared held-out error that it takes
  std::optional<double> probability{};  ///< that the report gives it
  bool hidden = false;                  ///< it was there, at that joint
  bool look_alike = false;              ///< what was there is among `ambiguous_with`
};

/// Result for one hidden effect.
struct SubjectScore {
  std::string id, joint, stage;
  bool outside = false, testable = false;
  double size_over_floor = 0.0;
  std::string imitated_by;      ///< the other name that fits best
  double own_over_floor = 0.0;  ///< what that leaves of the effect
  bool named = false;           ///< the right id at the right joint
  bool in_a_set = false;        ///< or among what a name was not told apart from
  bool joint_hit = false, stage_hit = false;
  bool flagged_here = false;                       ///< something without a name at this joint
  std::optional<double> overlap, parameter_error;  ///< interval IoU; relative
  std::optional<bool> covered;                     ///< the truth lies in ci95
  std::optional<bool> limit_kept;  ///< silent, and the effect was below the printed limit
  std::optional<double> removed;   ///< share of the excess gone on the held-out run
};

/// A baseline on the same case.
struct BaselineScore {
  std::string method;
  bool names = true;  ///< false: a black box
  int named = 0;      ///< ids at joints
  int right = 0;      ///< hidden effects among them
  std::optional<double> removed;
};

struct CaseScore {
  int number = 0;
  std::string track, kind, robot, motion, verdict, text;
  std::string world;  ///< what made the recording: a simulator, or "recorded" for a real one
  std::string laws;   ///< world of the generator: "own" or "other"
  bool excited = true;
  bool failed = false;  ///< no report
  double generate_s = 0.0, diagnose_s = 0.0;
  std::vector<Name> names;
  bool alarm = false;    ///< anything found, or no report at all
  bool flagged = false;  ///< something left without a name
  bool physics = false;  ///< physics named
  int physics_names = 0;
  bool top1 = false;    ///< the strongest name is right
  std::string top1_id;  ///< or "silent", "unknown", "parameter"
  int set_size = 0;     ///< of the strongest name
  bool exact = false;   ///< physics named = hidden
  bool parameter_found = false;
  std::vector<SubjectScore> subjects;
  std::vector<BaselineScore> baselines;
};

/// Errors: kData if the manifest is no manifest.
core::Result<CaseScore> score_case(const OpenedCase& opened);

}  // namespace ravencal::prove
