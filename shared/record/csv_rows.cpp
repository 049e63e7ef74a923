// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>

#include "core/side_by_side.hpp"
#include "record/csv_file.hpp"
#include "record/csv_kernel.hpp"
#include "record/csv_number.hpp"

namespace ravencal::record {
namespace {

// Small enough to stay in a core's second-level cache, large enough to make a system call cheap.
constexpr std::size_t kChunk = 512UL * 1024;
// Rows parsed before they are turned into columns: 64 rows write 8 cache lines per column.
constexpr std::size_t kTileRows = 64;

/// Calls work(chunk) for every chunk in [0, chunks), in order of start, on `threads` threads; work
/// returns false to let no later chunk start.
template <typename MakeWorker>
void for_each_chunk(std::size_t chunks, unsigned threads, MakeWorker&& make_worker) {
  std::atomic<std::size_t> next{0};
  const auto run = [&] {
    auto work = make_worker();
    for (std::size_t chunk = next++; chunk < chunks; chunk = next++) {
      if (!work(chunk)) next = chunks;
    }
  };
  core::side_by_side(std::min<std::size_t>(threads, chunks), run);
}

/// The first error of any thread, by file order.
class FirstError {
 public:
  void set(core::Error error) {
    const std::lock_guard lock(mutex_);
    if (!error_) error_ = std::move(error);
  }
  [[nodiscard]] core::Status status() const {
    return error_ ? core::Status(*error_) : core::Status();
  }

 private:
  std::mutex mutex_;
  std::optional<core::Error> error_;
};

std::size_t count_line_ends(const char* data, std::size_t size) {
  std::size_t count = 0;
  const char* const last = data + size;
  // memchr is the fastest search there is, and lines are long.
  while ((data = static_cast<const char*>(
              std::memchr(data, '\n', static_cast<std::size_t>(last - data)))) != nullptr) {
    ++count;
    ++data;
  }
  return count;
}

/// Parses rows of text and hands them over column by column.
class TileParser {
 public:
  TileParser(std::span<const BoundColumn> columns, const ColumnOutput& output)
      : columns_(columns),
        output_(output),
        width_(output.numbers.size()),
        has_words_(!output.words.empty()),
        tile_(std::make_unique_for_overwrite<double[]>(kTileRows * width_)),
        ends_(columns.size() + 1 + kCsvFieldSlack) {
    for (std::uint32_t i = 0; i < columns.size(); ++i) {
      if (columns[i].number)
        numbers_.push_back({i, static_cast<std::uint32_t>(*columns[i].number)});
    }
  }

  void begin(std::size_t first_row) {
    first_row_ = first_row;
    filled_ = 0;
  }

  /// Parses the line at `line`, which ends in '\n', and returns the next one; sets `bad` if it
  /// cannot.
  const char* parse(const char* line, std::optional<BadRow>& bad);
  void flush();
  /// Number of the next line.
  [[nodiscard]] std::size_t row() const { return first_row_ + filled_; }

 private:
  std::optional<BadRow> parse_slow(std::string_view line, double* row);
  std::optional<BadRow> parse_field(std::size_t column, std::string_view field, double* row);

  std::span<const BoundColumn> columns_;
  const ColumnOutput& output_;
  std::size_t width_;
  bool has_words_;
  const CsvKernel& kernel_ = csv_kernel();
  std::unique_ptr<double[]> tile_;
  std::vector<std::uint32_t> ends_;
  std::vector<std::string_view> fields_;
  std::vector<NumberField> numbers_;
  std::size_t first_row_ = 0;
  std::size_t filled_ = 0;
};

std::optional<BadRow> TileParser::parse_field(std::size_t index, std::string_view field,
                                              double* row) {
  const BoundColumn& column = columns_[index];
  const std::string_view text = trimmed(field);
  if (column.word) output_.words[*column.word][this->row()] = text_of(field);
  if (!column.number) return std::nullopt;
  std::optional<double> value = number_of(field);
  if (column.may_be_missing && (text.empty() || (value && std::isnan(*value)))) {
    value = std::numeric_limits<double>::quiet_NaN();
  } else if (!value || !std::isfinite(*value)) {
    return BadRow{
        this->row(),
        fmt::format("column {} ({}): {}", index + 1, column.name,
                    text.empty() ? "the field is empty"
                                 : fmt::format("'{}' is not a number", text.substr(0, 40))),
        index};
  }
  row[*column.number] = *value;
  return std::nullopt;
}

std::optional<BadRow> TileParser::parse_slow(std::string_view line, double* row) {
  if (trimmed(line).empty()) return BadRow{this->row(), "the line is empty"};
  const bool whole = split_fields(line, ',', fields_);
  if (!whole) return BadRow{this->row(), open_quotes(fields_.size())};
  if (fields_.size() != columns_.size()) {
    return BadRow{this->row(),
                  fmt::format("{} columns where {} are needed", fields_.size(), columns_.size())};
  }
  for (std::size_t i = 0; i < fields_.size(); ++i) {
    if (auto bad = parse_field(i, fields_[i], row)) return bad;
  }
  return std::nullopt;
}

const char* TileParser::parse(const char* line, std::optional<BadRow>& bad) {
  double* const values = tile_.get() + filled_ * width_;
  const std::size_t count = kernel_.split(line, columns_.size(), ends_.data());
  const char* end = line + ends_[count - 1];
  if (*end != '\n') end = static_cast<const char*>(std::memchr(end, '\n', SIZE_MAX / 2));
  const char* const next = end + 1;
  if (end > line && end[-1] == '\r') ends_[count - 1] -= count == columns_.size() ? 1 : 0, --end;
  const bool plain = count == columns_.size() && !has_words_ &&
                     kernel_.parse(line, ends_.data(), numbers_, values);
  if (!plain) {
    bad = parse_slow({line, static_cast<std::size_t>(end - line)}, values);
  }
  if (++filled_ == kTileRows) flush();
  return next;
}

void TileParser::flush() {
  for (std::size_t c = 0; c < width_; ++c) {
    double* const out = output_.numbers[c] + first_row_;
    const double* in = tile_.get() + c;
    const double factor = output_.factors[c];
    for (std::size_t r = 0; r < filled_; ++r, in += width_) out[r] = *in * factor;
  }
  first_row_ += filled_;
  filled_ = 0;
}

/// A chunk of text with the rest of its last line, read into memory of its own.
class ChunkBuffer {
 public:
  /// Reads the lines that begin in [begin, end) of the file; at a begin other than the file's first
  /// row, the line that begins before is left out.
  core::Status read(const CsvFile& file, std::uint64_t first_row, std::uint64_t begin,
                    std::uint64_t end);
  [[nodiscard]] const char* first() const { return first_; }
  [[nodiscard]] const char* last() const { return last_; }
  [[nodiscard]] std::size_t lines_skipped() const { return skipped_; }

 private:
  std::vector<char> bytes_;
  const char* first_ = nullptr;  ///< first line that begins in the chunk
  const char* last_ = nullptr;   ///< behind the last one, which ends in '\n'
  std::size_t skipped_ = 0;
};

core::Status ChunkBuffer::read(const CsvFile& file, std::uint64_t first_row, std::uint64_t begin,
                               std::uint64_t end) {
  constexpr std::size_t kMore = 16UL * 1024;
  const std::uint64_t from = begin > first_row ? begin - 1 : begin;
  std::size_t have = 0;
  std::size_t want = std::min<std::uint64_t>(file.size() - from, end - from + kMore);
  const auto own = static_cast<std::size_t>(end - from);
  const char* stop = nullptr;
  while (stop == nullptr) {
    if (bytes_.size() < want + 1 + kCsvPadding) bytes_.resize(want + 1 + kCsvPadding);
    RAVENCAL_RETURN_IF_ERROR(file.read(from + have, bytes_.data() + have, want - have));
    have = want;
    bytes_[have] = '\n';
    // A line that begins at the last own byte or before ends at the first line end from there on.
    const bool whole = from + have == file.size();
    const std::size_t search = own - 1;
    const void* found = std::memchr(bytes_.data() + search, '\n', have + (whole ? 1 : 0) - search);
    stop = static_cast<const char*>(found);
    want = std::min<std::uint64_t>(file.size() - from, 2 * have);
  }
  first_ = bytes_.data();
  last_ = stop + 1;
  skipped_ = 0;
  if (begin > first_row) {
    first_ = static_cast<const char*>(
                 std::memchr(first_, '\n', static_cast<std::size_t>(last_ - first_))) +
             1;
    skipped_ = first_ == bytes_.data() + 1 ? 0 : 1;
  }
  return {};
}

/// The bad rows that all threads find.
class BadRows {
 public:
  explicit BadRows(bool stop_at_first) : stop_at_first_(stop_at_first) {}

  /// False: no later row is wanted.
  bool add(BadRow row) {
    const std::lock_guard lock(mutex_);
    rows_.push_back(std::move(row));
    return !stop_at_first_;
  }
  std::vector<BadRow> take() {
    std::sort(rows_.begin(), rows_.end(),
              [](const BadRow& a, const BadRow& b) { return a.row < b.row; });
    if (stop_at_first_ && rows_.size() > 1) rows_.resize(1);
    return std::move(rows_);
  }

 private:
  bool stop_at_first_;
  std::mutex mutex_;
  std::vector<BadRow> rows_;
};

/// Parses the lines of a chunk. False: no later chunk is wanted; nothing: there are more lines than
/// the `rows` that were counted.
std::optional<bool> parse_lines(const ChunkBuffer& buffer, std::size_t rows, TileParser& parser,
                                BadRows& bad) {
  const char* line = buffer.first();
  while (line < buffer.last()) {
    if (parser.row() >= rows) return std::nullopt;
    std::optional<BadRow> bad_row;
    line = parser.parse(line, bad_row);
    if (bad_row && !bad.add(std::move(*bad_row))) return false;
  }
  parser.flush();
  return true;
}

}  // namespace

core::Result<CsvRows> CsvRows::count(const CsvFile& file, bool header, unsigned threads) {
  CsvRows rows(file);
  rows.threads_ = threads != 0 ? threads : std::max(1U, std::thread::hardware_concurrency());
  if (header) {
    ChunkBuffer line;
    RAVENCAL_RETURN_IF_ERROR(line.read(file, 0, 0, 1));
    rows.begin_ = static_cast<std::uint64_t>(line.last() - line.first());
    if (rows.begin_ >= file.size()) return rows;
  }
  const std::size_t chunks = (file.size() - rows.begin_ + kChunk - 1) / kChunk;
  rows.line_ends_before_.assign(chunks + 1, 0);
  FirstError error;
  for_each_chunk(chunks, rows.threads_, [&] {
    return [&, buffer = std::vector<char>(std::min<std::uint64_t>(kChunk, file.size()))](
               std::size_t chunk) mutable {
      const std::uint64_t begin = rows.begin_ + chunk * kChunk;
      const std::size_t size = std::min<std::uint64_t>(kChunk, file.size() - begin);
      const core::Status status = file.read(begin, buffer.data(), size);
      if (!status.ok()) error.set(status.error());
      rows.line_ends_before_[chunk + 1] = count_line_ends(buffer.data(), size);
      return status.ok();
    };
  });
  RAVENCAL_RETURN_IF_ERROR(error.status());
  for (std::size_t i = 1; i <= chunks; ++i)
    rows.line_ends_before_[i] += rows.line_ends_before_[i - 1];
  rows.rows_ = rows.line_ends_before_[chunks] + 1;
  return rows;
}

core::Result<std::vector<BadRow>> CsvRows::parse(std::span<const BoundColumn> columns,
                                                 const ColumnOutput& output,
                                                 bool stop_at_bad) const {
  BadRows bad(stop_at_bad);
  FirstError error;
  const std::size_t chunks = line_ends_before_.empty() ? 0 : line_ends_before_.size() - 1;
  for_each_chunk(chunks, threads_, [&] {
    return [&, buffer = ChunkBuffer(),
            parser = TileParser(columns, output)](std::size_t chunk) mutable {
      const std::uint64_t begin = begin_ + chunk * kChunk;
      const std::uint64_t end = std::min<std::uint64_t>(begin + kChunk, file_->size());
      if (const core::Status status = buffer.read(*file_, begin_, begin, end); !status.ok()) {
        error.set(status.error());
        return false;
      }
      parser.begin(line_ends_before_[chunk] + buffer.lines_skipped());
      const auto go_on = parse_lines(buffer, rows_, parser, bad);
      if (!go_on) {
        error.set({core::ErrorCode::kIo,
                   fmt::format("{}: the file changed while it was read", file_->path().string())});
      }
      return go_on.value_or(false);
    };
  });
  RAVENCAL_RETURN_IF_ERROR(error.status());
  return bad.take();
}

}  // namespace ravencal::record
