// SPDX-License-Identifier: Apache-2.0
#include "record/csv_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "record/csv_number.hpp"

namespace ravencal::record {
namespace {

core::Error io_error(const std::filesystem::path& path, std::string_view doing) {
  return core::io_error(fmt::format("{}: {}: {}", path.string(), doing, std::strerror(errno)));
}

}  // namespace

core::Result<CsvFile> CsvFile::open(const std::filesystem::path& path) {
  CsvFile file(path, ::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (file.file_ < 0) return io_error(path, "cannot open");
  struct stat status = {};
  if (::fstat(file.file_, &status) != 0) return io_error(path, "cannot read");
  if (!S_ISREG(status.st_mode)) {
    return core::Error{core::ErrorCode::kIo, fmt::format("{}: not a file", path.string())};
  }
  file.size_ = static_cast<std::uint64_t>(status.st_size);
  RAVENCAL_RETURN_IF_ERROR(file.find_end());
  if (file.size_ == 0) {
    return core::Error{core::ErrorCode::kData, fmt::format("{}: the file is empty", path.string())};
  }
  return file;
}

CsvFile::CsvFile(CsvFile&& other) noexcept
    : path_(std::move(other.path_)), file_(std::exchange(other.file_, -1)), size_(other.size_) {}

CsvFile::~CsvFile() {
  if (file_ >= 0) ::close(file_);
}

core::Status CsvFile::find_end() {
  char tail[256];
  while (size_ > 0) {
    const std::size_t count = std::min<std::uint64_t>(size_, sizeof(tail));
    RAVENCAL_RETURN_IF_ERROR(read(size_ - count, tail, count));
    std::size_t kept = count;
    while (kept > 0 && (tail[kept - 1] == '\n' || tail[kept - 1] == '\r')) --kept;
    size_ -= count - kept;
    if (kept > 0) break;
  }
  return {};
}

core::Status CsvFile::read(std::uint64_t offset, char* buffer, std::size_t count) const {
  while (count > 0) {
    const ssize_t got = ::pread(file_, buffer, count, static_cast<off_t>(offset));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return io_error(path_, "cannot read");
    if (got == 0) {
      return core::Error{
          core::ErrorCode::kIo,
          fmt::format("{}: the file became shorter while it was read", path_.string())};
    }
    buffer += got;
    offset += static_cast<std::uint64_t>(got);
    count -= static_cast<std::size_t>(got);
  }
  return {};
}

core::Result<std::vector<std::string>> CsvFile::first_line() const {
  std::string line;
  std::size_t end = std::string::npos;
  while (end == std::string::npos && line.size() < size_) {
    const std::size_t old = line.size();
    line.resize(std::min<std::uint64_t>(size_, old + 65536));
    RAVENCAL_RETURN_IF_ERROR(read(old, line.data() + old, line.size() - old));
    end = line.find('\n', old);
  }
  std::string_view rest(line);
  rest = rest.substr(0, end);
  // numpy.savetxt begins a header with "# ", Excel with a byte order mark.
  if (rest.starts_with("\xEF\xBB\xBF")) rest.remove_prefix(3);
  if (rest.starts_with("# ")) rest.remove_prefix(2);
  std::vector<std::string> fields;
  for (;;) {
    const std::size_t comma = rest.find(',');
    fields.emplace_back(trimmed(rest.substr(0, comma)));
    if (comma == std::string_view::npos) return fields;
    rest.remove_prefix(comma + 1);
  }
}

}  // namespace ravencal::record
