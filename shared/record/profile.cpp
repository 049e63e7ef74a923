// SPDX-License-Identifier: Apache-2.0
#include "record/profile.hpp"

#include <fmt/format.h>

#include <filesystem>

#include "record/profile_builtin.hpp"
#include "record/profile_toml.hpp"

namespace ravencal::record {

core::Result<Profile> load_profile(std::string_view name_or_path, const ProfileOptions& options) {
  if (name_or_path == "raven2") return raven2_profile(options.arm);
  if (name_or_path == "raven2-bag") return raven2_bag_profile(options.arm);
  if (name_or_path == kBagTruthProfile) {
    RAVENCAL_ASSIGN_OR_RETURN(Profile profile, raven2_bag_profile(options.arm));
    profile.name = kBagTruthProfile;
    return profile;
  }
  if (name_or_path == "generic") return generic_profile();
  const std::filesystem::path path(name_or_path);
  std::error_code failure;
  if (std::filesystem::is_regular_file(path, failure)) return read_profile_file(path);
  return core::Error{
      core::ErrorCode::kUsage,
      fmt::format(
          "no profile '{}': give raven2, raven2-bag, raven2-bag-truth, generic or the path of a "
          "profile file (.toml)",
          name_or_path)};
}

}  // namespace ravencal::record
