// SPDX-License-Identifier: Apache-2.0
#include "monitor/telemetry_reader.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/ipc.h>
#include <sys/shm.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <string_view>

namespace ravencal::monitor {
namespace {

using Label = ravencal_telemetry_label;
using Header = ravencal_telemetry_header;
using Slot = ravencal_telemetry_slot;

constexpr const char* kFolder = "/dev/shm";
constexpr std::size_t kWordBytes = sizeof(std::uint64_t);
constexpr std::string_view kMagic = RAVENCAL_TELEMETRY_MAGIC;
/// A writer needs well under a microsecond for what a sequence guards.
constexpr int kMostTries = 10'000;

struct File {
  explicit File(const std::string& path)
      : descriptor(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK)) {}
  File(const File&) = delete;
  File& operator=(const File&) = delete;
  ~File() {
    if (descriptor >= 0) ::close(descriptor);
  }
  const int descriptor;
};

core::Error data_error(const std::string& name, std::string_view what) {
  return {core::ErrorCode::kData, fmt::format("{}: {}", name, what)};
}

/// The file's label, or less where the file is shorter.
Label read_label(const File& file) {
  Label label{};
  if (file.descriptor >= 0) (void)::pread(file.descriptor, &label, sizeof label, 0);
  return label;
}

bool is_telemetry(const Label& label) {
  return std::string_view(label.magic, sizeof label.magic) == kMagic;
}

/// Anybody may make a file in that folder.
bool is_trusted(uid_t owner, std::optional<std::uint32_t> user) {
  return owner == 0 || owner == ::geteuid() || owner == user;
}

bool is_trusted(const File& file, std::optional<std::uint32_t> user) {
  struct stat status {};
  return file.descriptor >= 0 && ::fstat(file.descriptor, &status) == 0 &&
         is_trusted(status.st_uid, user);
}

/// The writer's lock ends with its process. A shared lock disturbs nobody: who wants to replace
/// what a dead writer left asks again for a while.
bool writer_holds(const File& file) {
  if (::flock(file.descriptor, LOCK_SH | LOCK_NB) != 0) return true;
  ::flock(file.descriptor, LOCK_UN);
  return false;
}

/// What is wrong with the label of memory of so many bytes; empty if nothing.
std::string fault_of(const Label& label, std::uint64_t memory_bytes) {
  const bool sizes_fit =
      label.header_bytes >= sizeof(Header) && label.header_bytes % kWordBytes == 0 &&
      label.slot_bytes == sizeof(Slot) && label.tick_ns > 0 &&
      std::has_single_bit(label.slot_count) &&
      memory_bytes >= label.header_bytes + std::uint64_t{label.slot_count} * label.slot_bytes;
  return sizes_fit ? "" : "has sizes in its label that do not fit";
}

}  // namespace

/// The memory and the file that names it.
struct TelemetryReader::Segment {
  explicit Segment(const std::string& path) : file(path), label(read_label(file)) {}
  Segment(const Segment&) = delete;
  Segment& operator=(const Segment&) = delete;
  ~Segment() {
    if (words != nullptr) ::shmdt(words);
  }

  /// False if there is no memory of that number with that label.
  bool attach() {
    shmid_ds status{};
    if (::shmctl(label.memory_id, IPC_STAT, &status) != 0) return false;
    bytes = status.shm_segsz;
    void* const memory = ::shmat(label.memory_id, nullptr, SHM_RDONLY);
    if (memory == reinterpret_cast<void*>(-1)) return false;
    words = static_cast<const std::uint64_t*>(memory);
    return bytes >= sizeof label && std::memcmp(memory, &label, sizeof label) == 0;
  }

  File file;
  Label label;  ///< the file's
  const std::uint64_t* words = nullptr;
  std::size_t bytes = 0;
  ino_t inode = 0;
  uid_t owner = 0;
};

core::Result<TelemetryReader> TelemetryReader::open(const std::string& name,
                                                    std::optional<std::uint32_t> user) {
  if (name.size() < 2 || name[0] != '/' || name[1] == '.' || name.find('/', 1) != name.npos) {
    return core::Error{
        core::ErrorCode::kUsage,
        fmt::format("'{}' is no name of shared memory; it is like /ravencal-left", name)};
  }
  auto segment = std::make_shared<Segment>(kFolder + name);
  struct stat status {};
  if (segment->file.descriptor < 0 || ::fstat(segment->file.descriptor, &status) != 0) {
    const bool absent = errno == ENOENT;
    return core::Error{
        core::ErrorCode::kIo,
        absent ? fmt::format("{}: no telemetry of that name; is the controller running, with "
                             "this telemetry_name in the plugin's configuration?",
                             name)
               : fmt::format("{}: cannot be opened: {}", name, std::strerror(errno))};
  }
  segment->inode = status.st_ino;
  segment->owner = status.st_uid;
  if (!is_trusted(status.st_uid, user)) {
    return core::io_error(fmt::format(
        "{}: belongs to another user ({}), neither to you nor to root; --user {} watches "
        "it if you trust that user, and a controller of yours needs another name",
        name, status.st_uid, status.st_uid));
  }
  const Label& label = segment->label;
  if (!S_ISREG(status.st_mode) || !is_telemetry(label)) {
    return data_error(name, "is shared memory of something else");
  }
  if (label.version != RAVENCAL_TELEMETRY_VERSION) {
    return data_error(name, fmt::format("is telemetry of version {}; this program reads version {}",
                                        label.version, RAVENCAL_TELEMETRY_VERSION));
  }
  if (!segment->attach()) {
    return core::Error{
        core::ErrorCode::kIo,
        writer_holds(segment->file)
            ? fmt::format("{}: its memory {} cannot be attached: {}", name, label.memory_id,
                          std::strerror(errno))
            : fmt::format("{}: its writer, process {}, was killed or crashed; start the controller "
                          "again",
                          name, label.writer_pid)};
  }
  if (const std::string fault = fault_of(label, segment->bytes); !fault.empty()) {
    return data_error(name, fault);
  }
  return TelemetryReader(name, std::move(segment));
}

TelemetryReader::TelemetryReader(std::string name, std::shared_ptr<const Segment> segment)
    : name_(std::move(name)), segment_(std::move(segment)) {}

const ravencal_telemetry_label& TelemetryReader::label() const { return segment_->label; }

std::uint64_t TelemetryReader::word_at(std::size_t byte) const {
  // atomic_ref wants a mutable object even to read it; the load is a plain one.
  auto& word = const_cast<std::uint64_t&>(segment_->words[byte / kWordBytes]);
  return std::atomic_ref<std::uint64_t>(word).load(std::memory_order_acquire);
}

void TelemetryReader::read(std::vector<NumberedTick>& ticks) {
  const std::uint64_t slots = label().slot_count;
  const std::uint64_t written = word_at(offsetof(Header, written));
  // The oldest slots are the next to be overwritten: leave a part of the ring to them.
  if (written - next_ > slots) next_ = written - slots + slots / 8;
  for (; next_ < written; ++next_) {
    const std::size_t slot =
        label().header_bytes + static_cast<std::size_t>(next_ % slots) * sizeof(Slot);
    const std::uint64_t whole = 2 * next_ + 2;
    if (word_at(slot) != whole) continue;  // overwritten meanwhile
    std::array<std::uint64_t, sizeof(Slot) / kWordBytes> words{};
    for (std::size_t i = 0; i < words.size(); ++i) words[i] = word_at(slot + i * kWordBytes);
    if (word_at(slot) != whole) continue;
    const auto read = std::bit_cast<Slot>(words);
    ticks.push_back({next_, read.tick, std::to_array(read.offset_ji)});
  }
}

/// A record that counters_sequence guards.
template <typename Record>
std::optional<Record> TelemetryReader::guarded_record(std::size_t byte) const {
  for (int i = 0; i < kMostTries; ++i) {
    const std::uint64_t before = word_at(offsetof(Header, counters_sequence));
    if (before % 2 != 0) continue;
    std::array<std::uint64_t, sizeof(Record) / kWordBytes> words{};
    for (std::size_t w = 0; w < words.size(); ++w) words[w] = word_at(byte + w * kWordBytes);
    if (word_at(offsetof(Header, counters_sequence)) != before) continue;
    return std::bit_cast<Record>(words);
  }
  return std::nullopt;
}

std::optional<ravencal_counters> TelemetryReader::counters() const {
  return guarded_record<ravencal_counters>(offsetof(Header, counters));
}

ravencal_telemetry_homing TelemetryReader::homing() const {
  return guarded_record<ravencal_telemetry_homing>(offsetof(Header, homing))
      .value_or(ravencal_telemetry_homing{});
}

Writer TelemetryReader::writer() const {
  if (word_at(offsetof(Header, closed)) != 0) return Writer::kEnded;
  if (writer_holds(segment_->file)) return Writer::kAlive;
  return word_at(offsetof(Header, closed)) != 0 ? Writer::kEnded : Writer::kGone;
}

bool TelemetryReader::is_replaced() const {
  struct stat status {};
  return ::stat((kFolder + name_).c_str(), &status) == 0 && status.st_ino != segment_->inode;
}

std::uint32_t TelemetryReader::owner_uid() const { return segment_->owner; }
std::uint32_t TelemetryReader::writer_pid() const { return label().writer_pid; }
std::uint32_t TelemetryReader::tick_ns() const { return label().tick_ns; }
std::int64_t TelemetryReader::start_realtime_ns() const { return label().start_realtime_ns; }

int TelemetryReader::request_id() const { return label().request_id; }
std::uint64_t TelemetryReader::request_taken() const {
  return word_at(offsetof(Header, request_taken));
}

std::string TelemetryReader::plugin_version() const {
  const char* const text = label().plugin_version;
  return {text, ::strnlen(text, sizeof label().plugin_version)};
}

std::vector<std::string> telemetry_names(std::optional<std::uint32_t> user) {
  std::vector<std::string> names;
  std::error_code unreadable;
  for (const auto& entry : std::filesystem::directory_iterator(kFolder, unreadable)) {
    const std::string file = entry.path().filename().string();
    std::error_code vanished;
    if (file.starts_with('.') || !entry.is_regular_file(vanished)) continue;
    const File opened(entry.path().string());
    if (is_trusted(opened, user) && is_telemetry(read_label(opened)) && writer_holds(opened))
      names.push_back("/" + file);
  }
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace ravencal::monitor
