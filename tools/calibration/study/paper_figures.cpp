// SPDX-License-Identifier: Apache-2.0
#include "study/paper_figures.hpp"

#include <algorithm>
#include <array>
#include <limits>

#include "study/ablation_rows.hpp"
#include "study/job.hpp"

namespace ravencal::study {
namespace {

/// RMSE and peak of joint 1 [deg], joint 2 [deg] and joint 3 [mm], in this order.
struct Entry {
  PaperTable table;
  std::string_view condition;
  std::string_view row;
  std::array<double, 6> figures;
};

// clang-format off
constexpr Entry kEntries[] = {
    {PaperTable::kRemoval, kUnloaded, kRaw, {2.1150, 3.2501, 7.9019, 10.8255, 11.6895, 12.9004}},
    {PaperTable::kRemoval, kLoaded, kRaw, {2.1787, 3.3802, 7.9144, 10.8637, 11.2281, 12.3236}},
    {PaperTable::kRemoval, kUnloaded, kBias, {0.9324, 1.7420, 1.0990, 3.1237, 0.5266, 1.2192}},
    {PaperTable::kRemoval, kLoaded, kBias, {1.0158, 1.9028, 1.1147, 3.1945, 0.5034, 1.1180}},
    {PaperTable::kRemoval, kUnloaded, kNoAblation, {0.3003, 0.5902, 0.2888, 1.2669, 0.1565, 0.6409}},
    {PaperTable::kRemoval, kLoaded, kNoAblation, {0.4456, 0.7721, 0.3052, 1.4299, 0.1900, 0.7513}},
    {PaperTable::kRemoval, kUnloaded, kOperatingStatus, {0.3278, 0.6119, 0.3331, 1.4652, 0.1556, 0.5693}},
    {PaperTable::kRemoval, kLoaded, kOperatingStatus, {0.4602, 0.7792, 0.3709, 1.5928, 0.1765, 0.7587}},
    {PaperTable::kRemoval, kUnloaded, kJointPoses, {0.3222, 0.6414, 0.3050, 1.4229, 0.1268, 0.5153}},
    {PaperTable::kRemoval, kLoaded, kJointPoses, {0.3781, 0.7750, 0.3026, 1.4209, 0.1700, 0.6823}},
    {PaperTable::kRemoval, kUnloaded, kEndEffector, {0.3236, 0.5842, 0.2833, 1.2922, 0.1538, 0.6330}},
    {PaperTable::kRemoval, kLoaded, kEndEffector, {0.4587, 0.7464, 0.2860, 1.3915, 0.1883, 0.7539}},
    {PaperTable::kRemoval, kUnloaded, kAllPoses, {0.8645, 3.8587, 1.2448, 3.8877, 0.2539, 1.1198}},
    {PaperTable::kRemoval, kLoaded, kAllPoses, {1.1766, 5.0998, 1.8213, 5.6556, 0.2852, 1.1605}},
    {PaperTable::kRemoval, kUnloaded, kTorques, {0.2968, 0.5833, 0.4877, 1.9435, 0.3451, 1.2021}},
    {PaperTable::kRemoval, kLoaded, kTorques, {0.4196, 0.7551, 0.5170, 2.0554, 0.3533, 1.2582}},
    {PaperTable::kRemoval, kUnloaded, "velocity", {0.3218, 0.6028, 0.3456, 1.4280, 0.1642, 0.6710}},
    {PaperTable::kRemoval, kLoaded, "velocity", {0.4566, 0.7682, 0.3840, 1.6096, 0.2085, 0.8035}},
    {PaperTable::kRemoval, kUnloaded, "jacobian", {0.3172, 0.5977, 0.2944, 1.3160, 0.1529, 0.6272}},
    {PaperTable::kRemoval, kLoaded, "jacobian", {0.4478, 0.7680, 0.3294, 1.5004, 0.1944, 0.7548}},
    {PaperTable::kRemoval, kUnloaded, "joint_1", {0.3439, 0.7868, 0.3019, 1.3246, 0.1470, 0.6352}},
    {PaperTable::kRemoval, kLoaded, "joint_1", {0.5195, 1.0623, 0.3320, 1.4378, 0.1718, 0.7415}},
    {PaperTable::kRemoval, kUnloaded, "joint_2", {0.3548, 0.6628, 1.3047, 3.9894, 0.2833, 0.9104}},
    {PaperTable::kRemoval, kLoaded, "joint_2", {0.5323, 0.8727, 1.4744, 4.2773, 0.3752, 1.2024}},
    {PaperTable::kRemoval, kUnloaded, "joint_3", {0.3307, 0.5934, 0.3461, 1.4426, 0.1684, 0.6671}},
    {PaperTable::kRemoval, kLoaded, "joint_3", {0.4806, 0.7712, 0.3476, 1.5084, 0.2033, 0.7712}},
    {PaperTable::kInaccurate, kUnloaded, kRaw, {2.1150, 3.2501, 7.9019, 10.8255, 11.6895, 12.9004}},
    {PaperTable::kInaccurate, kLoaded, kRaw, {2.1787, 3.3802, 7.9144, 10.8637, 11.2281, 12.3236}},
    {PaperTable::kInaccurate, kUnloaded, kBias, {0.9324, 1.7420, 1.0990, 3.1237, 0.5266, 1.2192}},
    {PaperTable::kInaccurate, kLoaded, kBias, {1.0158, 1.9028, 1.1147, 3.1945, 0.5034, 1.1180}},
    {PaperTable::kInaccurate, kUnloaded, kNoAblation, {0.3003, 0.5902, 0.2888, 1.2669, 0.1565, 0.6409}},
    {PaperTable::kInaccurate, kLoaded, kNoAblation, {0.4456, 0.7721, 0.3052, 1.4299, 0.1900, 0.7513}},
    {PaperTable::kInaccurate, kUnloaded, kOperatingStatus, {0.3173, 0.6023, 0.3288, 1.4112, 0.1533, 0.6283}},
    {PaperTable::kInaccurate, kLoaded, kOperatingStatus, {0.4632, 0.7848, 0.3777, 1.5940, 0.1873, 0.7327}},
    {PaperTable::kInaccurate, kUnloaded, kJointPoses, {6.7101, 12.2552, 8.4935, 15.9875, 0.1566, 0.6949}},
    {PaperTable::kInaccurate, kLoaded, kJointPoses, {6.7082, 12.5252, 8.7467, 16.6830, 0.1919, 0.8043}},
    {PaperTable::kInaccurate, kUnloaded, kEndEffector, {0.3273, 0.7820, 0.3515, 1.7050, 0.1559, 0.6716}},
    {PaperTable::kInaccurate, kLoaded, kEndEffector, {0.4716, 0.9822, 0.3967, 1.8873, 0.1886, 0.7529}},
    {PaperTable::kInaccurate, kUnloaded, kAllPoses, {6.7187, 12.3596, 8.5073, 16.1375, 0.1593, 0.7380}},
    {PaperTable::kInaccurate, kLoaded, kAllPoses, {6.7015, 12.5493, 8.7489, 16.7808, 0.1939, 0.8142}},
    {PaperTable::kInaccurate, kUnloaded, kTorques, {0.3163, 0.6227, 0.3425, 1.5971, 0.1635, 0.7677}},
    {PaperTable::kInaccurate, kLoaded, kTorques, {0.4656, 0.8259, 0.3901, 1.7438, 0.1952, 0.8456}},
    {PaperTable::kInaccurate, kUnloaded, "velocity", {0.3143, 0.6043, 0.3299, 1.4404, 0.1534, 0.6328}},
    {PaperTable::kInaccurate, kLoaded, "velocity", {0.4620, 0.7879, 0.3787, 1.6168, 0.1873, 0.7386}},
    {PaperTable::kInaccurate, kUnloaded, "jacobian", {0.3170, 0.6040, 0.3290, 1.4140, 0.1534, 0.6321}},
    {PaperTable::kInaccurate, kLoaded, "jacobian", {0.4625, 0.7912, 0.3804, 1.5996, 0.1871, 0.7259}},
    {PaperTable::kInaccurate, kUnloaded, "joint_1", {6.7116, 12.2601, 0.3297, 1.4271, 0.1536, 0.6349}},
    {PaperTable::kInaccurate, kLoaded, "joint_1", {6.7102, 12.5001, 0.3798, 1.6142, 0.1875, 0.7520}},
    {PaperTable::kInaccurate, kUnloaded, "joint_2", {0.3159, 0.6085, 8.5001, 16.0838, 0.1564, 0.7047}},
    {PaperTable::kInaccurate, kLoaded, "joint_2", {0.4623, 0.7920, 8.7420, 16.6404, 0.1921, 0.8032}},
    {PaperTable::kInaccurate, kUnloaded, "joint_3", {0.3160, 0.6054, 0.3305, 1.4392, 0.1562, 0.6754}},
    {PaperTable::kInaccurate, kLoaded, "joint_3", {0.4628, 0.7890, 0.3799, 1.6141, 0.1893, 0.7620}},
    {PaperTable::kTorque, kUnloaded, kNoAblation, {0.3003, 0.5902, 0.2888, 1.2669, 0.1565, 0.6409}},
    {PaperTable::kTorque, kUnloaded, "std", {0.3163, 0.6227, 0.3425, 1.5971, 0.1635, 0.7677}},
    {PaperTable::kTorque, kUnloaded, "flip", {0.3881, 0.7614, 0.6034, 1.7910, 0.8395, 1.3886}},
    {PaperTable::kTorque, kUnloaded, "triple", {0.2944, 0.6077, 0.4873, 1.4329, 0.2174, 0.6940}},
    {PaperTable::kTorque, kLoaded, kNoAblation, {0.4456, 0.7721, 0.3052, 1.4299, 0.1900, 0.7513}},
    {PaperTable::kTorque, kLoaded, "std", {0.4656, 0.8259, 0.3901, 1.7438, 0.1952, 0.8456}},
    {PaperTable::kTorque, kLoaded, "flip", {0.5285, 0.9855, 0.5946, 1.7524, 0.7608, 1.4761}},
    {PaperTable::kTorque, kLoaded, "triple", {0.4477, 0.8249, 0.5018, 1.7231, 0.2186, 0.6975}},
    {PaperTable::kHoming, kHomedOnce, kAllFeatures, {0.7554, 1.6125, 1.1813, 3.5517, 0.5201, 1.4590}},
    {PaperTable::kHoming, kHomedOnce, kNoEncoder, {0.1762, 0.5628, 0.4694, 1.7209, 0.1693, 0.6448}},
    {PaperTable::kHoming, kRehomed, kAllFeatures, {0.1620, 0.5526, 0.3198, 1.2084, 0.1750, 0.6181}},
    {PaperTable::kHoming, kRehomed, kInaccurateEncoder, {0.1532, 0.5029, 0.3193, 1.2600, 0.1748, 0.5956}},
    {PaperTable::kHoming, kRehomed, kOnlyEncoder, {0.1477, 0.4372, 0.2907, 1.3735, 0.1722, 0.6448}},
    {PaperTable::kHoming, kRehomed, kOnlyInaccurateEncoder, {0.4343, 1.2983, 0.6191, 2.4136, 0.2106, 0.8770}},
};
// clang-format on

}  // namespace

double paper_figure(PaperTable table, std::string_view condition, std::string_view row,
                    std::string_view joint, bool peak) {
  constexpr std::array<std::string_view, 3> kJoints = {"shoulder", "elbow", "insertion"};
  const auto place = std::find(kJoints.begin(), kJoints.end(), joint);
  const auto entry = std::find_if(std::begin(kEntries), std::end(kEntries), [&](const Entry& e) {
    return e.table == table && e.condition == condition && e.row == row;
  });
  if (place == kJoints.end() || entry == std::end(kEntries)) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  return entry->figures[2 * static_cast<std::size_t>(place - kJoints.begin()) + (peak ? 1U : 0U)];
}

}  // namespace ravencal::study
