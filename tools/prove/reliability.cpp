// SPDX-License-Identifier: Apache-2.0
#include "prove/reliability.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <nlohmann/json.hpp>

#include "prove/statistics.hpp"

namespace ravencal::prove {
namespace {

using Json = nlohmann::ordered_json;

/// Ends of the ranges: finer where a user acts on a name.
constexpr std::array<double, 6> kEnds = {0.3, 0.5, 0.7, 0.9, 0.97, 1.0};

std::string range_text(const Json& range) {
  return fmt::format("{:.0f} to {:.0f} %", 100.0 * range["from"].get<double>(),
                     100.0 * range["to"].get<double>());
}

}  // namespace

Json reliability_json(const std::vector<CaseScore>& scores) {
  struct Range {
    Share there;
    double sum = 0.0;
  };
  std::map<std::string, std::array<Range, kEnds.size()>> worlds;
  for (const CaseScore& score : scores) {
    for (const Name& name : score.names) {
      if (!name.probability || name.parameter) continue;
      const auto at = std::upper_bound(kEnds.begin(), kEnds.end() - 1, *name.probability);
      Range& range = worlds[score.world][static_cast<std::size_t>(at - kEnds.begin())];
      range.there.count(name.hidden);
      range.sum += *name.probability;
    }
  }
  Json out = Json::array();
  for (const auto& [world, ranges] : worlds) {
    for (std::size_t k = 0; k < kEnds.size(); ++k) {
      const Share& there = ranges[k].there;
      if (there.of == 0) continue;
      const auto [low, high] = wilson(there);
      out.push_back({{"world", world},
                     {"from", k == 0 ? 0.0 : kEnds[k - 1]},
                     {"to", kEnds[k]},
                     {"said", there.of},
                     {"mean_said", ranges[k].sum / there.of},
                     {"there", there.hits},
                     {"share_there", there.value()},
                     {"ci95", {low, high}}});
    }
  }
  return out;
}

std::string reliability_text(const Json& reliability) {
  std::string text;
  for (const Json& range : reliability) {
    text += fmt::format(
        "  {:<21} said with {:<13} {:>4} names, {:>5.1f} % on average; there {:>5.1f} %\n",
        range["world"].get<std::string>(), range_text(range), range["said"].get<int>(),
        100.0 * range["mean_said"].get<double>(), 100.0 * range["share_there"].get<double>());
  }
  return text.empty() ? text : "probabilities of the names:\n" + text;
}

}  // namespace ravencal::prove
