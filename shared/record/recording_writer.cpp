// SPDX-License-Identifier: Apache-2.0
#include "record/recording_writer.hpp"

#include <fmt/format.h>

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <system_error>
#include <thread>
#include <utility>

#include "core/whole_file.hpp"
#include "record/recording_file.hpp"

namespace ravencal::record {
namespace fs = std::filesystem;
namespace {

// Half of the promised 100 ms: a commit itself waits for the disk.
constexpr std::chrono::milliseconds kCommitPeriod{50};

core::Status check_free(const fs::path& path, bool overwrite) {
  std::error_code failure;
  const bool exists = fs::exists(path, failure);
  if (exists && !fs::is_regular_file(path, failure)) {
    return core::Error{
        core::ErrorCode::kIo,
        fmt::format("{}: is a folder or a device; give the name of a file", path.string())};
  }
  if (overwrite || !exists) return {};
  return core::Error{
      core::ErrorCode::kUsage,
      fmt::format("{}: exists already; remove it or choose another name", path.string())};
}

core::Status write_all(RecordingFile& file, const Recording& recording) {
  std::vector<double> row(recording.channels.size());
  for (Eigen::Index r = 0; r < recording.rows(); ++r) {
    for (std::size_t c = 0; c < row.size(); ++c) {
      row[c] = recording.samples(r, static_cast<Eigen::Index>(c));
    }
    RAVENCAL_RETURN_IF_ERROR(file.append(recording.t_ns[static_cast<std::size_t>(r)], row));
  }
  for (const Event& event : recording.events) RAVENCAL_RETURN_IF_ERROR(file.append_event(event));
  return file.close();
}

core::Status write_to(const fs::path& path, const Recording& recording) {
  RAVENCAL_ASSIGN_OR_RETURN(
      RecordingFile file,
      RecordingFile::create(path, WriteMode::kWhole, recording.meta, recording.channels));
  return write_all(file, recording);
}

}  // namespace

/// The file, and a thread that commits what is pending even when the source falls silent.
struct RecordingWriter::Impl {
  explicit Impl(RecordingFile opened) : file(std::move(opened)) {}
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl() { (void)finish(); }

  template <typename Write>
  core::Status write(Write&& action);
  void commit_until_stopped();
  core::Status finish();

  std::mutex mutex;  // held by owner and committer while they use what follows
  RecordingFile file;
  std::optional<core::Error> failure;  ///< the first of the disk; every later call repeats it
  bool finished = false;
  std::condition_variable finishing;
  std::thread committer;
};

template <typename Write>
core::Status RecordingWriter::Impl::write(Write&& action) {
  const std::lock_guard lock(mutex);
  if (failure) return *failure;
  if (finished) return core::Error{core::ErrorCode::kUsage, "the recording is finished already"};
  core::Status status = action(file);
  if (!status.ok() && status.error().code == core::ErrorCode::kIo) failure = status.error();
  return status;
}

void RecordingWriter::Impl::commit_until_stopped() {
  std::unique_lock lock(mutex);
  while (!finishing.wait_for(lock, kCommitPeriod, [this] { return finished; })) {
    if (failure) continue;
    if (const core::Status status = file.commit(); !status.ok()) failure = status.error();
  }
}

core::Status RecordingWriter::Impl::finish() {
  core::Status status;
  {
    const std::lock_guard lock(mutex);
    if (failure) status = *failure;
    if (!failure && !finished) status = file.close();
    finished = true;
  }
  finishing.notify_one();
  if (committer.joinable()) committer.join();
  return status;
}

RecordingWriter::RecordingWriter(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
RecordingWriter::RecordingWriter(RecordingWriter&&) noexcept = default;
RecordingWriter& RecordingWriter::operator=(RecordingWriter&&) noexcept = default;
RecordingWriter::~RecordingWriter() = default;

core::Result<RecordingWriter> RecordingWriter::create(
    const fs::path& path, const std::map<std::string, std::string>& meta,
    const std::vector<Channel>& channels, bool overwrite) {
  RAVENCAL_RETURN_IF_ERROR(check_channels(channels, path));
  RAVENCAL_RETURN_IF_ERROR(check_free(path, overwrite));
  RAVENCAL_RETURN_IF_ERROR(remove_recording(path));
  RAVENCAL_ASSIGN_OR_RETURN(RecordingFile file,
                            RecordingFile::create(path, WriteMode::kLive, meta, channels));
  RAVENCAL_RETURN_IF_ERROR(file.commit());
  auto impl = std::make_unique<Impl>(std::move(file));
  impl->committer = std::thread(&Impl::commit_until_stopped, impl.get());
  return RecordingWriter(std::move(impl));
}

core::Status RecordingWriter::append(std::int64_t t_ns, std::span<const double> values) {
  return impl_->write([&](RecordingFile& file) { return file.append(t_ns, values); });
}

core::Status RecordingWriter::append_event(const Event& event) {
  return impl_->write([&](RecordingFile& file) { return file.append_event(event); });
}

core::Status RecordingWriter::set_meta(std::string_view key, std::string_view value) {
  return impl_->write([&](RecordingFile& file) { return file.set_meta(key, value); });
}

core::Status RecordingWriter::flush() {
  return impl_->write([](RecordingFile& file) { return file.commit(); });
}

core::Status RecordingWriter::finish() { return impl_->finish(); }

core::Status write_recording(const Recording& recording, const fs::path& path, bool overwrite) {
  RAVENCAL_RETURN_IF_ERROR(check_channels(recording.channels, path));
  RAVENCAL_RETURN_IF_ERROR(check_free(path, overwrite));
  RAVENCAL_ASSIGN_OR_RETURN(core::PartialFile target, core::PartialFile::create(path));
  RAVENCAL_RETURN_IF_ERROR(write_to(target.partial(), recording));
  // SQLite would read the rows of a killed writer's -wal instead of the new ones. It goes first:
  // the other order leaves, for a moment, a new file beside an old -wal.
  RAVENCAL_RETURN_IF_ERROR(remove_side_files(target.target()));
  return target.publish();
}

}  // namespace ravencal::record
