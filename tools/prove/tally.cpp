// SPDX-License-Identifier: Apache-2.0
#include "prove/tally.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <numeric>

#include "prove/reliability.hpp"
#include "prove/statistics.hpp"
#include "prove/workspace.hpp"

namespace ravencal::prove {
namespace {

constexpr double kClear = 3.0;  // times the floor: from here on the targets count
constexpr std::array<std::pair<const char*, std::pair<double, double>>, 4> kSizes = {
    {{"below 1", {0.0, 1.0}},
     {"1 to 3", {1.0, kClear}},
     {"3 to 10", {kClear, kLargestClass}},
     {"10 and more", {kLargestClass, 1e300}}}};

Json json_of(const Share& share) {
  const auto [low, high] = wilson(share);
  return {{"hits", share.hits},
          {"of", share.of},
          {"share", share.of > 0 ? Json(share.value()) : Json()},
          {"ci95", {low, high}}};
}

Json json_of(const std::vector<double>& values) {
  const auto [low, high] = bootstrap_median(values);
  if (values.empty()) {
    const Json none;
    return {{"of", 0}, {"median", none}, {"ci95", none}, {"least", none}, {"greatest", none}};
  }
  return {{"of", values.size()},
          {"median", median_of(values)},
          {"ci95", {low, high}},
          {"least", *std::min_element(values.begin(), values.end())},
          {"greatest", *std::max_element(values.begin(), values.end())}};
}

using Cases = std::vector<const CaseScore*>;

Cases of_kind(const std::vector<CaseScore>& scores, std::string_view kind) {
  Cases out;
  for (const CaseScore& s : scores)
    if (s.track == "synthetic" && s.kind == kind) out.push_back(&s);
  return out;
}

/// Hidden where the given channels and the motion can show it.
bool fair(const CaseScore& s) {
  return s.excited && std::all_of(s.subjects.begin(), s.subjects.end(),
                                  [](const SubjectScore& e) { return e.testable; });
}
/// Judged by its size; an effect from outside of the vocabulary by the part that no known effect
/// imitates, because below that a known name is no mistake.
bool clear(const CaseScore& s) {
  return fair(s) && std::all_of(s.subjects.begin(), s.subjects.end(), [](const SubjectScore& e) {
           return (e.outside ? e.own_over_floor : e.size_over_floor) >= kClear;
         });
}

Share share_of(const Cases& cases, const std::function<bool(const CaseScore&)>& hit) {
  Share share;
  for (const CaseScore* s : cases) share.count(hit(*s));
  return share;
}

Cases only(const Cases& cases, const std::function<bool(const CaseScore&)>& keep) {
  Cases out;
  std::copy_if(cases.begin(), cases.end(), std::back_inserter(out),
               [&](const CaseScore* s) { return keep(*s); });
  return out;
}

/// Figures of cases with one hidden effect.
Json singles_json(const Cases& cases) {
  std::vector<double> overlap, error, removed;
  Share covered, limit;
  double sets = 0.0, named = 0.0;
  for (const CaseScore* s : cases) {
    const SubjectScore& e = s->subjects.front();
    if (s->set_size > 0) {
      sets += s->set_size;
      named += 1.0;
    }
    if (e.overlap) overlap.push_back(*e.overlap);
    if (e.parameter_error) error.push_back(*e.parameter_error);
    if (e.removed) removed.push_back(*e.removed);
    if (e.covered) covered.count(*e.covered);
    if (e.limit_kept) limit.count(*e.limit_kept);
  }
  const auto first = [](const CaseScore& s) -> const SubjectScore& { return s.subjects.front(); };
  const Cases apart =
      only(cases, [&](const CaseScore& s) { return first(s).own_over_floor >= 1.0; });
  return {
      {"cases", cases.size()},
      {"top1", json_of(share_of(cases, [](const CaseScore& s) { return s.top1; }))},
      {"top1_where_nothing_imitates",
       json_of(share_of(apart, [](const CaseScore& s) { return s.top1; }))},
      {"named_at_all",
       json_of(share_of(cases, [&](const CaseScore& s) { return first(s).named; }))},
      {"set", json_of(share_of(cases, [&](const CaseScore& s) { return first(s).in_a_set; }))},
      {"mean_set_size", named > 0.0 ? Json(sets / named) : Json()},
      {"exact", json_of(share_of(cases, [](const CaseScore& s) { return s.exact; }))},
      {"silent", json_of(share_of(cases, [](const CaseScore& s) { return !s.alarm; }))},
      {"joint", json_of(share_of(cases, [&](const CaseScore& s) { return first(s).joint_hit; }))},
      {"stage", json_of(share_of(cases, [&](const CaseScore& s) { return first(s).stage_hit; }))},
      {"withdrawn", json_of(share_of(cases,
                                     [&](const CaseScore& s) {
                                       return first(s).flagged_here && !first(s).in_a_set;
                                     }))},
      {"interval_overlap", json_of(overlap)},
      {"parameter_error", json_of(error)},
      {"coverage", json_of(covered)},
      {"excess_removed", json_of(removed)},
      {"limit_kept", json_of(limit)}};
}

Json baselines_json(const Cases& controls, const Cases& singles, const Cases& pairs) {
  Json out = Json::object();
  if (controls.empty() && singles.empty()) return out;
  const auto& methods = (controls.empty() ? singles : controls).front()->baselines;
  for (std::size_t m = 0; m < methods.size(); ++m) {
    const auto of = [m](const CaseScore& s) {
      return s.baselines.size() > m ? &s.baselines[m] : nullptr;
    };
    std::vector<double> removed;
    double named = 0.0;
    for (const CaseScore* s : singles) {
      if (of(*s) == nullptr) continue;
      named += of(*s)->named;
      if (of(*s)->removed) removed.push_back(*of(*s)->removed);
    }
    Share recall;
    for (const CaseScore* s : pairs) {
      for (int k = 0; of(*s) != nullptr && k < 2; ++k) recall.count(k < of(*s)->right);
    }
    const auto share = [&](const Cases& cases,
                           const std::function<bool(const BaselineScore&)>& hit) {
      if (!methods[m].names) return Json();
      return json_of(
          share_of(cases, [&](const CaseScore& s) { return of(s) != nullptr && hit(*of(s)); }));
    };
    out[methods[m].method] = {
        {"false_alarms", share(controls, [](const BaselineScore& b) { return b.named > 0; })},
        {"right_among_names", share(singles, [](const BaselineScore& b) { return b.right > 0; })},
        {"exact",
         share(singles, [](const BaselineScore& b) { return b.right == 1 && b.named == 1; })},
        {"mean_names", singles.empty() || !methods[m].names
                           ? Json()
                           : Json(named / static_cast<double>(singles.size()))},
        {"pair_recall", methods[m].names ? json_of(recall) : Json()},
        {"excess_removed", json_of(removed)}};
  }
  return out;
}

Json confusion_json(const Cases& singles, const Cases& outside) {
  std::map<std::string, std::map<std::string, int>> table;
  for (const Cases* list : {&singles, &outside}) {
    for (const CaseScore* s : *list) {
      const bool wrong_place = s->physics && !s->top1 && s->top1_id == s->subjects.front().id;
      ++table[s->subjects.front().id][wrong_place ? s->top1_id + " elsewhere" : s->top1_id];
    }
  }
  return table;
}

Json target(const std::string& words, const std::string& figure, Json value, bool enough,
            bool met) {
  return {{"target", words},
          {"figure", figure},
          {"value", std::move(value)},
          {"verdict", !enough ? "no cases"
                      : met   ? "met"
                              : "not met"}};
}

std::string percent(const Share& s) {
  if (s.of == 0) return "no cases";
  const auto [low, high] = wilson(s);
  return fmt::format("{:.1f} % ({} of {}; 95 % between {:.1f} and {:.1f})", 100.0 * s.value(),
                     s.hits, s.of, 100.0 * low, 100.0 * high);
}

struct Groups {
  Cases controls, singles, pairs, outside, parameters;
};

Json targets_json(const Groups& g) {
  const Cases singles = only(g.singles, clear), pairs = only(g.pairs, clear),
              outside = only(g.outside, clear);
  const Share alarms = share_of(g.controls, [](const CaseScore& s) { return s.alarm; });
  const Share top1 = share_of(singles, [](const CaseScore& s) { return s.top1; });
  const Share sets =
      share_of(singles, [](const CaseScore& s) { return s.subjects.front().in_a_set; });
  const Share exact = share_of(pairs, [](const CaseScore& s) { return s.exact; });
  Share recall, covered;
  for (const CaseScore* s : pairs)
    for (const SubjectScore& e : s->subjects) recall.count(e.named);
  const Share flagged =
      share_of(outside, [](const CaseScore& s) { return s.subjects.front().flagged_here; });
  const Share withdrawn = share_of(singles, [](const CaseScore& s) {
    return s.subjects.front().flagged_here && !s.subjects.front().in_a_set;
  });
  const Share called =
      share_of(g.parameters, [](const CaseScore& s) { return s.physics || s.failed; });
  std::vector<double> overlap, removed;
  double set_sum = 0.0, named = 0.0;
  for (const Cases* list : {&singles, &outside})
    for (const CaseScore* s : *list)
      if (s->subjects.front().overlap) overlap.push_back(*s->subjects.front().overlap);
  for (const CaseScore* s : g.singles)
    if (s->subjects.front().covered) covered.count(*s->subjects.front().covered);
  for (const CaseScore* s : singles) {
    if (s->subjects.front().removed) removed.push_back(*s->subjects.front().removed);
    if (s->set_size == 0) continue;
    set_sum += s->set_size;
    named += 1.0;
  }
  const double upper = clopper_pearson_upper(alarms),
               set_size = named > 0.0 ? set_sum / named : 0.0;
  Json out = Json::array();
  out.push_back(target("false alarms: upper end of the 95 % interval at most 5 %",
                       fmt::format("{}; exact upper end {:.1f} %", percent(alarms), 100.0 * upper),
                       upper, alarms.of > 0, upper <= 0.05));
  out.push_back(target("strongest name right in at least 95 % at 3 times the floor", percent(top1),
                       top1.value(), top1.of > 0, top1.value() >= 0.95));
  out.push_back(target("right name in the set in at least 97 %, sets of at most 1.6 names",
                       fmt::format("{}; mean set {:.2f}", percent(sets), set_size), sets.value(),
                       sets.of > 0, sets.value() >= 0.97 && set_size <= 1.6));
  out.push_back(target("two effects named exactly in at least 70 %", percent(exact), exact.value(),
                       exact.of > 0, exact.value() >= 0.70));
  out.push_back(target("of two effects at least 90 % found", percent(recall), recall.value(),
                       recall.of > 0, recall.value() >= 0.90));
  out.push_back(target("at least 90 % of what is outside of the vocabulary flagged",
                       percent(flagged), flagged.value(), flagged.of > 0, flagged.value() >= 0.90));
  out.push_back(target("at most 5 % of right names withdrawn", percent(withdrawn),
                       withdrawn.value(), withdrawn.of > 0, withdrawn.value() <= 0.05));
  out.push_back(target("median overlap of intervals at least 0.7",
                       overlap.empty()
                           ? "no cases"
                           : fmt::format("{:.2f} (of {})", median_of(overlap), overlap.size()),
                       median_of(overlap), !overlap.empty(), median_of(overlap) >= 0.7));
  out.push_back(target(
      "median excess removed on held-out runs at least 95 %",
      removed.empty() ? "no cases"
                      : fmt::format("{:.1f} % (of {})", 100.0 * median_of(removed), removed.size()),
      median_of(removed), !removed.empty(), median_of(removed) >= 0.95));
  out.push_back(target("95 % intervals hold the truth in 90 to 98 %", percent(covered),
                       covered.value(), covered.of > 0,
                       covered.value() >= 0.90 && covered.value() <= 0.98));
  out.push_back(target("at most 5 % of parameters out of tolerance called physics", percent(called),
                       called.value(), called.of > 0, called.value() <= 0.05));
  return out;
}

Json case_json(const CaseScore& s) {
  Json hidden = Json::array(), names = Json::array();
  for (const SubjectScore& e : s.subjects)
    hidden.push_back({{"id", e.id},
                      {"joint", e.joint},
                      {"size_over_floor", e.size_over_floor},
                      {"own_over_floor", e.own_over_floor},
                      {"imitated_by", e.imitated_by},
                      {"testable", e.testable},
                      {"named", e.named},
                      {"in_a_set", e.in_a_set}});
  for (const Name& n : s.names)
    names.push_back({{"id", n.id},
                     {"joint", n.joint},
                     {"stage", n.stage},
                     {"parameter", n.parameter},
                     {"ambiguous_with", n.ambiguous_with}});
  return {{"case", s.number},
          {"track", s.track},
          {"kind", s.kind},
          {"robot", s.robot},
          {"world", s.laws},
          {"motion", s.motion},
          {"excited", s.excited},
          {"hidden", hidden},
          {"verdict", s.failed ? "no report" : s.verdict},
          {"names", names},
          {"flagged", s.flagged},
          {"diagnose_s", s.diagnose_s}};
}

Json real_json(const std::vector<CaseScore>& scores) {
  Json out = Json::array();
  for (const CaseScore& s : scores) {
    if (s.track == "synthetic") continue;
    Json hidden = Json::array();
    for (const SubjectScore& e : s.subjects) {
      hidden.push_back({{"id", e.id},
                        {"joint", e.joint},
                        {"named", e.named},
                        {"in_a_set", e.in_a_set},
                        {"parameter_error", e.parameter_error ? Json(*e.parameter_error) : Json()},
                        {"covered", e.covered ? Json(*e.covered) : Json()},
                        {"interval_overlap", e.overlap ? Json(*e.overlap) : Json()}});
    }
    out.push_back({{"case", s.number},
                   {"track", s.track},
                   {"recording", s.robot},
                   {"hidden", hidden},
                   {"verdict", s.failed ? "no report" : s.verdict},
                   {"top1", s.top1_id}});
  }
  return out;
}

}  // namespace

Json tally(const std::vector<CaseScore>& scores) {
  const Groups g{of_kind(scores, "control"), of_kind(scores, "single"), of_kind(scores, "pair"),
                 of_kind(scores, "outside"), of_kind(scores, "parameter")};
  Json by_size = Json::object();
  for (const auto& [name, bounds] : kSizes) {
    by_size[name] = singles_json(only(g.singles, [&b = bounds](const CaseScore& s) {
      const double size = s.subjects.front().size_over_floor;
      return fair(s) && size >= b.first && size < b.second;
    }));
  }
  const Cases clear_pairs = only(g.pairs, clear);
  Share recall;
  for (const CaseScore* s : clear_pairs)
    for (const SubjectScore& e : s->subjects) recall.count(e.named);
  double generate_s = 0.0, diagnose_s = 0.0;
  int failed = 0;
  Json cases = Json::array();
  for (const CaseScore& s : scores) {
    generate_s += s.generate_s;
    diagnose_s += s.diagnose_s;
    failed += s.failed ? 1 : 0;
    cases.push_back(case_json(s));
  }
  const double per_hundred =
      scores.empty() ? 0.0 : 100.0 / static_cast<double>(scores.size()) / 60.0 / 2.0;
  Json proof = {
      {"schema", 1},
      {"cases", scores.size()},
      {"without_report", failed},
      {"cpu_minutes_per_hundred_on_two_cores",
       {{"generate", generate_s * per_hundred}, {"diagnose", diagnose_s * per_hundred}}},
      {"targets", targets_json(g)},
      {"controls",
       {{"any_finding", json_of(share_of(g.controls, [](const CaseScore& s) { return s.alarm; }))},
        {"any_finding_exact_upper",
         clopper_pearson_upper(share_of(g.controls, [](const CaseScore& s) { return s.alarm; }))},
        {"physics_named",
         json_of(share_of(g.controls, [](const CaseScore& s) { return s.physics; }))},
        {"unknown", json_of(share_of(g.controls, [](const CaseScore& s) { return s.flagged; }))}}},
      {"one_effect",
       {{"by_size_over_floor", by_size},
        {"at_3_floors_and_more", singles_json(only(g.singles, clear))},
        {"not_testable_or_not_excited", g.singles.size() - only(g.singles, fair).size()}}},
      {"two_effects",
       {{"cases", clear_pairs.size()},
        {"exact", json_of(share_of(clear_pairs, [](const CaseScore& s) { return s.exact; }))},
        {"recall", json_of(recall)}}},
      {"outside",
       {{"cases", g.outside.size()},
        {"which_nothing_imitates", only(g.outside, clear).size()},
        {"flagged",
         json_of(share_of(only(g.outside, clear),
                          [](const CaseScore& s) { return s.subjects.front().flagged_here; }))},
        {"called_something_known",
         json_of(share_of(only(g.outside, clear), [](const CaseScore& s) { return s.physics; }))}}},
      {"parameters",
       {{"found",
         json_of(share_of(g.parameters, [](const CaseScore& s) { return s.parameter_found; }))},
        {"called_physics",
         json_of(
             share_of(g.parameters, [](const CaseScore& s) { return s.physics || s.failed; }))}}},
      {"reliability", reliability_json(scores)},
      {"confusion", confusion_json(only(g.singles, clear), only(g.outside, clear))},
      {"baselines", baselines_json(g.controls, only(g.singles, clear), clear_pairs)},
      {"real", real_json(scores)},
      {"case_list", cases}};
  return proof;
}

std::string targets_text(const Json& proof) {
  std::string text;
  for (const Json& t : proof["targets"]) {
    text += fmt::format("{:<8} {}\n         {}\n", t["verdict"].get<std::string>(),
                        t["target"].get<std::string>(), t["figure"].get<std::string>());
  }
  return text;
}

}  // namespace ravencal::prove
