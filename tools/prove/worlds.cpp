// SPDX-License-Identifier: Apache-2.0
#include "prove/worlds.hpp"

#include <map>

#include "prove/tally.hpp"
#include "prove/workspace.hpp"
#include "report/escape.hpp"

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

std::string worlds_html(const Json& proof) {
  if (!proof.contains("worlds")) return "";
  std::string head, rows;
  for (const auto& [world, figures] : proof["worlds"].items())
    head += fmt::format("<th>{} <span class=\"quiet\">({})</span></th>", report::html_escape(world),
                        figures["cases"].get<int>());
  for (std::size_t t = 0; t < proof["targets"].size(); ++t) {
    rows += fmt::format("<tr><td>{}</td>",
                        report::html_escape(proof["targets"][t]["target"].get<std::string>()));
    for (const auto& [world, figures] : proof["worlds"].items()) {
      const Json& target = figures["targets"][t];
      const std::string verdict = target["verdict"];
      rows += fmt::format("<td class=\"{}\" style=\"white-space:normal\">{}</td>",
                          verdict == "met"       ? "met"
                          : verdict == "not met" ? "not"
                                                 : "quiet",
                          report::html_escape(target["figure"].get<std::string>()));
    }
    rows += "</tr>";
  }
  return "<h2>By world</h2><p class=\"quiet\">The worlds move the robot by different laws of "
         "friction, cable and servo.</p><div class=\"scroll\"><table><thead><tr><th>target "
         "(cases)</th>" +
         head + "</tr></thead><tbody>" + rows + "</tbody></table></div>";
}

}  // namespace ravencal::prove
