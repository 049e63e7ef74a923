// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <fstream>
#include <system_error>

#include "diagnose/report/write_report.hpp"

namespace ravencal::diagnose {
namespace {

core::Status write_whole(const std::filesystem::path& path, const std::string& text) {
  const std::filesystem::path partial = path.string() + ".partial";
  std::ofstream file(partial, std::ios::binary);
  file << text;
  file.close();
  std::error_code error;
  if (file) std::filesystem::rename(partial, path, error);
  if (!file || error) {
    std::filesystem::remove(partial, error);
    return core::Error{core::ErrorCode::kIo, fmt::format("{}: cannot be written", path.string())};
  }
  return {};
}

}  // namespace

core::Status write_report(const Report& report, const physics::Plant& plant,
                          const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) {
    return core::Error{core::ErrorCode::kIo,
                       fmt::format("{}: cannot be made: {}", folder.string(), error.message())};
  }
  RAVENCAL_ASSIGN_OR_RETURN(const std::string improved, improved_plant(plant, report));
  RAVENCAL_RETURN_IF_ERROR(write_whole(folder / "report.json", report_json(report)));
  RAVENCAL_RETURN_IF_ERROR(write_whole(folder / "report.html", report_html(report)));
  return write_whole(folder / "plant_improved.toml", improved);
}

}  // namespace ravencal::diagnose
