// SPDX-License-Identifier: Apache-2.0
#include "diagnose/report/write_report.hpp"

#include <fmt/format.h>

#include <system_error>

#include "core/whole_file.hpp"

namespace ravencal::diagnose {

core::Status write_report(const Report& report, const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) {
    return core::Error{core::ErrorCode::kIo,
                       fmt::format("{}: cannot be made: {}", folder.string(), error.message())};
  }
  RAVENCAL_RETURN_IF_ERROR(core::write_whole_file(folder / "report.json", report_json(report)));
  RAVENCAL_RETURN_IF_ERROR(core::write_whole_file(folder / "report.html", report_html(report)));
  return core::write_whole_file(folder / "plant_improved.toml", improved_text(report));
}

}  // namespace ravencal::diagnose
