// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "../../unit/record/scratch.hpp"
#include "core/units.hpp"
#include "record/recording_reader.hpp"
#include "record/recording_writer.hpp"

namespace ravencal::record {
namespace {

using testing::Scratch;

/// Any finite or infinite double, or a lost value. Bit patterns, so that all magnitudes occur.
rc::Gen<double> any_value() {
  return rc::gen::map(rc::gen::arbitrary<std::uint64_t>(), [](std::uint64_t bits) {
    const double value = std::bit_cast<double>(bits);
    return bits % 7 == 0 || std::isnan(value) ? std::numeric_limits<double>::quiet_NaN() : value;
  });
}

bool same(double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); }

struct Table {
  std::vector<Channel> channels;
  std::vector<double> to_si;
  std::vector<std::int64_t> t_ns;
  std::vector<std::vector<double>> rows;
};

Table any_table() {
  Table table;
  const auto channel_count = *rc::gen::inRange<std::size_t>(0, 12);
  for (std::size_t c = 0; c < channel_count; ++c) {
    const auto units = core::known_units();
    const core::Unit unit = units[*rc::gen::inRange<std::size_t>(0, units.size())];
    const auto role = static_cast<Role>(*rc::gen::inRange(0, 12));
    const std::string odd = *rc::gen::element<std::string>("", " ", "\"", "'", ".", "é", ";--");
    table.channels.push_back({std::to_string(c) + odd, std::string(unit.name), role, odd});
    table.to_si.push_back(unit.to_si);
  }
  table.t_ns = *rc::gen::container<std::vector<std::int64_t>>(rc::gen::arbitrary<std::int64_t>());
  std::sort(table.t_ns.begin(), table.t_ns.end());
  for (std::size_t r = 0; r < table.t_ns.size(); ++r) {
    table.rows.push_back(*rc::gen::container<std::vector<double>>(channel_count, any_value()));
  }
  return table;
}

void expect_equal(const Table& table, const Recording& read) {
  RC_ASSERT(read.t_ns == table.t_ns);
  RC_ASSERT(read.channels.size() == table.channels.size());
  for (std::size_t c = 0; c < table.channels.size(); ++c) {
    RC_ASSERT(read.channels[c].name == table.channels[c].name);
    RC_ASSERT(read.channels[c].role == table.channels[c].role);
    RC_ASSERT(read.channels[c].joint == table.channels[c].joint);
    RC_ASSERT(read.channels[c].unit == core::find_unit(table.channels[c].unit)->si_name);
    for (std::size_t r = 0; r < table.rows.size(); ++r) {
      RC_ASSERT(same(read.samples(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(c)),
                     table.rows[r][c] * table.to_si[c]));
    }
  }
}

TEST(Recording, ReadsBackWhateverWasWrittenLive) {
  const bool held = rc::check([] {
    const Scratch scratch;
    const Table table = any_table();
    auto writer = RecordingWriter::create(scratch / "r.db", {}, table.channels);
    RC_ASSERT(writer.ok());
    for (std::size_t r = 0; r < table.rows.size(); ++r) {
      RC_ASSERT(writer->append(table.t_ns[r], table.rows[r]).ok());
    }
    RC_ASSERT(writer->finish().ok());
    const auto read = read_recording(scratch / "r.db");
    RC_ASSERT(read.ok());
    expect_equal(table, *read);
  });
  EXPECT_TRUE(held);
}

TEST(Recording, WrittenWholeReadsBackEqual) {
  const bool held = rc::check([] {
    const Scratch scratch;
    const Table table = any_table();
    Recording recording;
    recording.t_ns = table.t_ns;
    recording.channels = table.channels;
    recording.samples.resize(static_cast<Eigen::Index>(table.rows.size()),
                             static_cast<Eigen::Index>(table.channels.size()));
    for (std::size_t c = 0; c < table.channels.size(); ++c) {
      recording.channels[c].unit = core::find_unit(table.channels[c].unit)->si_name;
      for (std::size_t r = 0; r < table.rows.size(); ++r) {
        recording.samples(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(c)) =
            table.rows[r][c] * table.to_si[c];
      }
    }
    RC_ASSERT(write_recording(recording, scratch / "r.db").ok());
    RC_ASSERT(scratch.file_count() == 1U);
    const auto read = read_recording(scratch / "r.db");
    RC_ASSERT(read.ok());
    expect_equal(table, *read);
  });
  EXPECT_TRUE(held);
}

}  // namespace
}  // namespace ravencal::record
