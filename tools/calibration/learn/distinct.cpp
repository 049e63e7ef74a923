// SPDX-License-Identifier: Apache-2.0
#include "learn/distinct.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "learn/file_hash.hpp"

namespace ravencal::learn {
namespace {

/// Of a column's largest magnitude: a table keeps fewer digits than a recording has.
constexpr double kSameTruth = 1e-9;

/// Whether both columns move, and alike.
bool move_alike(const auto& one, const auto& other) {
  double largest = 0.0, apart = 0.0, least = INFINITY, greatest = -INFINITY;
  for (Eigen::Index row = 0; row < one.size(); ++row) {
    if (std::isfinite(one[row]) != std::isfinite(other[row])) return false;
    if (!std::isfinite(one[row])) continue;
    largest = std::max(largest, std::abs(one[row]));
    apart = std::max(apart, std::abs(one[row] - other[row]));
    least = std::min(least, one[row]);
    greatest = std::max(greatest, one[row]);
  }
  return least < greatest && apart <= kSameTruth * largest;
}

bool same_truths(const record::Recording& one, const record::Recording& other) {
  if (one.rows() != other.rows()) return false;
  bool any = false;
  for (std::size_t c = 0; c < one.channels.size(); ++c) {
    const record::Channel& channel = one.channels[c];
    if (channel.role != record::Role::kJointTruth) continue;
    const auto column = other.column(record::Role::kJointTruth, channel.joint);
    if (!column) continue;
    if (!move_alike(one.samples.col(static_cast<Eigen::Index>(c)), other.samples.col(*column)))
      return false;
    any = true;
  }
  return any;
}

}  // namespace

core::Status check_distinct(std::span<const std::string> training,
                            std::span<const std::string> validation) {
  std::map<std::string, std::string> path_of_hash;
  const auto add = [&](std::span<const std::string> paths, const char* what) -> core::Status {
    for (const std::string& path : paths) {
      RAVENCAL_ASSIGN_OR_RETURN(const std::string hash, sha256_of_file(path));
      const auto [other, is_new] = path_of_hash.emplace(hash, path);
      if (is_new) continue;
      return core::usage_error(
          fmt::format("{}: is given twice{}{}; give each recording once, and validate with "
                      "recordings that do not train",
                      path, what, other->second == path ? "" : ", as " + other->second));
    }
    return {};
  };
  RAVENCAL_RETURN_IF_ERROR(add(training, ""));
  return add(validation, ", for --validate as well");
}

core::Result<std::vector<HashedFile>> hashed(const std::vector<std::string>& paths) {
  std::vector<HashedFile> files;
  for (const std::string& path : paths) {
    RAVENCAL_ASSIGN_OR_RETURN(std::string hash, sha256_of_file(path));
    files.push_back({path, std::move(hash)});
  }
  return files;
}

core::Status check_unseen(std::span<const HashedFile> training,
                          std::span<const HashedFile> tested) {
  for (const HashedFile& test : tested) {
    const auto seen = std::find_if(training.begin(), training.end(), [&](const HashedFile& file) {
      return file.sha256 == test.sha256;
    });
    if (seen == training.end()) continue;
    return core::data_error(
        fmt::format("{}: is both trained on and tested on{}; test on another recording", test.path,
                    seen->path == test.path ? "" : ", with the same bytes as " + seen->path));
  }
  return {};
}

core::Status check_unseen(std::span<const record::Recording* const> training,
                          std::span<const record::Recording* const> tested) {
  for (const record::Recording* test : tested) {
    const auto seen =
        std::find_if(training.begin(), training.end(),
                     [&](const record::Recording* one) { return same_truths(*one, *test); });
    if (seen == training.end()) continue;
    return core::data_error(fmt::format(
        "{}: is both trained on and tested on: it has the true joints of {}, row by row; test on "
        "another recording",
        test->source, (*seen)->source));
  }
  return {};
}

}  // namespace ravencal::learn
