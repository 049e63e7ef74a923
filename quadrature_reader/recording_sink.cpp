// SPDX-License-Identifier: Apache-2.0
#include "quadrature_reader/recording_sink.hpp"

#include <fmt/format.h>
#include <sys/stat.h>

#include <system_error>
#include <utility>

namespace ravencal::quadrature_reader {
namespace fs = std::filesystem;

RecordingSink::RecordingSink(fs::path path, std::map<std::string, std::string> meta,
                             std::vector<record::Channel> channels)
    : path_(std::move(path)), meta_(std::move(meta)), channels_(std::move(channels)) {}

core::Result<RecordingSink> RecordingSink::create(const fs::path& path,
                                                  const std::map<std::string, std::string>& meta,
                                                  const std::vector<record::Channel>& channels) {
  RecordingSink sink(path, meta, channels);
  RAVENCAL_RETURN_IF_ERROR(sink.open(path, true));
  return sink;
}

core::Status RecordingSink::open(const fs::path& path, bool overwrite) {
  RAVENCAL_ASSIGN_OR_RETURN(writer_,
                            record::RecordingWriter::create(path, meta_, channels_, overwrite));
  current_path_ = path;
  struct stat status {};
  inode_ = ::stat(path.c_str(), &status) == 0 ? status.st_ino : 0;
  return {};
}

void RecordingSink::append(std::int64_t t_ns, std::span<const double> values) {
  if (writer_) {
    const core::Status status = writer_->append(t_ns, values);
    if (status.ok()) {
      ++rows_;
      last_row_t_ns_ = t_ns;
      return;
    }
    fail(status.error().message);
  }
  ++lost_rows_;
  ++lost_rows_total_;
  last_row_t_ns_ = t_ns;
}

void RecordingSink::append_event(const record::Event& event) {
  if (!writer_) return;
  if (const core::Status status = writer_->append_event(event); !status.ok())
    fail(status.error().message);
}

void RecordingSink::set_meta(const std::string& key, const std::string& value) {
  meta_[key] = value;
  if (!writer_) return;
  if (const core::Status status = writer_->set_meta(key, value); !status.ok())
    fail(status.error().message);
}

void RecordingSink::maintain(std::int64_t now_ns) {
  if (writer_) {
    // Writing to a deleted file succeeds, and everything written is lost.
    if (!file_still_there()) fail(fmt::format("{}: the file is gone", current_path_.string()));
    return;
  }
  std::error_code ignored;
  if (path_.has_parent_path()) fs::create_directories(path_.parent_path(), ignored);
  const fs::path next = path_.parent_path() / fmt::format("{}.{}{}", path_.stem().string(),
                                                          part_ + 1, path_.extension().string());
  meta_["continues"] = current_path_.filename().string();
  if (!open(next).ok()) return;
  ++part_;
  append_event(
      {now_ns, "gap",
       fmt::format(
           R"({{"continues":"{}","rows_not_written":{},"from_ns":{},"to_ns":{},"why":"{}"}})",
           meta_["continues"], lost_rows_, outage_from_ns_, last_row_t_ns_, last_error_)});
  lost_rows_ = 0;
}

core::Status RecordingSink::finish() {
  if (!writer_) return core::Error{core::ErrorCode::kIo, last_error_};
  core::Status status = writer_->finish();
  writer_.reset();
  return status;
}

void RecordingSink::fail(const std::string& why) {
  last_error_ = why;
  outage_from_ns_ = last_row_t_ns_;
  lost_rows_ = 0;
  ++lost_rows_total_;  // the last uncommitted batch is gone too
  (void)writer_->finish();
  writer_.reset();
}

bool RecordingSink::file_still_there() const {
  struct stat status {};
  return ::stat(current_path_.c_str(), &status) == 0 && status.st_ino == inode_;
}

}  // namespace ravencal::quadrature_reader
