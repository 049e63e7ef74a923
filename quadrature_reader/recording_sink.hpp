// SPDX-License-Identifier: Apache-2.0
//
// A RecordingWriter that survives a full disk or a lost folder: it counts the rows that it cannot
// write. When writing works again, it begins a continuation file (NAME.2.db, ...) whose first event
// says what is missing. One thread owns it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "record/channel.hpp"
#include "record/recording.hpp"
#include "record/recording_writer.hpp"

namespace ravencal::quadrature_reader {

class RecordingSink {
 public:
  /// Replaces a file of that name where core/outputs.hpp lets the process.
  static core::Result<RecordingSink> create(const std::filesystem::path& path,
                                            const std::map<std::string, std::string>& meta,
                                            const std::vector<record::Channel>& channels);

  void append(std::int64_t t_ns, std::span<const double> values);
  void append_event(const record::Event& event);
  /// Kept for the present file and every continuation.
  void set_meta(const std::string& key, const std::string& value);
  /// Call about once a second: sees whether the file is still there, tries to go on after a
  /// failure.
  void maintain(std::int64_t now_ns);
  /// Commits and closes. The error is that of the present file.
  core::Status finish();

  /// True if rows were lost at any time.
  [[nodiscard]] bool lost_rows() const { return lost_rows_total_ > 0; }
  [[nodiscard]] std::int64_t rows() const { return rows_; }
  [[nodiscard]] const std::string& last_error() const { return last_error_; }
  [[nodiscard]] const std::filesystem::path& path() const { return current_path_; }

 private:
  RecordingSink(std::filesystem::path path, std::map<std::string, std::string> meta,
                std::vector<record::Channel> channels);
  void fail(const std::string& why);
  core::Status open(const std::filesystem::path& path, bool overwrite = false);
  [[nodiscard]] bool file_still_there() const;

  std::filesystem::path path_;
  std::filesystem::path current_path_;
  std::map<std::string, std::string> meta_;
  std::vector<record::Channel> channels_;
  std::optional<record::RecordingWriter> writer_;
  std::uint64_t inode_ = 0;
  int part_ = 1;
  std::int64_t rows_ = 0;
  std::int64_t lost_rows_ = 0;  // since the present outage began
  std::int64_t lost_rows_total_ = 0;
  std::int64_t last_row_t_ns_ = 0;
  std::int64_t outage_from_ns_ = 0;  // last row that was handed to the failed file
  std::string last_error_;
};

}  // namespace ravencal::quadrature_reader
