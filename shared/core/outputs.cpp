// SPDX-License-Identifier: Apache-2.0
#include "core/outputs.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "core/file_beginnings.hpp"
#include "core/output_place.hpp"

namespace ravencal::core {
namespace {

namespace fs = std::filesystem;

struct FileIdentity {
  dev_t device;
  ino_t number;
  bool operator==(const FileIdentity&) const = default;
};

/// What the process was told of files.
struct Rules {
  std::mutex mutex;
  std::vector<FileIdentity> inputs;
  std::vector<fs::path> renewable;  ///< without links
  std::vector<fs::path> scratch;    ///< without links
  bool existing_protected = false;
};

Rules& rules() {
  static Rules all;
  return all;
}

fs::path without_links(const fs::path& path) {
  std::error_code unknown;
  fs::path real = fs::weakly_canonical(fs::absolute(path, unknown), unknown);
  return unknown ? path : real;
}

void protect(const fs::path& path, Rules& all) {
  struct stat file = {};
  if (::stat(path.c_str(), &file) == 0 && S_ISREG(file.st_mode))
    all.inputs.push_back({file.st_dev, file.st_ino});
}

/// `real` is one of these or below one of them.
bool is_in(const fs::path& real, const std::vector<fs::path>& folders) {
  return std::any_of(folders.begin(), folders.end(), [&](const fs::path& folder) {
    return std::mismatch(folder.begin(), folder.end(), real.begin(), real.end()).first ==
           folder.end();
  });
}

/// `path` is there, and the process was told that it may be replaced.
bool is_renewable(const fs::path& path, const Rules& all) {
  std::error_code unknown;
  const fs::path real = without_links(path);
  const bool is_link = fs::is_symlink(fs::symlink_status(path, unknown));
  if (is_link)
    return std::find(all.renewable.begin(), all.renewable.end(), real) != all.renewable.end();
  return is_in(real, all.renewable);
}

/// The first bytes of a file, which say what it is.
class FileBeginning {
 public:
  explicit FileBeginning(const fs::path& path)
      : file_(::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC)) {
    const ssize_t count = file_ < 0 ? 0 : ::pread(file_, bytes_.data(), bytes_.size(), 0);
    text_ = {bytes_.data(), static_cast<std::size_t>(std::max<ssize_t>(count, 0))};
  }
  FileBeginning(const FileBeginning&) = delete;
  FileBeginning& operator=(const FileBeginning&) = delete;
  ~FileBeginning() {
    if (file_ >= 0) ::close(file_);
  }

  [[nodiscard]] bool is_program() const {
    return text_.starts_with(
        "\x7f"
        "ELF");
  }
  [[nodiscard]] bool is_key() const {
    return text_.starts_with(kSecretKeyLabel) || text_.starts_with(kPublicKeyLabel);
  }
  [[nodiscard]] bool is_database() const { return text_.starts_with("SQLite format 3"); }
  [[nodiscard]] bool is_recording() const {
    return is_database() && text_.size() > kRecordingIdAt &&
           text_.substr(kRecordingIdAt).starts_with(kRecordingId);
  }
  /// Whoever has an SQLite file open in WAL mode holds a lock on it.
  [[nodiscard]] bool is_open_elsewhere() const {
    struct flock lock = {};
    lock.l_type = F_WRLCK;
    lock.l_whence = SEEK_SET;
    return is_database() && ::fcntl(file_, F_OFD_GETLK, &lock) == 0 && lock.l_type != F_UNLCK;
  }

 private:
  int file_;
  std::array<char, 100> bytes_{};
  std::string_view text_;
};

/// `kind`: what the file is, as the end of a clause.
Error taken(const fs::path& path, const char* kind, const Rules& all) {
  return {ErrorCode::kUsage,
          fmt::format("{}: exists already{}; {} or choose another name", path.string(), kind,
                      all.existing_protected ? "--force replaces it," : "remove it")};
}

Status check_file(const fs::path& path, const OutputPlace& place, const Rules& all) {
  const FileIdentity identity{place.status.st_dev, place.status.st_ino};
  if (std::find(all.inputs.begin(), all.inputs.end(), identity) != all.inputs.end()) {
    return usage_error(fmt::format(
        "{}: is read by this command and would be replaced; give the output another name",
        path.string()));
  }
  if (place.kind != OutputPlace::Kind::kFile) return {};
  const FileBeginning beginning(place.path);
  if (beginning.is_program()) {
    return usage_error(
        fmt::format("{}: is a program or a library, which is never replaced; choose another name",
                    path.string()));
  }
  if (beginning.is_key()) {
    return usage_error(fmt::format(
        "{}: is a key, and a key is never overwritten; choose another name", path.string()));
  }
  if (all.existing_protected && !is_renewable(path, all)) {
    return taken(path,
                 beginning.is_recording()  ? " and is a recording"
                 : beginning.is_database() ? " and is a database"
                                           : "",
                 all);
  }
  if (!beginning.is_open_elsewhere()) return {};
  return io_error(
      fmt::format("{}: another process writes or reads it; end that first, or choose another name",
                  path.string()));
}

/// Names as C strings, which a signal handler can use; null: free.
constinit std::array<std::atomic<const char*>, 128> unfinished{};
static_assert(std::atomic<const char*>::is_always_lock_free);

}  // namespace

void protect_inputs(std::span<const fs::path> paths) {
  const std::lock_guard lock(rules().mutex);
  for (const fs::path& path : paths) {
    protect(path, rules());
    std::error_code no_folder;
    for (const fs::directory_entry& entry : fs::directory_iterator(path, no_folder))
      protect(entry.path(), rules());
  }
}

void protect_existing() {
  const std::lock_guard lock(rules().mutex);
  rules().existing_protected = true;
}

void may_renew(const fs::path& path) {
  const std::lock_guard lock(rules().mutex);
  std::vector<fs::path>& known = rules().renewable;
  fs::path real = without_links(path);
  if (!rules().existing_protected) return;
  if (std::find(known.begin(), known.end(), real) == known.end()) known.push_back(std::move(real));
}

void add_scratch(const fs::path& folder) {
  const std::lock_guard lock(rules().mutex);
  rules().scratch.push_back(without_links(folder));
}

bool is_scratch(const fs::path& path) {
  const std::lock_guard lock(rules().mutex);
  return is_in(without_links(path), rules().scratch);
}

Status check_output(const fs::path& path) {
  const OutputPlace place = output_place(path);
  const std::lock_guard lock(rules().mutex);
  switch (place.kind) {
    case OutputPlace::Kind::kNewFile:
      return {};
    case OutputPlace::Kind::kFolder:
      return io_error(fmt::format("{}: is a folder; give the name of a file in it", path.string()));
    case OutputPlace::Kind::kDanglingLink:
      return usage_error(
          fmt::format("{}: is a link to {}, which does not exist; remove the link or choose "
                      "another name",
                      path.string(), place.path.string()));
    case OutputPlace::Kind::kFile:
    case OutputPlace::Kind::kDevice:
    case OutputPlace::Kind::kDescriptor:
      break;
  }
  return check_file(path, place, rules());
}

Error exists_already(const fs::path& path) {
  const std::lock_guard lock(rules().mutex);
  return taken(path, "", rules());
}

Unfinished::Unfinished(const std::filesystem::path& path) {
  const char* const name = ::strdup(path.c_str());
  for (auto& slot : unfinished) {
    const char* free_slot = nullptr;
    if (!slot.compare_exchange_strong(free_slot, name)) continue;
    slot_ = &slot;
    return;
  }
  std::free(const_cast<char*>(name));
}

Unfinished::Unfinished(Unfinished&& other) noexcept : slot_(std::exchange(other.slot_, nullptr)) {}

Unfinished::~Unfinished() {
  // A handler that has taken the name still reads it; it ends the process.
  if (slot_ != nullptr) std::free(const_cast<char*>(slot_->exchange(nullptr)));
}

void remove_unfinished() noexcept {
  for (auto& slot : unfinished) {
    const char* const name = slot.exchange(nullptr);
    if (name != nullptr && ::unlink(name) != 0) slot = name;
  }
  for (auto& slot : unfinished) {
    const char* const name = slot.exchange(nullptr);
    if (name != nullptr) (void)::rmdir(name);
  }
}

}  // namespace ravencal::core
