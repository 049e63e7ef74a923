// SPDX-License-Identifier: Apache-2.0
//
// A zip archive where the bytes begin like one; otherwise one array, put into an archive with its
// right checksum, so that the reader of arrays is reached.
#include "exchange/npz.hpp"

#include <zip.h>

#include "fuzz/inputs.hpp"

namespace ravencal::fuzz {
namespace {

std::filesystem::path archive_of(Bytes array) {
  std::filesystem::path path = scratch_path("fuzz.npz");
  int reason = 0;
  zip_t* const archive = zip_open(path.c_str(), ZIP_CREATE | ZIP_TRUNCATE, &reason);
  promise(archive != nullptr, "an archive can be made");
  zip_source_t* const source = zip_source_buffer(archive, array.data(), array.size(), 0);
  const zip_int64_t at = zip_file_add(archive, "input_mean.npy", source, ZIP_FL_OVERWRITE);
  promise(at >= 0, "an array can be added");
  (void)zip_set_file_compression(archive, static_cast<zip_uint64_t>(at), ZIP_CM_STORE, 0);
  promise(zip_close(archive) == 0, "an archive can be written");
  return path;
}

}  // namespace

void try_npz(Bytes bytes) {
  const bool is_archive = text_of(bytes).starts_with("PK");
  const auto path = is_archive ? scratch_file("fuzz.npz", bytes) : archive_of(bytes);
  const auto arrays = exchange::read_npz(path);
  if (!read_or_words(arrays, path.string())) return;
  record::Table table;
  for (const exchange::NamedArray& array : *arrays) {
    promise(array.unreadable.empty() || (array.values.empty() && array.texts.empty()),
            "an array is read or not");
    for (const std::string& text : array.texts) {
      for (const char c : text) promise(c > 0 && c < 0x7F, "a text is ASCII");
    }
    exchange::add_columns(table, array);
  }
  for (const record::TableColumn& column : table.columns) {
    promise(column.texts.empty() || column.texts.size() == column.values.size(),
            "as many texts as rows");
  }
}

}  // namespace ravencal::fuzz
