// SPDX-License-Identifier: Apache-2.0
//
// The bytes as shared memory of a plugin that nobody trusts, read and shown as `monitor` does.
#include <unistd.h>

#include <fstream>
#include <vector>

#include "fuzz/inputs.hpp"
#include "monitor/stream.hpp"
#include "monitor/telemetry_reader.hpp"
#include "monitor/view.hpp"
#include "monitor/watch.hpp"

namespace ravencal::fuzz {
namespace {

/// A name of shared memory that ends with the process.
class Segment {
 public:
  Segment() : name_("/ravencal_fuzz_" + std::to_string(::getpid())) {}
  ~Segment() { (void)::unlink(path().c_str()); }
  Segment(const Segment&) = delete;
  Segment& operator=(const Segment&) = delete;
  [[nodiscard]] const std::string& name() const { return name_; }
  void write(Bytes bytes) const {
    std::ofstream(path(), std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()),
               static_cast<std::streamsize>(bytes.size()));
  }

 private:
  [[nodiscard]] std::string path() const { return "/dev/shm" + name_; }
  std::string name_;
};

}  // namespace

void try_telemetry(Bytes bytes) {
  static const Segment segment;
  segment.write(bytes);
  auto reader = monitor::TelemetryReader::open(segment.name());
  if (!read_or_words(reader, segment.name())) return;
  std::vector<monitor::NumberedTick> ticks;
  reader->read(ticks);
  promise(ticks.size() * sizeof(ravencal_telemetry_slot) <= bytes.size(), "ticks come from slots");
  monitor::Watch watch;
  for (std::size_t i = 0; i < ticks.size(); ++i) {
    promise(i == 0 || ticks[i - 1].number < ticks[i].number, "ticks come in order");
    watch.take(ticks[i], reader->tick_ns());
  }
  if (const auto counters = reader->counters()) watch.take(*counters);
  (void)reader->writer();
  monitor::Surroundings surroundings;
  surroundings.name = segment.name();
  for (const std::string& line : monitor::draw(watch, *reader, surroundings)) {
    promise(line.size() <= 4 * 80, "a line fits the screen");
  }
  (void)monitor::draw_line(watch, surroundings);
  (void)monitor::tick_json(watch);
  promise(monitor::event_json("attached", *reader).ends_with("\n"), "an event is one line");
}

}  // namespace ravencal::fuzz
