// SPDX-License-Identifier: Apache-2.0
#include "exchange/exported.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "core/known_words.hpp"
#include "core/units.hpp"
#include "record/recording_file.hpp"

namespace ravencal::exchange {

core::Result<record::Channel> exported_channel(std::string name, const std::string& unit,
                                               const std::string& role, std::string joint) {
  const auto known_unit = core::find_unit(unit);
  const auto known_role = record::role_from(role);
  if (!known_unit || known_unit->si_name != unit) {
    return core::data_error(
        fmt::format("channel '{}': unit '{}' is none that an export has", name, unit));
  }
  if (!known_role) {
    return core::data_error(fmt::format("channel '{}': unknown role '{}'{}", name, role,
                                        core::instead_of(role, record::role_names())));
  }
  return record::Channel{std::move(name), unit, *known_role, std::move(joint)};
}

core::Result<record::Recording> checked(record::Recording recording,
                                        const std::filesystem::path& path) {
  RAVENCAL_RETURN_IF_ERROR(record::check_channels(recording.channels, path));
  const auto& t_ns = recording.t_ns;
  const auto back = std::is_sorted_until(t_ns.begin(), t_ns.end());
  if (back != t_ns.end()) {
    return core::data_error(
        fmt::format("{}: t_ns runs backwards at row {}", path.string(), back - t_ns.begin()));
  }
  recording.source = path.string();
  recording.meta.erase("exported_by");  // of the file, not of the recording
  return recording;
}

}  // namespace ravencal::exchange
