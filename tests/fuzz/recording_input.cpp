// SPDX-License-Identifier: Apache-2.0
//
// A SQLite file where the bytes begin like one; otherwise SQL that makes one, which reaches views,
// generated columns and foreign types.
#include <sqlite3.h>

#include <cmath>

#include "fuzz/inputs.hpp"
#include "record/recording_reader.hpp"
#include "record/recording_writer.hpp"
#include "record/summary.hpp"

namespace ravencal::fuzz {
namespace {

namespace fs = std::filesystem;

/// The script itself may not run for ever or leave its file; that is no matter of the reader.
void make_database(const fs::path& path, const std::string& script) {
  constexpr int kMostOperations = 100'000;
  constexpr int kLongestText = 100'000;
  fs::remove(path);
  sqlite3* database = nullptr;
  promise(sqlite3_open(path.c_str(), &database) == SQLITE_OK, "a database can be made");
  sqlite3_limit(database, SQLITE_LIMIT_LENGTH, kLongestText);
  sqlite3_limit(database, SQLITE_LIMIT_ATTACHED, 0);
  sqlite3_progress_handler(
      database, kMostOperations, [](void*) { return 1; }, nullptr);
  sqlite3_set_authorizer(
      database,
      [](void*, int action, const char*, const char*, const char*, const char*) {
        return action == SQLITE_PRAGMA || action == SQLITE_ATTACH ? SQLITE_DENY : SQLITE_OK;
      },
      nullptr);
  (void)sqlite3_exec(database, "PRAGMA synchronous=OFF", nullptr, nullptr, nullptr);
  (void)sqlite3_exec(database, script.c_str(), nullptr, nullptr, nullptr);
  sqlite3_close_v2(database);
}

bool same(double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); }

void check_same(const record::Recording& a, const record::Recording& b) {
  promise(a.t_ns == b.t_ns && a.channels.size() == b.channels.size(), "the same rows and columns");
  for (std::size_t c = 0; c < a.channels.size(); ++c) {
    promise(a.channels[c].name == b.channels[c].name && a.channels[c].unit == b.channels[c].unit &&
                a.channels[c].role == b.channels[c].role &&
                a.channels[c].joint == b.channels[c].joint,
            "the same channels");
  }
  for (Eigen::Index i = 0; i < a.samples.size(); ++i) {
    promise(same(a.samples.data()[i], b.samples.data()[i]), "the same samples");
  }
  auto meta = a.meta;
  meta.emplace("software_version", b.meta.at("software_version"));  // a writer adds its own
  promise(meta == b.meta && a.events.size() == b.events.size(), "the same meta and events");
}

}  // namespace

void try_recording(Bytes bytes) {
  const std::string_view text = text_of(bytes);
  fs::path path = scratch_path("fuzz.db");
  if (text.starts_with("SQLite format 3")) {
    path = scratch_file("fuzz.db", bytes);
  } else {
    make_database(path, std::string(text));
  }
  const auto read = record::read_recording(path, {}, 1);
  const auto events = record::read_events(path);
  if (!read_or_words(read, path.string())) return;
  promise(events.ok() && events->size() == read->events.size(), "its events can be had alone");
  promise(static_cast<std::size_t>(read->rows()) == read->t_ns.size(), "as many stamps as rows");
  const record::Summary summary = record::summarise(*read);
  promise(!record::describe_in_json(*read, summary).empty(), "what was read can be described");
  promise(!record::describe_in_words(*read, summary).empty(), "what was read can be described");
  const fs::path again = scratch_path("again.db");
  const auto written = record::write_recording(*read, again, true);
  promise(written.ok(), "what was read can be written");
  const auto reread = record::read_recording(again, {}, 1);
  promise(reread.ok(), "what was written can be read");
  check_same(*read, *reread);
}

}  // namespace ravencal::fuzz
