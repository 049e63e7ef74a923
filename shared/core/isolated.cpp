// SPDX-License-Identifier: Apache-2.0
#include "core/isolated.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <memory>
#include <new>
#include <string>
#include <system_error>
#include <vector>

namespace ravencal::core {
namespace {

constexpr std::uint64_t kMiB = 1U << 20U;
constexpr std::uint64_t kLargestPiece = 128 * kMiB;

// A sanitizer reserves terabytes of addresses for itself.
#ifdef RAVENCAL_SANITIZED
constexpr bool kSanitized = true;
#else
constexpr bool kSanitized = false;
#endif

/// What goes before each piece.
struct Frame {
  enum Kind : std::uint32_t { kPiece, kDone, kFailed };
  std::uint32_t kind = kPiece;
  std::uint32_t error_code = 0;  ///< kFailed: ErrorCode, with the message as the piece
  std::uint64_t bytes = 0;
};

struct ClosePipe {
  void operator()(std::FILE* file) const { (void)std::fclose(file); }
};
/// An end of the pipe; it gathers small pieces.
using End = std::unique_ptr<std::FILE, ClosePipe>;

bool read_all(std::FILE* from, void* bytes, std::size_t count) {
  auto* at = static_cast<char*>(bytes);
  while (count > 0) {
    const std::size_t got = std::fread(at, 1, count, from);
    at += got;
    count -= got;
    if (count == 0 || std::ferror(from) == 0 || errno != EINTR) break;
    std::clearerr(from);
  }
  return count == 0;
}

bool send_frame(std::FILE* to, Frame frame, const void* bytes, std::size_t count) {
  frame.bytes = count;
  return std::fwrite(&frame, sizeof frame, 1, to) == 1 && std::fwrite(bytes, 1, count, to) == count;
}

void limit(int resource, std::uint64_t value) {
  const struct rlimit both = {value, value};
  (void)::setrlimit(static_cast<__rlimit_resource_t>(resource), &both);
}

std::uint64_t address_bytes() {
  std::uint64_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  return pages * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

/// The child ends with its parent, dies of its own faults, and lets the parent decide what Ctrl-C
/// means.
void settle_child(const Isolation& bounds) {
  (void)::prctl(PR_SET_PDEATHSIG, SIGKILL);
  for (int number = 1; number < SIGRTMIN; ++number) (void)std::signal(number, SIG_DFL);
  (void)std::signal(SIGINT, SIG_IGN);
  (void)std::signal(SIGTERM, SIG_IGN);
  sigset_t none;
  sigemptyset(&none);
  (void)::sigprocmask(SIG_SETMASK, &none, nullptr);
  if (const int null = ::open("/dev/null", O_WRONLY | O_CLOEXEC); null >= 0) {
    (void)::dup2(null, STDERR_FILENO);
    (void)::dup2(null, STDOUT_FILENO);
  }
  limit(RLIMIT_CORE, 0);
  if (bounds.cpu_s > 0) limit(RLIMIT_CPU, bounds.cpu_s);
  if (bounds.wall_s > 0) ::alarm(bounds.wall_s);
  if (bounds.memory_bytes > 0 && !kSanitized) {
    limit(RLIMIT_AS, address_bytes() + bounds.memory_bytes);
  }
}

[[noreturn]] void run_child(std::FILE* out, const std::filesystem::path& file, const char* doing,
                            const Isolation& bounds,
                            const std::function<Status(const TakePiece&)>& work) {
  settle_child(bounds);
  const auto send = [out](std::span<const std::uint8_t> piece) -> Status {
    if (piece.size() <= kLargestPiece && send_frame(out, {}, piece.data(), piece.size())) return {};
    return io_error("a piece cannot be sent");
  };
  Status status;
  try {
    status = work(send);
  } catch (const std::bad_alloc&) {
    status = data_error(fmt::format("{}: cannot be {}: it asks for more than {} MiB of memory",
                                    file.string(), doing, bounds.memory_bytes / kMiB));
  } catch (const std::exception& error) {
    status = data_error(fmt::format("{}: cannot be {}: {}", file.string(), doing, error.what()));
  }
  Frame last;
  last.kind = status.ok() ? Frame::kDone : Frame::kFailed;
  if (!status.ok()) last.error_code = static_cast<std::uint32_t>(status.error().code);
  const std::string text = status.ok() ? "" : status.error().message;
  const bool sent = send_frame(out, last, text.data(), text.size()) && std::fflush(out) == 0;
  ::_exit(sent ? 0 : 1);
}

ErrorCode code_of(std::uint32_t number) {
  for (const ErrorCode code :
       {ErrorCode::kUsage, ErrorCode::kData, ErrorCode::kIo, ErrorCode::kDevice}) {
    if (static_cast<std::uint32_t>(code) == number) return code;
  }
  return ErrorCode::kData;
}

/// Whether the child told how it ended; `status` is what it told, or why it is not heard further.
bool receive(std::FILE* in, const Isolation& bounds, const TakePiece& take, const Error& too_much,
             Status& status) {
  std::vector<std::uint8_t> piece;
  std::uint64_t sum = 0;
  Frame frame;
  while (read_all(in, &frame, sizeof frame)) {
    sum += frame.bytes;
    if (frame.bytes > kLargestPiece || (bounds.sent_bytes > 0 && sum > bounds.sent_bytes)) {
      status = too_much;
      return true;
    }
    piece.resize(frame.bytes);
    if (!read_all(in, piece.data(), piece.size())) return false;
    if (frame.kind == Frame::kPiece) {
      if (take) status = take(piece);
      if (!status.ok()) return true;
      continue;
    }
    if (frame.kind != Frame::kDone) {
      status = Error{code_of(frame.error_code), {piece.begin(), piece.end()}};
    }
    return true;
  }
  return false;
}

std::string end_of(int ended, const Isolation& bounds) {
  if (WIFSIGNALED(ended) && (WTERMSIG(ended) == SIGXCPU || WTERMSIG(ended) == SIGKILL)) {
    return fmt::format("it was not done after {} s of processor time", bounds.cpu_s);
  }
  if (WIFSIGNALED(ended) && WTERMSIG(ended) == SIGALRM)
    return fmt::format("it was not done after {} s", bounds.wall_s);
  if (WIFSIGNALED(ended)) {
    return fmt::format("its library failed ({})", ::strsignal(WTERMSIG(ended)));
  }
  return fmt::format("its library ended the process ({})", WEXITSTATUS(ended));
}

}  // namespace

Isolation Isolation::reading(const std::filesystem::path& file) {
  std::error_code absent;
  const std::uintmax_t size = std::filesystem::file_size(file, absent);
  const std::uint64_t bytes = absent ? 0 : size;
  const auto cpu_s = static_cast<std::uint32_t>(10 + bytes / (4 * kMiB));
  return {cpu_s, 10 * cpu_s, 512 * kMiB + 8 * bytes, 64 * kMiB + 100 * bytes};
}

Status in_child(const std::filesystem::path& file, const char* doing, const Isolation& bounds,
                const std::function<Status(const TakePiece& send)>& work, const TakePiece& take) {
  const auto failed = [&](ErrorCode code, const std::string& why) {
    return Error{code, fmt::format("{}: cannot be {}: {}", file.string(), doing, why)};
  };
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) return failed(ErrorCode::kIo, std::strerror(errno));
  const End from(::fdopen(ends[0], "rb"));
  End to(::fdopen(ends[1], "wb"));
  const pid_t child = from && to ? ::fork() : -1;
  if (child == 0) run_child(to.get(), file, doing, bounds, work);
  if (child < 0)
    return failed(ErrorCode::kIo, fmt::format("no process for it: {}", std::strerror(errno)));
  to.reset();
  Status status;
  const Error too_much = failed(ErrorCode::kData, "it holds far more than a file of its size can");
  const bool heard = receive(from.get(), bounds, take, too_much, status);
  if (heard && !status.ok()) ::kill(child, SIGKILL);
  int ended = 0;
  while (::waitpid(child, &ended, 0) < 0 && errno == EINTR) {
  }
  return heard ? status : failed(ErrorCode::kData, end_of(ended, bounds));
}

Status send_text(const TakePiece& send, std::string_view text) {
  return send({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

TakePiece texts_into(std::vector<std::string>& texts) {
  return [&texts](std::span<const std::uint8_t> piece) -> Status {
    texts.emplace_back(piece.begin(), piece.end());
    return {};
  };
}

}  // namespace ravencal::core
