// SPDX-License-Identifier: Apache-2.0
#include "fuzz/inputs.hpp"
#include "physics/plant.hpp"
#include "physics/plant_writer.hpp"

namespace ravencal::fuzz {

void try_plant(Bytes bytes) {
  const auto plant = physics::parse_plant(text_of(bytes), "fuzz.toml");
  if (!read_or_words(plant, "fuzz.toml")) return;
  promise(!plant->joints.empty(), "a plant has joints");
  const std::string text = physics::plant_text(*plant);
  const auto again = physics::parse_plant(text, "again.toml");
  promise(again.ok(), "what was written can be read");
  promise(physics::plant_text(*again) == text, "what was read and written again is the same");
}

}  // namespace ravencal::fuzz
