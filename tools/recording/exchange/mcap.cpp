// SPDX-License-Identifier: Apache-2.0
#include "exchange/mcap.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <array>
#include <cstring>
#include <fstream>
#include <map>
#include <optional>
#include <span>

#include "exchange/byte_fields.hpp"
#include "exchange/decompress.hpp"
#include "exchange/joint_states.hpp"
#include "exchange/named_array.hpp"

namespace ravencal::exchange {
namespace {

constexpr std::array<std::uint8_t, 8> kMcapMagic = {0x89, 'M', 'C', 'A', 'P', 0x30, '\r', '\n'};
constexpr std::size_t kRecordHead = 9;  // opcode and u64 of the content's bytes
/// Writers start a chunk after a few MiB; this is none. No source: a choice.
constexpr std::uint64_t kLargestRecord = std::uint64_t{1} << 30U;

enum Opcode : std::uint8_t { kFooter = 2, kSchema = 3, kChannel = 4, kMessage = 5, kChunk = 6 };

struct McapRecord {
  std::uint8_t opcode = 0;
  std::span<const std::uint8_t> content;
};

/// Takes the first record off; none: `bytes` holds no whole one.
std::optional<McapRecord> next_record(std::span<const std::uint8_t>& bytes) {
  FieldReader head(bytes);
  McapRecord record;
  std::uint64_t size = 0;
  if (!head.number(record.opcode) || !head.number(size) || size > head.rest().size())
    return std::nullopt;
  record.content = head.rest().first(static_cast<std::size_t>(size));
  bytes = head.rest().subspan(static_cast<std::size_t>(size));
  return record;
}

class McapReader {
 public:
  McapReader(const std::filesystem::path& path, std::uintmax_t size, bool skip_bad)
      : path_(path), file_(path, std::ios::binary), size_(size), topics_(path, skip_bad) {}

  core::Result<record::Table> read() {
    std::array<std::uint8_t, kMcapMagic.size()> magic{};
    if (!read_bytes(magic) || magic != kMcapMagic) {
      return core::data_error(
          fmt::format("{}: does not begin as an MCAP file does; was it renamed, or is it "
                      "compressed as a whole?",
                      path_.string()));
    }
    read_summary();
    go_to(kMcapMagic.size());
    RAVENCAL_RETURN_IF_ERROR(read_records());
    return std::move(topics_).table();
  }

 private:
  void go_to(std::uint64_t at) {
    file_.clear();
    file_.seekg(static_cast<std::streamoff>(at));
    at_ = at;
  }

  /// Schemas and channels, which the end of a whole file repeats: the chunk that had them first may
  /// be damaged. What is wrong here is found again, and said, in the file's order.
  void read_summary() {
    constexpr std::uint64_t kFooterBytes = kRecordHead + 20 + kMcapMagic.size();
    if (size_ < kMcapMagic.size() + kFooterBytes) return;
    go_to(size_ - kFooterBytes);
    std::array<std::uint8_t, kRecordHead + sizeof(std::uint64_t)> footer{};
    if (!read_bytes(footer) || footer[0] != kFooter) return;
    std::uint64_t begin = 0;
    std::memcpy(&begin, &footer[kRecordHead], sizeof(begin));
    if (begin < kMcapMagic.size() || begin > size_ - kFooterBytes) return;
    go_to(begin);
    std::vector<std::uint8_t> summary(static_cast<std::size_t>(size_ - kFooterBytes - begin));
    if (!read_bytes(summary)) return;
    std::span<const std::uint8_t> rest = summary;
    while (const auto record = next_record(rest)) {
      if (record->opcode == kSchema || record->opcode == kChannel)
        (void)take(begin, record->opcode, record->content);
    }
  }

  bool read_bytes(std::span<std::uint8_t> bytes) {
    file_.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    at_ += bytes.size();
    return file_.good();
  }

  /// Up to the footer, behind which nothing is new, or to where the file ends without one.
  core::Status read_records() {
    for (;;) {
      const std::uint64_t begin = at_;
      std::array<std::uint8_t, kRecordHead> head{};
      if (size_ - begin < head.size() || !read_bytes(head)) return ends_at(begin);
      const std::uint8_t opcode = head[0];
      std::uint64_t size = 0;
      std::memcpy(&size, &head[1], sizeof(size));
      if (opcode == kFooter) return {};
      if (size > size_ - at_) return ends_at(begin);
      const bool is_wanted =
          opcode == kSchema || opcode == kChannel || opcode == kMessage || opcode == kChunk;
      if (!is_wanted || size > kLargestRecord) {
        if (is_wanted) RAVENCAL_RETURN_IF_ERROR(bad_record(begin, "is larger than 1 GiB"));
        at_ += size;
        file_.seekg(static_cast<std::streamoff>(at_));
        continue;
      }
      std::vector<std::uint8_t> content(static_cast<std::size_t>(size));
      if (!read_bytes(content)) {
        return core::io_error(fmt::format("{}: cannot read byte {}", path_.string(), begin));
      }
      RAVENCAL_RETURN_IF_ERROR(opcode == kChunk ? take_chunk(begin, content)
                                                : take(begin, opcode, content));
    }
  }

  core::Status ends_at(std::uint64_t begin) {
    return topics_.bad_part(
        fmt::format("ends without a footer, in the record at byte {} of {}, as when the recorder "
                    "was killed",
                    begin, size_));
  }
  core::Status bad_record(std::uint64_t begin, std::string_view why) {
    return topics_.bad_part(fmt::format("the record at byte {} {}", begin, why));
  }

  core::Status take_chunk(std::uint64_t begin, std::span<const std::uint8_t> content) {
    FieldReader fields(content);
    std::uint64_t first = 0;
    std::uint64_t last = 0;
    std::uint64_t size = 0;
    std::uint32_t crc = 0;
    std::string compression;
    std::uint64_t stored = 0;
    const bool is_whole = fields.number(first) && fields.number(last) && fields.number(size) &&
                          fields.number(crc) && fields.text(compression) && fields.number(stored) &&
                          stored == fields.rest().size() && size <= kLargestRecord;
    if (!is_whole) return bad_record(begin, "is no chunk");
    const auto records = decompress(fields.rest(), compression, size);
    if (!records.ok()) return bad_record(begin, "cannot be read: " + records.error().message);
    // Zero: the writer counted none.
    if (crc != 0 && crc32_z(0, records->data(), records->size()) != crc)
      return bad_record(begin, "is a chunk of another checksum than it states");
    std::span<const std::uint8_t> rest = *records;
    while (const auto record = next_record(rest))
      RAVENCAL_RETURN_IF_ERROR(take(begin, record->opcode, record->content));
    return rest.empty() ? core::Status()
                        : bad_record(begin, "is a chunk that ends within a record");
  }

  /// A schema, channel or message, in a chunk or not.
  core::Status take(std::uint64_t begin, std::uint8_t opcode,
                    std::span<const std::uint8_t> content) {
    FieldReader fields(content);
    std::uint16_t id = 0;
    if (!fields.number(id)) return bad_record(begin, "is cut short");
    if (opcode == kSchema) {
      std::string name;
      if (!fields.text(name)) return bad_record(begin, "is no schema");
      schemas_[id] = std::move(name);
    } else if (opcode == kChannel) {
      std::uint16_t schema = 0;
      std::string topic;
      std::string encoding;
      if (!fields.number(schema) || !fields.text(topic) || !fields.text(encoding))
        return bad_record(begin, "is no channel");
      topics_.add_topic(id, std::move(topic), schemas_[schema], std::move(encoding));
    } else if (opcode == kMessage && topics_.is_wanted(id)) {
      std::uint32_t sequence = 0;
      std::uint64_t log_time_ns = 0;
      std::uint64_t publish_time_ns = 0;
      if (!fields.number(sequence) || !fields.number(log_time_ns) ||
          !fields.number(publish_time_ns))
        return bad_record(begin, "is no message");
      return topics_.add_message(id, static_cast<std::int64_t>(log_time_ns), fields.rest());
    }
    return {};
  }

  const std::filesystem::path& path_;
  std::ifstream file_;
  std::uint64_t size_;
  std::uint64_t at_ = 0;
  std::map<std::uint16_t, std::string> schemas_;
  JointStateTopics topics_;
};

}  // namespace

core::Result<record::Table> read_mcap(const std::filesystem::path& path,
                                      const record::LoadOptions& options) {
  RAVENCAL_RETURN_IF_ERROR(check_is_there(path));
  return McapReader(path, std::filesystem::file_size(path), options.skip_bad).read();
}

}  // namespace ravencal::exchange
