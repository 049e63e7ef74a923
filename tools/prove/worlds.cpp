// SPDX-License-Identifier: Apache-2.0
#include "prove/worlds.hpp"

#include <map>

#include "prove/tally.hpp"
#include "prove/workspace.hpp"

namespace ravencal::prove {

Json worlds_json(const std::vector<CaseScore>& scores) {
  std::map<std::string, std::vector<CaseScore>> worlds;
  for (const CaseScore& score : scores)
    if (score.track == "synthetic") worlds[score.laws].push_back(score);
  // "own" first, as a reader expects the reference before what is compared with it.
  Json out = Json::object();
  for (auto world = worlds.rbegin(); world != worlds.rend(); ++world)
    out[world->first] = {{"cases", world->second.size()},
                         {"targets", tally(world->second)["targets"]}};
  return out;
}

std::string worlds_text(const Json& proof) {
  if (!proof.contains("worlds")) return "";
  std::string text = "by world:\n";
  for (std::size_t t = 0; t < proof["targets"].size(); ++t) {
    text += fmt::format("  {}\n", proof["targets"][t]["target"].get<std::string>());
    for (const auto& [world, figures] : proof["worlds"].items())
      text += fmt::format("    {:<6} {:<8} {}\n", world,
                          figures["targets"][t]["verdict"].get<std::string>(),
                          figures["targets"][t]["figure"].get<std::string>());
  }
  return text;
}

}  // namespace ravencal::prove
