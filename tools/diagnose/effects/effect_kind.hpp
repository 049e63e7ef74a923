// SPDX-License-Identifier: Apache-2.0
//
// An effect of the vocabulary: everything that diagnose knows of it, whatever a recording shows.
// One object per id, in the file of that id; registry.cpp lists them. Other rooms ask for traits
// and never for an id. How to add one: README.md of this folder's parent.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "diagnose/effects/plant_values.hpp"
#include "diagnose/findings/effect_words.hpp"
#include "diagnose/series/series.hpp"
#include "physics/drive_model.hpp"

namespace ravencal::diagnose {

class EffectForm;
class NominalBuilder;
struct Nominal;
using Forms = std::vector<std::shared_ptr<const EffectForm>>;

enum class Friction {
  kNone,
  kDry,          ///< of the drive, the same at any speed and load
  kBehindCable,  ///< of the joint; the cable's wind-up holds against it
  kOnset,        ///< how dry friction turns after a reversal
  kFall,         ///< how dry friction falls with speed
  kByLoad,
  kBySpeed,
  kUneven,  ///< differs between the directions
};

/// A load that follows from posture.
enum class Weight {
  kNone,
  kOfLinks,
  kOnTool,  ///< one mass, felt by every joint of the arm
};

/// The number of the cable (physics/cable_replay.hpp) that an effect adds to.
enum class CablePart { kNone, kSpring, kGap, kStrands, kCreep, kFriction, kWeight };

struct Traits {
  Origin origin = Origin::kItself;
  Abscissa abscissa = Abscissa::kPosition;
  Probe probes = Probe::kNone;
  /// One line for the page. Empty: physics/effects/effect_spec.hpp has it.
  std::string_view sentence{};
  /// Word of the stage where it enters, where positions that are compared show it elsewhere.
  std::string_view enters_at{};
  Friction friction = Friction::kNone;
  Weight weight = Weight::kNone;
  CablePart cable = CablePart::kNone;
  bool follows_joint = false;  ///< its loop follows the joint wherever other joints move it
  bool moves_joint = false;    ///< with a source: what another joint adds to this one's motion
  bool constant = false;       ///< constant of a position between two homings
  bool step = false;           ///< happens at one moment, found as a step and by no form
};

/// A number of the drive that runs free, and the parameter of the report that it is.
struct DriveParameter {
  physics::DriveField field;
  std::string_view parameter;
  bool positive = true;   ///< else signed
  bool vanishes = false;  ///< at zero the drive is without the effect
};

/// What a form is made for.
struct FormContext {
  const Series& series;
  const Nominal& nominal;               ///< outlives the form
  const Eigen::VectorXd& further_load;  ///< effort of a load found beside the plant's; may be empty
};

class EffectKind {
 public:
  EffectKind(std::string_view id, Stage stage, Traits traits)
      : id_(id), stage_(stage), traits_(traits) {}
  virtual ~EffectKind() = default;
  EffectKind(const EffectKind&) = delete;
  EffectKind& operator=(const EffectKind&) = delete;

  [[nodiscard]] const std::string& id() const { return id_; }
  /// The stage in which the vocabulary has it.
  [[nodiscard]] Stage stage() const { return stage_; }
  [[nodiscard]] const Traits& traits() const { return traits_; }
  /// What it does, in plain words.
  [[nodiscard]] std::string_view sentence() const;

  /// Adds the shapes in which this series may show the effect, if it may.
  virtual void add_forms(const FormContext&, Forms&) const {}
  /// Adds what the plant's own effect of this id does to the residual, and the numbers of it that
  /// may be off.
  virtual void predict(NominalBuilder&) const {}
  /// What the plant's effect of this id must be for that finding; empty if `simulate` has no such
  /// effect, or the finding does not fix all that it needs. `joint`: as the plant has it.
  [[nodiscard]] virtual PlantValues plant_values(const NamedEffect&, const physics::Joint&) const {
    return {};
  }
  /// Writes the finding into the improved plant; false if a plant has no place for it.
  virtual bool improve(physics::Plant& improved, const PlantFinding& finding) const;
  /// Afterwards, when `improved` has every other number.
  virtual void settle(physics::Plant&, const PlantFinding&) const {}
  /// True if a number that moved within its tolerance belongs into the improved plant.
  [[nodiscard]] virtual bool refits(const physics::Joint&) const { return true; }
  /// Numbers of the drive's free run that belong to the effect.
  [[nodiscard]] virtual std::span<const DriveParameter> drive_parameters() const { return {}; }

 private:
  const std::string id_;
  const Stage stage_;
  const Traits traits_;
};

/// The vocabulary, in its order.
std::span<const EffectKind* const> effect_kinds();
/// That of an id of the vocabulary; "unknown" for any other.
const EffectKind& effect_kind(std::string_view id);
inline const Traits& traits_of(std::string_view id) { return effect_kind(id).traits(); }

/// Friction that a joint at rest need not carry.
inline bool settles_at_rest(Friction friction) {
  return friction != Friction::kNone && friction != Friction::kBySpeed &&
         friction != Friction::kUneven;
}

}  // namespace ravencal::diagnose
