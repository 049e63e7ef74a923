// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "record/recording.hpp"

namespace ravencal::learn {

/// Whether every file is another one, by content: a recording that counts twice, or that both
/// trains and validates, misleads. Errors: kUsage; kIo.
core::Status check_distinct(std::span<const std::string> training,
                            std::span<const std::string> validation);

struct HashedFile {
  std::string path;
  std::string sha256;
};

/// Errors: kIo.
core::Result<std::vector<HashedFile>> hashed(const std::vector<std::string>& paths);

/// Whether no file is both trained on and tested on, by content. Errors (kData) name both paths.
core::Status check_unseen(std::span<const HashedFile> training, std::span<const HashedFile> tested);
/// The same of recordings that were written again, e.g. exported as a table: by their true joints,
/// row by row.
core::Status check_unseen(std::span<const record::Recording* const> training,
                          std::span<const record::Recording* const> tested);

}  // namespace ravencal::learn
