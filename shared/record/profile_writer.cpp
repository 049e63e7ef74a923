// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <iterator>

#include "core/toml_table.hpp"
#include "record/profile.hpp"

namespace ravencal::record {

std::filesystem::path profile_beside(const std::filesystem::path& csv) {
  std::filesystem::path beside = csv;
  return beside += ".toml";
}

std::string profile_of(const Recording& recording) {
  using core::toml_text;
  std::string text =
      "# Which column of the CSV beside this file is which channel; `ravencal import` reads it.\n"
      "[source]\nformat = \"csv\"\ntime = \"t_s\"\n\n[meta]\n";
  auto out = std::back_inserter(text);
  for (const auto& [key, value] : recording.meta) {
    if (key == "format_version") continue;  // of the file that held it
    fmt::format_to(out, "{} = {}\n", core::toml_key(key), toml_text(value));
  }
  for (const Channel& channel : recording.channels) {
    fmt::format_to(out, "\n[[channel]]\nname = {}\ncolumn = {}\nunit = {}\nrole = {}\n",
                   toml_text(channel.name), toml_text(channel.name + "_" + channel.unit),
                   toml_text(channel.unit), toml_text(name_of(channel.role)));
    if (!channel.joint.empty()) fmt::format_to(out, "joint = {}\n", toml_text(channel.joint));
    text += "may_be_missing = true\n";
  }
  for (const Event& event : recording.events) {
    fmt::format_to(out, "\n[[event]]\nt_ns = {}\nkind = {}\ndetail = {}\n", event.t_ns,
                   toml_text(event.kind), toml_text(event.detail));
  }
  return text;
}

}  // namespace ravencal::record
