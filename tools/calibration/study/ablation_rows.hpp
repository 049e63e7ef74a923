// SPDX-License-Identifier: Apache-2.0
//
// The ablations as data: the paper's seven feature groups, their unions, the joints, and the ways
// to change a feature at test time (arXiv 2302.04999 and its notebooks; journal version
// doi 10.1109/TASE.2025.3584757).
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace ravencal::study {

/// A set of features: terms of the --features grammar (model/feature_spec.hpp).
struct FeatureSet {
  std::string id;     ///< file-safe
  std::string title;  ///< as a table shows it
  std::vector<std::string> terms;
};

/// The rows of the paper's Tables II and III, in its order: seven groups and joints 1 to 3.
std::span<const FeatureSet> paper_sets();
/// The first of paper_sets(), which are no joint's.
std::span<const FeatureSet> grouped_sets();
/// paper_sets(), then parts of its groups, and joints 4 to 7.
std::span<const FeatureSet> ablated_sets();
/// Sets that the re-homing study removes from all features, one by one and together.
std::span<const FeatureSet> homing_sets();
/// Every pose but the encoders': what "only encoder" leaves out.
const FeatureSet& other_poses();

/// Ids that findings and tables refer to.
inline constexpr std::string_view kNoAblation = "none";
inline constexpr std::string_view kOperatingStatus = "time_and_state";
inline constexpr std::string_view kJointPoses = "joint_and_motor_pose";
inline constexpr std::string_view kEndEffector = "end_effector_pose";
inline constexpr std::string_view kAllPoses = "all_poses";
inline constexpr std::string_view kTorques = "torque_and_current";
inline constexpr std::string_view kAllFeatures = "all";
inline constexpr std::string_view kNoEncoder = "no_encoder";
inline constexpr std::string_view kOnlyEncoder = "only_encoder";
/// "joint_1" to "joint_7".
std::string joint_set(int joint);
bool is_joint_set(const FeatureSet& set);

/// How a feature is spoilt at test time. Uniform noise is drawn anew for each sample and column;
/// mean, deviation, least and greatest value are those of Settings::noise_from.
enum class Noise {
  kNone,
  kDeviation,  ///< + U(-deviation, +deviation): the paper's inaccurate ablation, its 'stdv'
  kMean,       ///< + U(-|mean| / 2, +|mean| / 2)
  kRange,      ///< + U(-range / 2, +range / 2), its 'min-max'
  kZero,       ///< = 0
  kFlip,       ///< x -1, its 'temp'
  kTriple      ///< x 3
};
std::string_view name_of(Noise noise);
std::string_view title_of(Noise noise);

/// Whose rows say how large noise is.
enum class NoiseFrom {
  kTest,     ///< the test's, as the authors' notebooks do
  kTraining  ///< the training's
};
std::string_view name_of(NoiseFrom rows);
std::optional<NoiseFrom> noise_from_name(std::string_view name);

/// Where noise goes.
enum class NoiseInto {
  kInputs,         ///< the network's inputs alone, as the paper's text says
  kBelievedAsWell  ///< and the believed angles that the correction is added to, as it was released
};

/// One test of a trained network. Id: "none", "<noise>:<set>" or "released:<set>".
struct Variant {
  std::string id;
  Noise noise = Noise::kNone;
  std::vector<std::string> terms;  ///< features that are spoilt
  NoiseInto into = NoiseInto::kInputs;
};

/// Which tests a network undergoes.
enum class TestSet {
  kPlain,    ///< as it is
  kPaper,    ///< and all that the paper's Tables III and IV spoil
  kFull,     ///< and the further sets, and the other kinds of noise
  kEncoder,  ///< as it is, and with inaccurate encoder features
};
std::string_view name_of(TestSet set);
std::vector<Variant> variants_of(TestSet set);

/// The torque ablation's sets (drive torque, motor current, both: the paper's) and treatments.
std::span<const FeatureSet> torque_sets();
inline constexpr Noise kTorqueNoises[] = {Noise::kDeviation, Noise::kFlip, Noise::kTriple};
/// The kinds of noise beyond kDeviation, applied to grouped_sets().
inline constexpr Noise kOtherNoises[] = {Noise::kMean, Noise::kRange, Noise::kZero, Noise::kFlip};

std::string variant_id(Noise noise, std::string_view set);
/// The test of a set as the authors' notebooks spoil it: where the set has believed angles of
/// joints 1 and 2, the noise is in these as well; elsewhere it is that of the inputs alone.
std::string released_id(std::string_view set);

}  // namespace ravencal::study
