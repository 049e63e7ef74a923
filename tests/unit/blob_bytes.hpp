// SPDX-License-Identifier: Apache-2.0
//
// What the tests of a blob's bytes share.
#pragma once

#include <gtest/gtest.h>

#include <cstddef>
#include <utility>
#include <vector>

#include "model/blob_format.hpp"
#include "model/blob_view.hpp"
#include "model/blob_writer.hpp"
#include "unit/blob_sample.hpp"

namespace ravencal::test {

/// The model's blob; empty, and the test failed, if there is none.
inline std::vector<std::byte> encoded(const model::CalibrationModel& model) {
  const auto bytes = model::encode_blob(model);
  EXPECT_TRUE(bytes.ok()) << (bytes.ok() ? "" : bytes.error().message);
  return bytes.ok() ? *bytes : std::vector<std::byte>{};
}

/// Where the record of input i begins.
inline std::size_t feature_at(const std::vector<std::byte>& bytes, std::size_t i) {
  return model::blob::section_entry(bytes.data(), model::blob::kFeatures).offset +
         i * model::blob::kFeatureBytes;
}

/// What the reader says to changed bytes under a right checksum.
inline model::BlobCheck check_repaired(std::vector<std::byte> bytes) {
  repair_checksum(bytes);
  model::BlobView view;
  return model::BlobView::open(bytes, view);
}

}  // namespace ravencal::test
