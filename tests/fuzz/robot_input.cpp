// SPDX-License-Identifier: Apache-2.0
#include "fuzz/inputs.hpp"
#include "physics/plant.hpp"
#include "physics/plant_writer.hpp"

namespace ravencal::fuzz {

/// The library that compiles models runs in a child: what ends the child is an error in words.
void try_robot(Bytes bytes) {
  const bool is_urdf = text_of(bytes).find("<robot") != std::string_view::npos;
  const auto path = scratch_file(is_urdf ? "fuzz.urdf" : "fuzz.xml", bytes);
  const auto plant = physics::load_plant(path);
  if (!read_or_words(plant, path.string())) return;
  promise(!plant->joints.empty(), "a plant has joints");
  const auto again = physics::parse_plant(physics::plant_text(*plant), "again.toml");
  promise(again.ok(), "the plant of a model can be written and read");
}

}  // namespace ravencal::fuzz
