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

#include "record/csv_dialect.hpp"
#include "record/csv_encoding.hpp"
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
  RAVENCAL_RETURN_IF_ERROR(file.settle_encoding());
  RAVENCAL_RETURN_IF_ERROR(file.find_end());
  if (file.size_ == 0) {
    return core::Error{core::ErrorCode::kData, fmt::format("{}: the file is empty", path.string())};
  }
  RAVENCAL_RETURN_IF_ERROR(file.settle_dialect());
  return file;
}

CsvFile::CsvFile(CsvFile&& other) noexcept
    : path_(std::move(other.path_)),
      file_(std::exchange(other.file_, -1)),
      begin_(other.begin_),
      size_(other.size_),
      text_(std::move(other.text_)) {}

CsvFile::~CsvFile() {
  if (file_ >= 0) ::close(file_);
}

core::Status CsvFile::settle_encoding() {
  using Form = CsvEncoding::Form;
  char first[4];
  const std::size_t count = std::min<std::uint64_t>(size_, sizeof(first));
  RAVENCAL_RETURN_IF_ERROR(read(0, first, count));
  const CsvEncoding encoding = encoding_of({first, count});
  if (encoding.form == Form::kUtf32)
    return core::data_error(fmt::format("{}: is text in UTF-32; save it as UTF-8", path_.string()));
  begin_ = encoding.mark;
  size_ -= encoding.mark;
  if (encoding.form == Form::kBytes) return {};
  RAVENCAL_ASSIGN_OR_RETURN(const std::string units, read_all());
  auto text = utf8_of_utf16(units, encoding.form == Form::kUtf16Big);
  if (!text.ok())
    return core::data_error(fmt::format("{}: {}", path_.string(), text.error().message));
  text_ = std::move(text).value();
  size_ = text_->size();
  return {};
}

core::Status CsvFile::settle_dialect() {
  RAVENCAL_ASSIGN_OR_RETURN(std::string first_lines, beginning(kDialectLines + 1));
  const bool ends_by_return =
      first_lines.find('\n') == std::string::npos && first_lines.find('\r') != std::string::npos;
  if (ends_by_return) {
    std::replace(first_lines.begin(), first_lines.end(), '\r', '\n');
    text_ = first_lines;
  }
  RAVENCAL_ASSIGN_OR_RETURN(const CsvDialect dialect, find_dialect(first_lines, path_.string()));
  if (dialect.is_plain) return {};
  RAVENCAL_ASSIGN_OR_RETURN(const std::string all, read_all());
  RAVENCAL_ASSIGN_OR_RETURN(text_, in_plain_form(all, dialect.delimiter, path_.string()));
  size_ = text_->size();
  return find_end();
}

core::Result<std::string> CsvFile::read_all() const {
  std::string text(size_, '\0');
  RAVENCAL_RETURN_IF_ERROR(read(0, text.data(), text.size()));
  return text;
}

core::Result<std::string> CsvFile::beginning(std::size_t lines) const {
  std::string text;
  for (std::size_t found = 0; found < lines && text.size() < size_;) {
    const std::size_t old = text.size();
    text.resize(std::min<std::uint64_t>(size_, std::max<std::size_t>(65536, 2 * old)));
    RAVENCAL_RETURN_IF_ERROR(read(old, text.data() + old, text.size() - old));
    found += static_cast<std::size_t>(
        std::count(text.begin() + static_cast<std::ptrdiff_t>(old), text.end(), '\n'));
  }
  if (text.size() < size_) text.resize(text.rfind('\n'));
  return text;
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
  if (text_) {
    text_->copy(buffer, count, offset);
    return {};
  }
  offset += begin_;
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
  RAVENCAL_ASSIGN_OR_RETURN(const std::string text, beginning(1));
  const std::string_view line = std::string_view(text).substr(0, text.find('\n'));
  std::vector<std::string_view> fields;
  if (!split_fields(without_comment_sign(line), ',', fields))
    return core::data_error(fmt::format("{}:1: {}", path_.string(), open_quotes(fields.size())));
  std::vector<std::string> names;
  names.reserve(fields.size());
  for (const std::string_view field : fields) names.push_back(utf8_of_bytes(text_of(field)));
  return names;
}

}  // namespace ravencal::record
