// SPDX-License-Identifier: Apache-2.0
#include "study/job_store.hpp"

#include <fmt/format.h>

#include <exception>
#include <nlohmann/json.hpp>

#include "core/fnv1a.hpp"
#include "core/json_text.hpp"
#include "core/whole_file.hpp"

namespace ravencal::study {
namespace {

using Json = nlohmann::ordered_json;

constexpr unsigned kJobSchema = 1;

}  // namespace

/// Names a description of a few hundred bytes; results carry it in full.
std::string key_of(std::string_view description) {
  return fmt::format("{:016x}", core::fnv1a(description));
}

std::filesystem::path result_path(const std::filesystem::path& folder, std::string_view key) {
  return folder / "jobs" / fmt::format("{}.json", key);
}

core::Status keep_result(const std::filesystem::path& folder, const std::string& description,
                         Json result) {
  result["schema"] = kJobSchema;
  result["job"] = description;
  const std::filesystem::path path = result_path(folder, key_of(description));
  std::error_code error;  // of a folder that cannot be made: the file's own error says it
  std::filesystem::create_directories(path.parent_path(), error);
  // A requeued job may run while the earlier process still writes: each has a partial file of its
  // own.
  return core::write_whole_file(path, result.dump() + "\n");
}

core::Result<bool> take_result(const std::filesystem::path& folder, const std::string& description,
                               const std::function<void(const Json&)>& take) {
  const std::filesystem::path path = result_path(folder, key_of(description));
  std::error_code missing;
  if (!std::filesystem::exists(path, missing)) return false;
  RAVENCAL_ASSIGN_OR_RETURN(const std::string text, core::read_whole_file(path));
  const auto refused = [&](const std::string& why) {
    return core::data_error(fmt::format(
        "{}: is no result of this job: {}; remove it and run the job again", path.string(), why));
  };
  const auto json = core::parse_json<Json>(text);
  if (!json.ok()) return refused(json.error().message);
  try {
    const JsonPlace whole(*json);
    if (whole["schema"].whole(0U) != kJobSchema) return refused("another version's result");
    if (whole["job"].text() != description) return refused("it is the result of another job");
    take(*json);
    return true;
  } catch (const std::exception& error) {
    return refused(error.what());
  }
}

Json json_of(const ErrorBlocks& blocks) {
  return {{"peak", blocks.peak},
          {"effective_samples", blocks.effective_samples},
          {"correlation_s", blocks.correlation_s},
          {"counts", blocks.counts},
          {"squares", blocks.squares}};
}

ErrorBlocks blocks_from(const JsonPlace& json) {
  ErrorBlocks blocks;
  blocks.peak = json["peak"].figure();
  blocks.effective_samples = json["effective_samples"].figure();
  blocks.correlation_s = json["correlation_s"].figure();
  for (const JsonPlace& count : json["counts"].some()) {
    blocks.counts.push_back(count.whole<std::uint32_t>());
  }
  for (const JsonPlace& square : json["squares"].some()) blocks.squares.push_back(square.figure());
  if (blocks.counts.size() != blocks.squares.size()) {
    json["squares"].refuse(fmt::format("{} sums, as many as counts", blocks.counts.size()));
  }
  return blocks;
}

}  // namespace ravencal::study
