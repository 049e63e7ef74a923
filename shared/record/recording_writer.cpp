// SPDX-License-Identifier: Apache-2.0
#include "record/recording_writer.hpp"

#include <fmt/format.h>

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "core/output_place.hpp"
#include "core/outputs.hpp"
#include "core/whole_file.hpp"
#include "record/recording_file.hpp"

namespace ravencal::record {
namespace fs = std::filesystem;
namespace {

// Half of the promised 100 ms: a commit itself waits for the disk.
constexpr std::chrono::milliseconds kCommitPeriod{50};

core::Status check_free(const fs::path& path, bool overwrite) {
  const core::OutputPlace place = core::output_place(path);
  if (place.is_stream()) {
    return core::io_error(fmt::format(
        "{}: is a device or a pipe, and a recording needs a file; give its name", path.string()));
  }
  const bool exists = place.kind == core::OutputPlace::Kind::kFile;
  if (exists && !overwrite) return core::exists_already(path);
  RAVENCAL_RETURN_IF_ERROR(core::check_output(path));
  return check_log_has_recording(path);
}

/// Where a whole recording is written; SQLite makes side files while it closes it.
struct WholeTarget {
  explicit WholeTarget(core::PartialFile partial)
      : file(std::move(partial)),
        wal(file.partial().string() + "-wal"),
        shm(file.partial().string() + "-shm") {}

  core::PartialFile file;
  core::Unfinished wal, shm;
};

/// What is replaced is settled first. What another writer makes meanwhile is its own, with its log.
core::Status give_name(core::PartialFile& file, bool overwrite) {
  const bool is_there = core::output_place(file.target()).kind == core::OutputPlace::Kind::kFile;
  RAVENCAL_RETURN_IF_ERROR(check_free(file.target(), overwrite));
  if (is_there) RAVENCAL_RETURN_IF_ERROR(settle_recording(file.target()));
  return overwrite ? file.publish() : file.publish_new();
}

/// A recording without rows, in a partial file.
core::Result<WholeTarget> empty_recording(const fs::path& path,
                                          const std::map<std::string, std::string>& meta,
                                          const std::vector<Channel>& channels) {
  RAVENCAL_ASSIGN_OR_RETURN(core::PartialFile partial, core::PartialFile::create(path));
  WholeTarget target(std::move(partial));
  RAVENCAL_ASSIGN_OR_RETURN(RecordingFile file,
                            RecordingFile::create(target.file.partial(), meta, channels));
  RAVENCAL_RETURN_IF_ERROR(file.close());
  return target;
}

}  // namespace

/// The file and, while it happens, a thread that commits what is pending even when the source falls
/// silent; or where the file appears when it is whole.
struct RecordingWriter::Impl {
  explicit Impl(RecordingFile opened, std::optional<WholeTarget> whole = {})
      : target(std::move(whole)), file(std::move(opened)) {}
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl() {
    if (!target) (void)finish();
  }

  template <typename Write>
  core::Status write(Write&& action);
  void commit_until_stopped();
  core::Status finish();

  bool replaces = true;               ///< what has the name when it appears
  std::optional<WholeTarget> target;  // outlives the file, which lies there
  std::mutex mutex;                   // held by owner and committer while they use what follows
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
    try {
      if (const core::Status status = file.commit(); !status.ok()) failure = status.error();
    } catch (const std::exception& error) {  // would leave the thread, and end the process with it
      failure = core::io_error(error.what());
    }
  }
}

core::Status RecordingWriter::Impl::finish() {
  core::Status status;
  {
    const std::lock_guard lock(mutex);
    if (failure) status = *failure;
    if (!failure && !finished) {
      status = file.finish();
      if (status.ok() && target) status = give_name(target->file, replaces);
    }
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
  // Under its name it is readable from its first moment on, and until then what had the name stays.
  RAVENCAL_ASSIGN_OR_RETURN(WholeTarget empty, empty_recording(path, meta, channels));
  RAVENCAL_RETURN_IF_ERROR(give_name(empty.file, overwrite));
  RAVENCAL_ASSIGN_OR_RETURN(RecordingFile file,
                            RecordingFile::open_live(empty.file.target(), channels.size()));
  auto impl = std::make_unique<Impl>(std::move(file));
  impl->committer = std::thread(&Impl::commit_until_stopped, impl.get());
  return RecordingWriter(std::move(impl));
}

core::Result<RecordingWriter> RecordingWriter::create_whole(
    const fs::path& path, const std::map<std::string, std::string>& meta,
    const std::vector<Channel>& channels, bool overwrite) {
  RAVENCAL_RETURN_IF_ERROR(check_channels(channels, path));
  RAVENCAL_RETURN_IF_ERROR(check_free(path, overwrite));
  RAVENCAL_ASSIGN_OR_RETURN(core::PartialFile partial, core::PartialFile::create(path));
  WholeTarget target(std::move(partial));
  RAVENCAL_ASSIGN_OR_RETURN(RecordingFile file,
                            RecordingFile::create(target.file.partial(), meta, channels));
  auto impl = std::make_unique<Impl>(std::move(file), std::move(target));
  impl->replaces = overwrite;
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
  RAVENCAL_ASSIGN_OR_RETURN(
      RecordingWriter writer,
      RecordingWriter::create_whole(path, recording.meta, recording.channels, overwrite));
  std::vector<double> row(recording.channels.size());
  for (Eigen::Index r = 0; r < recording.rows(); ++r) {
    for (std::size_t c = 0; c < row.size(); ++c)
      row[c] = recording.samples(r, static_cast<Eigen::Index>(c));
    RAVENCAL_RETURN_IF_ERROR(writer.append(recording.t_ns[static_cast<std::size_t>(r)], row));
  }
  for (const Event& event : recording.events) RAVENCAL_RETURN_IF_ERROR(writer.append_event(event));
  return writer.finish();
}

}  // namespace ravencal::record
