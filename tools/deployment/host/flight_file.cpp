// SPDX-License-Identifier: Apache-2.0
#include "host/flight_file.hpp"

#include <fmt/format.h>

#include <fstream>
#include <memory>
#include <string>

#include "core/joint_layout.hpp"
#include "core/whole_file.hpp"

namespace ravencal::host {
namespace {

std::string header() {
  std::string line = "t_ns,tick_1";
  for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
    for (const char* prefix : {"estimate", "correction", "predicted"}) {
      line += fmt::format(",{}.{}_{}", prefix, core::kSlotNames[j], core::kSlotUnits[j]);
    }
    line += fmt::format(",enc.{}_counts", core::kSlotNames[j]);
  }
  return line + ",confidence_1,status.runlevel_1,status.state_1,status.doubts_1,step_ns\n";
}

/// Shortest digits that read back as the same float.
std::string line_of(const ravencal_tick& tick) {
  std::string line = fmt::format("{},{}", tick.t_ns, tick.tick);
  for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
    line += fmt::format(",{},{},{},{}", tick.jpos_ji[j], tick.correction_ji[j],
                        tick.predicted_ji[j], tick.enc_counts[j]);
  }
  return line + fmt::format(",{},{},{},{},{}\n", tick.confidence, tick.runlevel, tick.state,
                            tick.doubts, tick.step_ns);
}

}  // namespace

bool is_flight(const std::filesystem::path& path) {
  const std::string first = header();
  std::string found(first.size(), '\0');
  std::ifstream file(path, std::ios::binary);
  return file.read(found.data(), static_cast<std::streamsize>(found.size())) && found == first;
}

core::Result<std::uint64_t> write_flight(const plugin_host::Instance& plugin,
                                         const std::filesystem::path& path) {
  const auto flight = std::make_unique<ravencal_flight>();
  flight->struct_size = sizeof *flight;
  if (plugin.api().flight(plugin.get(), flight.get()) != RAVENCAL_SUCCESS) return std::uint64_t{0};
  std::string text = header();
  for (std::uint32_t i = 0; i < flight->ticks; ++i) text += line_of(flight->tick[i]);
  RAVENCAL_RETURN_IF_ERROR(core::write_whole_file(path, text));
  return flight->faults;
}

}  // namespace ravencal::host
