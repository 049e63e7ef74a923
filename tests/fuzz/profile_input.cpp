// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include "core/units.hpp"
#include "fuzz/inputs.hpp"
#include "record/profile_toml.hpp"

namespace ravencal::fuzz {

void try_profile(Bytes bytes) {
  const auto profile = record::parse_profile(text_of(bytes), "fuzz.toml");
  if (!read_or_words(profile, "fuzz.toml")) return;
  promise(!profile->channels.empty(), "a profile has channels");
  promise(profile->row_period_s > 0.0, "rows have a period");
  for (const auto& channel : profile->channels) {
    promise(!channel.channel.name.empty(), "a channel has a name");
    promise(std::isfinite(channel.scale) && channel.scale != 0.0, "no channel loses its values");
    promise(std::isfinite(channel.offset), "an offset is finite");
    promise(core::find_unit(channel.channel.unit).has_value(), "a channel has a unit");
  }
}

}  // namespace ravencal::fuzz
