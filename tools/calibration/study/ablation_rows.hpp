// SPDX-License-Identifier: Apache-2.0
//
// The ablations as data: the paper's seven feature groups, their unions, the joints, and the ways
// to change a feature at test time (arXiv 2302.04999 and its notebooks; journal version
// doi 10.1109/TASE.2025.3584757).
#pragma once

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

/// Sets that are removed in turn: the seven groups, their unions, and joints 1 to 7.
std::span<const FeatureSet> ablated_sets();
/// Sets that the re-homing study removes from all features, one by one and together.
std::span<const FeatureSet> homing_sets();

/// Ids that findings and tables refer to.
inline constexpr std::string_view kNoAblation = "none";
inline constexpr std::string_view kAllPoses = "all_poses";
inline constexpr std::string_view kMotorSidePoses = "joint_and_motor_pose";
inline constexpr std::string_view kAllFeatures = "all";
inline constexpr std::string_view kNoEncoder = "no_encoder";
inline constexpr std::string_view kOnlyEncoder = "only_encoder";

/// How a feature is spoilt at test time. Uniform noise is drawn anew for each sample and column;
/// mean, deviation, least and greatest value are those of the training rows.
enum class Noise {
  kNone,
  kDeviation,  ///< + U(-deviation, +deviation): the paper's inaccurate ablation, its 'stdv'
  kMean,       ///< + U(-|mean|, +|mean|)
  kRange,      ///< + U(least, greatest)
  kZero,       ///< = 0
  kFlip,       ///< x -1, its 'temp'
  kTriple      ///< x 3
};
std::string_view name_of(Noise noise);
std::string_view title_of(Noise noise);

/// One test of a trained network. Id: "none" or "<noise>:<set>".
struct Variant {
  std::string id;
  Noise noise = Noise::kNone;
  std::vector<std::string> terms;  ///< features that are spoilt
};

/// Which tests a network undergoes.
enum class TestSet {
  kPlain,    ///< as it is
  kFull,     ///< and all that the inaccurate and the torque ablation spoil
  kEncoder,  ///< and with inaccurate encoder features
};
std::string_view name_of(TestSet set);
std::vector<Variant> variants_of(TestSet set);

/// The torque ablation's sets (drive torque, motor current, both) and treatments.
std::span<const FeatureSet> torque_sets();
inline constexpr Noise kTorqueNoises[] = {Noise::kDeviation, Noise::kFlip, Noise::kTriple};
/// The kinds of noise beyond kDeviation, applied to the seven groups and all poses.
inline constexpr Noise kOtherNoises[] = {Noise::kMean, Noise::kRange, Noise::kZero, Noise::kFlip};
/// The first sets of ablated_sets(), which kOtherNoises spoil.
std::span<const FeatureSet> grouped_sets();

std::string variant_id(Noise noise, std::string_view set);

}  // namespace ravencal::study
