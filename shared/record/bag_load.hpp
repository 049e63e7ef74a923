// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "core/result.hpp"
#include "record/load.hpp"
#include "record/profile.hpp"
#include "record/recording.hpp"

namespace ravencal::record {

/// Reads a ROS 1 bag of raven_2/raven_state and external joint encoders (sensor_msgs/JointState:
/// shoulder rad, elbow rad, insertion m). Profile raven2-bag: one row per state at the stamp of its
/// header, channels as profile raven2's; the truth between two stamps is interpolated as it was
/// stamped, its transport delay still in it (`ravencal merge` takes that out). Profile
/// raven2-bag-truth: one row per message of the encoders. Errors name topic, message and remedy.
core::Result<Recording> load_bag(const std::filesystem::path& path, const Profile& profile,
                                 const LoadOptions& options);

/// Writes /ravenstate and, if the recording has a truth, /ext_jpos as such a bag. Importing it
/// again gives the same values, rounded as the messages round them (float32 and integers). Errors:
/// a channel of the message that the recording lacks; a lost integer; the disk. Nothing is left
/// behind on failure.
core::Status export_bag(const Recording& recording, const Profile& profile,
                        const std::filesystem::path& path);

}  // namespace ravencal::record
