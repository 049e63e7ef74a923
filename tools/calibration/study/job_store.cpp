// SPDX-License-Identifier: Apache-2.0
#include "study/job_store.hpp"

#include <fmt/format.h>

#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "core/whole_file.hpp"

namespace ravencal::study {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kJobSchema = 1;

}  // namespace

/// FNV-1a, 64 bits: names a description of a few hundred bytes; results carry it in full.
std::string key_of(std::string_view description) {
  std::uint64_t hash = 0xcbf29ce484222325ULL;
  for (const char c : description) {
    hash ^= static_cast<unsigned char>(c);
    hash *= 0x100000001b3ULL;
  }
  return fmt::format("{:016x}", hash);
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
  try {
    const Json json = Json::parse(text);
    if (json.at("schema") != kJobSchema) throw std::invalid_argument("another version's result");
    if (json.at("job") != description) {
      throw std::invalid_argument("it is the result of another job");
    }
    take(json);
    return true;
  } catch (const std::exception& error) {
    return core::Error{core::ErrorCode::kData,
                       fmt::format("{}: is no result of this job: {}; remove it and run the job "
                                   "again",
                                   path.string(), error.what())};
  }
}

Json json_of(const ErrorBlocks& blocks) {
  return {{"peak", blocks.peak},
          {"effective_samples", blocks.effective_samples},
          {"correlation_s", blocks.correlation_s},
          {"counts", blocks.counts},
          {"squares", blocks.squares}};
}

double number_or_infinite(const Json& json) {
  return json.is_null() ? std::numeric_limits<double>::infinity() : json.get<double>();
}

ErrorBlocks blocks_from(const Json& json) {
  ErrorBlocks blocks;
  blocks.peak = number_or_infinite(json.at("peak"));
  blocks.effective_samples = number_or_infinite(json.at("effective_samples"));
  blocks.correlation_s = number_or_infinite(json.at("correlation_s"));
  blocks.counts = json.at("counts").get<std::vector<std::uint32_t>>();
  for (const Json& square : json.at("squares"))
    blocks.squares.push_back(number_or_infinite(square));
  if (blocks.counts.size() != blocks.squares.size()) {
    throw std::invalid_argument("counts and squares differ in length");
  }
  return blocks;
}

}  // namespace ravencal::study
