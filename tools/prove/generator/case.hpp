// SPDX-License-Identifier: Apache-2.0
//
// Sealed cases: the concealed effects of case N of a seed, and its files. The mix repeats every
// twenty cases: 6 with nothing left out, 7 with one effect, 3 with two, 2 outside of the
// vocabulary, 2 with a parameter out of tolerance and nothing else. Cases without effects have a
// decoy: the plant lacks a kind of effect that the truth does not have either, so that a gap in the
// plant reveals nothing.
#pragma once

#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "prove/generator/subject.hpp"
#include "prove/generator/world.hpp"

namespace ravencal::prove {

enum class CaseKind { kControl, kSingle, kPair, kOutside, kParameter };
std::string_view word_of(CaseKind kind);

/// A nominal parameter that is out of its tolerance: the first by which the plant states `kind`.
struct OffParameter {
  const SubjectKind* kind = nullptr;
  std::size_t joint = 0;
  double factor = 1.0;  ///< truth over plant
};

struct CaseOptions {
  std::uint64_t seed = 1;
  double duration_s = 240.0;  ///< of the recording
  double held_out_s = 90.0;   ///< of the one whose figures count
  WorldChoice world = WorldChoice::kOwn;
};

struct CaseDesign {
  int number = 0;
  CaseKind kind = CaseKind::kControl;
  const World* world = nullptr;   ///< of its laws; lives as long as the program
  NominalRobot nominal;           ///< what plant.toml says
  NominalRobot truth;             ///< the same, off within tolerances
  std::vector<Subject> subjects;  ///< amplitude 0: a decoy
  std::optional<OffParameter> off;
  Session base;  ///< truth with noise, without the subjects
  double held_out_s = 90.0;
  std::uint64_t motion_seed = 1, noise_seed = 1, held_out_seed = 1;
};

CaseDesign draw_case(int number, const CaseOptions& options);
/// One effect of the vocabulary, each as likely, of the largest size that cases have. Another
/// `number` is another draw of the seed.
CaseDesign draw_gross_case(int number, const CaseOptions& options);
/// The same case with its subjects replaced by `kind`, `rms` over the floor (leak test, tests).
CaseDesign draw_case_with(const SubjectKind& kind, double over_floor, int number,
                          const CaseOptions& options);

/// The truth with all subjects, or without number `without`.
Session session_of(const CaseDesign& design, std::optional<std::size_t> without = std::nullopt);

struct CaseFiles {
  record::Recording recording, held_out;
  std::string plant;
  std::string manifest;  ///< JSON: what is hidden, with measured sizes and floors
};
core::Result<CaseFiles> make_case(const CaseDesign& design, const std::function<bool()>& look);

}  // namespace ravencal::prove
