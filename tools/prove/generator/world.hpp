// SPDX-License-Identifier: Apache-2.0
//
// Worlds: sets of laws that move the robot of a sealed case, behind one interface. Subjects, noise,
// recorder, plant and scoring do not depend on the world; WORLDS.md lists what differs.
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "prove/generator/nominal.hpp"

namespace ravencal::prove {

/// Form of a case's recordings.
struct RecordingForm {
  MotionKind motion = MotionKind::kSlow;
  double rate_hz = 100.0;
  double duration_s = 240.0, held_out_s = 90.0;
};

/// What is known of a case before its robot is drawn.
struct CaseNeeds {
  bool rich = false;        ///< slow motion does not excite what it hides
  bool controller = false;  ///< what it hides shows in the controller's law alone
  double duration_s = 240.0, held_out_s = 90.0;  ///< as asked for
};

struct World {
  std::string_view name;
  RecordingForm (*draw_form)(const CaseNeeds& needs, Random& random);
  /// Draws what the plant does not tell, and what it can tell of this world's controller.
  void (*draw_plant)(const CaseNeeds& needs, NominalRobot& nominal, Random& random);
  void (*draw_laws)(const NominalRobot& nominal, double duration_s, Session& session,
                    Random& random);
  /// Records the session. `look` is asked about once per simulated second. Errors: kUsage where it
  /// says false, kData where the integrator gives up.
  core::Result<record::Recording> (*run)(const Session& session, const SessionSeeds& seeds,
                                         const std::function<bool()>& look);
  /// Laws and integrator in words.
  std::string (*engine)(const Session& session);
};

/// LuGre, Bouc and Wen, SUNDIALS; PD servo.
const World& own_world();
/// Dahl, Iwan, Hertz, fixed steps; cascaded servo (other/laws.hpp).
const World& other_world();

/// Which world makes the cases; of both, they alternate by number.
enum class WorldChoice { kOwn, kOther, kBoth };
inline constexpr std::array<std::string_view, 3> kWorldWords = {"own", "other", "both"};
std::string_view word_of(WorldChoice choice);
std::optional<WorldChoice> world_choice(std::string_view word);
const World& world_of(WorldChoice choice, int number);

/// Errors as run_session().
core::Result<record::Recording> run_other_session(const Session& session, const SessionSeeds& seeds,
                                                  const std::function<bool()>& look);

}  // namespace ravencal::prove
