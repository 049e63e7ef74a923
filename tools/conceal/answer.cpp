// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <toml++/toml.h>

#include <nlohmann/json.hpp>
#include <sstream>

#include "conceal/conceal.hpp"
#include "conceal/kinds.hpp"
#include "core/version.hpp"
#include "core/whole_file.hpp"

namespace ravencal::conceal {
namespace {

/// Parameters of the effect in the order of the vocabulary, by their keys in the file.
template <typename Use>
void for_each_parameter(const physics::Effect& effect, physics::JointKind kind, Use&& use) {
  for (const physics::ParameterSpec& spec : physics::find_effect_spec(effect.id)->parameters) {
    const auto it = effect.parameters.find(spec.name);
    if (it != effect.parameters.end()) use(spec, physics::key_of(spec, kind), it->second);
  }
}

toml::table table_of(const physics::Effect& effect, physics::JointKind kind) {
  toml::table table{{"id", effect.id}};
  if (!effect.from.empty()) table.insert("from", effect.from);
  for_each_parameter(effect, kind, [&](const auto&, const std::string& key, double value) {
    table.insert(key, value);
  });
  return table;
}

/// "_rad_per_n_m" as "rad_per_N_m": units as in a report, where N alone is a capital.
std::string unit_of(const physics::ParameterSpec& spec, physics::JointKind kind) {
  const std::string_view suffix = physics::unit_suffix(spec.dimension, kind);
  if (suffix.empty()) return "1";
  std::string unit(suffix.substr(1));
  for (std::size_t i = 0; i < unit.size(); ++i) {
    const bool alone =
        (i == 0 || unit[i - 1] == '_') && (i + 1 == unit.size() || unit[i + 1] == '_');
    if (alone && unit[i] == 'n') unit[i] = 'N';
  }
  return unit;
}

}  // namespace

core::Result<std::string> hidden_plant(const std::filesystem::path& plant_file,
                                       const physics::Plant& plant, const Hidden& hidden) {
  RAVENCAL_ASSIGN_OR_RETURN(const std::string text, core::read_whole_file(plant_file));
  const physics::Joint& joint = plant.joints[hidden.joint];
  // The file is a plant: it has been read as one.
  toml::table root = toml::parse(text, plant_file.string());
  toml::table& table = *root["joint"][hidden.joint].as_table();
  if (!table.contains("effect")) table.insert("effect", toml::array{});
  table["effect"].as_array()->push_back(table_of(hidden.effect, joint.kind));
  std::ostringstream out;
  out << "# " << plant_file.filename().string()
      << " with one effect more, hidden by `ravencal conceal`.\n\n"
      << root << "\n";
  return out.str();
}

std::string answer_json(const physics::Plant& plant, const Hidden& hidden, std::uint64_t seed) {
  const physics::Joint& joint = plant.joints[hidden.joint];
  nlohmann::ordered_json parameters = nlohmann::json::array();
  for_each_parameter(
      hidden.effect, joint.kind, [&](const auto& spec, const std::string&, double value) {
        parameters.push_back(
            {{"name", spec.name}, {"value", value}, {"unit", unit_of(spec, joint.kind)}});
      });
  const nlohmann::ordered_json answer = {
      {"schema", 1},
      {"seed", seed},
      {"plant", std::filesystem::path(plant.source).filename().string()},
      {"joint", joint.name},
      {"id", hidden.effect.id},
      {"from", hidden.effect.from},
      {"parameters", std::move(parameters)},
      {"drawn", hidden.parameter},
      {"shows_in", hidden.visibility.by_error() ? "position" : "effort"},
      {"scatters", hidden.visibility.most()},
      {"ravencal", core::kVersion}};
  return answer.dump(1) + "\n";
}

}  // namespace ravencal::conceal
