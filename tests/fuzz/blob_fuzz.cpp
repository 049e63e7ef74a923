// SPDX-License-Identifier: Apache-2.0
//
// libFuzzer harness of the blob reader: the bytes as they are, and again with a right checksum, or
// nothing behind it would ever be reached. Whatever opens is read to the last byte.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "model/blob_view.hpp"
#include "model/blob_writer.hpp"
#include "unit/blob_sample.hpp"

namespace {

void read_everything(std::span<const std::byte> bytes) {
  ravencal::model::BlobView view;
  if (!ravencal::model::BlobView::open(bytes, view).ok()) return;
  // What the view accepts, the decoder may refuse only for names and JSON; it must not crash, and
  // what it accepts must encode again.
  const auto model = ravencal::model::decode_blob(bytes, "fuzz");
  if (model.ok() && !ravencal::model::encode_blob(*model).ok()) {
    // Self-test outputs of extreme weights may overflow: a reason to refuse, not a fault.
    return;
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto* const first = reinterpret_cast<const std::byte*>(data);
  std::vector<std::byte> bytes(first, first + size);
  read_everything(bytes);
  ravencal::test::repair_checksum(bytes);
  read_everything(bytes);
  return 0;
}
