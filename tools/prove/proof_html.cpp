// SPDX-License-Identifier: Apache-2.0
#include "prove/proof_html.hpp"

#include <algorithm>
#include <map>
#include <set>

#include "prove/reliability.hpp"
#include "prove/workspace.hpp"
#include "prove/worlds.hpp"
#include "report/escape.hpp"

namespace ravencal::prove {
namespace {

using report::html_escape;

// Colours of Okabe and Ito, as on the other pages.
constexpr const char* kStyle = R"(<style>
:root{--paper:#fff;--ink:#1b1f24;--quiet:#59626d;--rule:#c3c9d0;--grid:#e6e9ec;--good:#0072b2;--bad:#d55e00;--bar:#9aa2ab}
@media screen and (prefers-color-scheme:dark){:root{--paper:#14171a;--ink:#e4e7ea;--quiet:#9aa4ae;--rule:#4a525b;--grid:#2a3036;--good:#56b4e9;--bad:#ee7b30;--bar:#7d868f}}
html{color-scheme:light dark}body{margin:0 auto;padding:1.5rem 1.25rem 3rem;max-width:1140px;background:var(--paper);color:var(--ink);font:15px/1.5 system-ui,"Segoe UI","Noto Sans","Liberation Sans",sans-serif}
h1{margin:0;font-size:1.6rem;font-weight:650}h2{margin:2.2rem 0 .5rem;padding-top:.7rem;border-top:1px solid var(--rule);font-size:1.2rem;font-weight:650}
p{margin:.4rem 0;max-width:80ch}.quiet{color:var(--quiet);font-size:.87rem}
.verdict{margin:.9rem 0;padding-left:.8rem;border-left:3px solid var(--good);font-size:1.1rem}
.scroll{overflow-x:auto}table{border-collapse:collapse;font-size:.88rem;font-variant-numeric:tabular-nums}
th,td{padding:.28rem .55rem;text-align:left;vertical-align:top}th{font-weight:500;color:var(--quiet);border-bottom:1px solid var(--rule)}
tbody tr{border-bottom:1px solid var(--grid)}td.n{text-align:right;white-space:nowrap}tbody td:first-child{min-width:11rem}
.met{color:var(--good);font-weight:650;white-space:nowrap}.not{color:var(--bad);font-weight:650;white-space:nowrap}
svg text{fill:currentColor;font-size:11px}.heat{padding:.28rem .1rem;text-align:center;min-width:1.5rem}
.heads th{padding:.28rem .1rem;writing-mode:vertical-rl;transform:rotate(180deg);text-align:left;vertical-align:bottom}code{font-size:.82rem;overflow-wrap:anywhere}
</style>)";

std::string percent(const Json& share) {
  if (!share.is_object() || share.value("of", 0) == 0 || share["share"].is_null()) return "&ndash;";
  return fmt::format("{:.0f} % <span class=\"quiet\">({}/{})</span>",
                     100.0 * share["share"].get<double>(), share["hits"].get<int>(),
                     share["of"].get<int>());
}

std::string median(const Json& figure, double factor, const char* unit) {
  if (!figure.is_object() || figure.value("of", 0) == 0) return "&ndash;";
  return fmt::format("{:.2f}{}<br><span class=\"quiet\">{} to {:.2f}; {}</span>",
                     factor * figure["median"].get<double>(), unit,
                     fmt::format("{:.2f}", factor * figure["ci95"][0].get<double>()),
                     factor * figure["ci95"][1].get<double>(), figure["of"].get<int>());
}

std::string targets_html(const Json& proof) {
  std::string rows;
  for (const Json& t : proof["targets"]) {
    const std::string verdict = t["verdict"];
    rows += fmt::format("<tr><td class=\"{}\">{}</td><td>{}</td><td>{}</td></tr>",
                        verdict == "met"       ? "met"
                        : verdict == "not met" ? "not"
                                               : "quiet",
                        verdict, html_escape(t["target"].get<std::string>()),
                        html_escape(t["figure"].get<std::string>()));
  }
  return "<h2>Targets</h2><div "
         "class=\"scroll\"><table><thead><tr><th>verdict</th><th>target</th><th>measured</th></"
         "tr></thead><tbody>" +
         rows + "</tbody></table></div>";
}

/// Shares with intervals over the four sizes.
std::string size_chart(const Json& sizes) {
  constexpr double kWidth = 460, kHeight = 210, kLeft = 44, kTop = 14;
  struct Line {
    const char *key, *words, *colour;
    double shift;
  };
  constexpr Line kLines[] = {{"top1", "strongest name right", "var(--good)", -14.0},
                             {"set", "right name in a set", "var(--bar)", 0.0},
                             {"silent", "nothing found", "var(--bad)", 14.0}};
  const double plot = kHeight - kTop - 34.0;
  std::string out = fmt::format(
      "<svg viewBox=\"0 0 {} {}\" width=\"{}\" role=\"img\" aria-label=\"Shares by size of the "
      "hidden effect\">",
      kWidth, kHeight, kWidth);
  for (int g = 0; g <= 4; ++g) {
    const double y = kTop + plot * (1.0 - 0.25 * g);
    out += fmt::format(
        "<line x1=\"{}\" x2=\"{}\" y1=\"{}\" y2=\"{}\" stroke=\"var(--grid)\"/><text x=\"{}\" "
        "y=\"{}\" text-anchor=\"end\">{} %</text>",
        kLeft, kWidth, y, y, kLeft - 4, y + 4, 25 * g);
  }
  double x = kLeft + 55.0;
  for (const auto& [name, figures] : sizes.items()) {
    out += fmt::format("<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text>", x, kHeight - 20,
                       html_escape(name));
    for (const Line& line : kLines) {
      const Json& share = figures[line.key];
      if (share["share"].is_null()) continue;
      const double at = x + line.shift;
      const auto y = [&](double v) { return kTop + plot * (1.0 - v); };
      out += fmt::format(
          "<line x1=\"{0}\" x2=\"{0}\" y1=\"{1}\" y2=\"{2}\" stroke=\"{3}\" "
          "stroke-width=\"2\"/><circle cx=\"{0}\" cy=\"{4}\" r=\"4.5\" fill=\"{3}\"/>",
          at, y(share["ci95"][0].get<double>()), y(share["ci95"][1].get<double>()), line.colour,
          y(share["share"].get<double>()));
    }
    x += 105.0;
  }
  out += fmt::format(
      "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">size of the hidden effect over the "
      "floor</text></svg><p class=\"quiet\">",
      kLeft + 208, kHeight - 4);
  for (const Line& line : kLines)
    out +=
        fmt::format("<span style=\"color:{}\">&#9679;</span> {} &nbsp; ", line.colour, line.words);
  return out + "Lines are 95 % intervals.</p>";
}

std::string sizes_html(const Json& proof) {
  Json sizes = proof["one_effect"]["by_size_over_floor"];
  std::string html = "<h2>One hidden effect, by its size</h2>" + size_chart(sizes);
  sizes["3 and more"] = proof["one_effect"]["at_3_floors_and_more"];
  std::string head, rows;
  for (const auto& [name, figures] : sizes.items())
    head += fmt::format("<th>{} <span class=\"quiet\">({})</span></th>", html_escape(name),
                        figures["cases"].get<int>());
  const auto row = [&](const char* words, const auto& cell) {
    rows += fmt::format("<tr><td>{}</td>", words);
    for (const auto& [name, figures] : sizes.items())
      rows += "<td class=\"n\">" + cell(figures) + "</td>";
    rows += "</tr>";
  };
  for (const auto& [key, words] : std::initializer_list<std::pair<const char*, const char*>>{
           {"top1", "strongest name right"},
           {"top1_where_nothing_imitates", "the same where no other name fits as well"},
           {"named_at_all", "right name among all"},
           {"set", "right name in a set"},
           {"exact", "right name and no other"},
           {"silent", "nothing found"},
           {"joint", "joint right"},
           {"stage", "stage right"},
           {"withdrawn", "right name withdrawn"},
           {"coverage", "95 % interval holds the truth"},
           {"limit_kept", "silent and below the printed limit"}})
    row(words, [&k = key](const Json& f) { return percent(f[k]); });
  row("names in the strongest's set, mean", [](const Json& f) {
    return f["mean_set_size"].is_null() ? std::string("&ndash;")
                                        : fmt::format("{:.2f}", f["mean_set_size"].get<double>());
  });
  row("parameter error, median",
      [](const Json& f) { return median(f["parameter_error"], 100.0, " %"); });
  row("overlap of intervals, median",
      [](const Json& f) { return median(f["interval_overlap"], 1.0, ""); });
  row("excess removed on the held-out run, median",
      [](const Json& f) { return median(f["excess_removed"], 100.0, " %"); });
  return html + "<div class=\"scroll\"><table><thead><tr><th>size over floor (cases)</th>" + head +
         "</tr></thead><tbody>" + rows + "</tbody></table></div>";
}

/// What is not in the table by size.
std::string kinds_html(const Json& proof) {
  std::string rows;
  const auto row = [&rows](const char* hidden, const char* said, const Json& share) {
    rows += fmt::format("<tr><td>{}</td><td>{}</td><td class=\"n\">{}</td></tr>", hidden, said,
                        percent(share));
  };
  const Json &controls = proof["controls"], &pairs = proof["two_effects"],
             &outside = proof["outside"], &parameters = proof["parameters"];
  row("nothing", "anything found", controls["any_finding"]);
  row("nothing", "physics named", controls["physics_named"]);
  row("nothing", "something without a name", controls["unknown"]);
  row("a parameter out of tolerance", "that parameter", parameters["found"]);
  row("a parameter out of tolerance", "physics named", parameters["called_physics"]);
  row("two effects, each at 3 floors and more", "both and nothing else", pairs["exact"]);
  row("two effects, each at 3 floors and more", "either", pairs["recall"]);
  row("outside of the vocabulary", "something without a name there", outside["flagged"]);
  row("outside of the vocabulary", "physics named", outside["called_something_known"]);
  return fmt::format(
      "<h2>Cases with no effect, a wrong parameter, two effects, an unknown effect</h2><div "
      "class=\"scroll\"><table>"
      "<thead><tr><th>hidden</th><th>said</th><th>cases</th></tr></thead><tbody>{}</tbody></table>"
      "</div><p class=\"quiet\">Of {} effects from outside of the vocabulary {} count: of the "
      "others, parameters and one known effect imitate all but 3 floors.</p>",
      rows, outside["cases"].get<int>(), outside["which_nothing_imitates"].get<int>());
}

std::string confusion_html(const Json& proof) {
  const Json& table = proof["confusion"];
  std::set<std::string> said;
  for (const auto& [truth, row] : table.items())
    for (const auto& [name, count] : row.items()) said.insert(name);
  if (said.empty()) return "";
  std::set<std::string> outside;
  for (const Json& item : proof["case_list"])
    if (item["kind"] == "outside") outside.insert(item["hidden"].front()["id"].get<std::string>());
  const auto right = [&outside](const std::string& truth, const std::string& name) {
    return name == truth || (name == "unknown" && outside.count(truth) > 0);
  };
  std::string head, rows;
  for (const std::string& name : said) head += fmt::format("<th>{}</th>", html_escape(name));
  for (const auto& [truth, row] : table.items()) {
    rows += fmt::format("<tr><td>{}</td>", html_escape(truth));
    for (const std::string& name : said) {
      const int count = row.value(name, 0);
      rows += count == 0 ? "<td class=\"heat\"></td>"
                         : fmt::format(
                               "<td class=\"heat\" style=\"background:color-mix(in srgb,var({}) "
                               "{}%,transparent)\">{}</td>",
                               right(truth, name) ? "--good" : "--bad",
                               std::min(70, 20 + 15 * count), count);
    }
    rows += "</tr>";
  }
  return "<h2>Confusion of effects</h2><p class=\"quiet\">Rows: the hidden effect, at 3 times the "
         "floor and more. Columns: the strongest name; &quot;unknown&quot; is right "
         "for what is outside of the vocabulary.</p><div class=\"scroll\"><table><thead "
         "class=\"heads\"><tr><th></th>" +
         head + "</tr></thead><tbody>" + rows + "</tbody></table></div>";
}

std::string others_html(const Json& proof) {
  std::string rows;
  const auto row = [&](const std::string& name, const std::initializer_list<std::string>& cells) {
    rows += "<tr><td>" + html_escape(name) + "</td>";
    for (const std::string& cell : cells) rows += "<td class=\"n\">" + cell + "</td>";
    rows += "</tr>";
  };
  const Json& singles = proof["one_effect"]["at_3_floors_and_more"];
  row("ravencal diagnose",
      {percent(proof["controls"]["any_finding"]), percent(singles["named_at_all"]),
       percent(singles["exact"]), percent(proof["two_effects"]["recall"]),
       median(singles["excess_removed"], 100.0, " %")});
  for (const auto& [name, b] : proof["baselines"].items())
    row(name, {percent(b["false_alarms"]), percent(b["right_among_names"]), percent(b["exact"]),
               percent(b["pair_recall"]), median(b["excess_removed"], 100.0, " %")});
  return "<h2>Other methods on the same cases</h2><div "
         "class=\"scroll\"><table><thead><tr><th>method</th><th>false alarms</th><th>right name "
         "among all</th><th>right name and no other</th><th>found of two effects</th><th>excess "
         "removed, median</th></tr></thead><tbody>" +
         rows + "</tbody></table></div>";
}

std::string real_html(const Json& proof) {
  if (proof["real"].empty())
    return "<h2>On real recordings</h2><p>Not tried: no recordings were given (--data).</p>";
  std::string rows;
  for (const Json& r : proof["real"]) {
    const Json& h = r["hidden"][0];
    const bool named = h["named"], in_set = h["in_a_set"];
    rows += fmt::format(
        "<tr><td>{}</td><td>{}</td><td>{} / {}</td><td class=\"{}\">{}</td><td "
        "class=\"n\">{}</td><td class=\"n\">{}</td></tr>",
        html_escape(r["track"].get<std::string>()), html_escape(r["recording"].get<std::string>()),
        html_escape(h["joint"].get<std::string>()), html_escape(h["id"].get<std::string>()),
        named || in_set ? "met" : "not",
        named    ? "named"
        : in_set ? "in a set"
                 : "missed",
        h["parameter_error"].is_null()
            ? "&ndash;"
            : fmt::format("{:.1f} %", 100.0 * h["parameter_error"].get<double>()),
        h["interval_overlap"].is_null()
            ? "&ndash;"
            : fmt::format("{:.2f}", h["interval_overlap"].get<double>()));
  }
  return "<h2>On real recordings</h2><p class=\"quiet\">Ablated: the plant lacks a term that the "
         "robot has. Injected: an effect was added to the recording, on top of what the "
         "robot has of it.</p><div "
         "class=\"scroll\"><table><thead><tr><th>track</th><th>recording</th><th>joint / "
         "effect</th><th>verdict</th><th>value off by</th><th>overlap in "
         "time</th></tr></thead><tbody>" +
         rows + "</tbody></table></div>";
}

std::string cases_html(const Json& proof) {
  std::string rows;
  for (const Json& c : proof["case_list"]) {
    std::string hidden, names;
    for (const Json& h : c["hidden"])
      hidden +=
          fmt::format("{} / {} <span class=\"quiet\">{:.1f}</span><br>",
                      html_escape(h["joint"].get<std::string>()),
                      html_escape(h["id"].get<std::string>()), h["size_over_floor"].get<double>());
    for (const Json& n : c["names"])
      names += fmt::format("{} / {}{}<br>", html_escape(n["joint"].get<std::string>()),
                           html_escape(n["id"].get<std::string>()),
                           n["parameter"].get<bool>() ? " (parameter)" : "");
    rows += fmt::format(
        "<tr><td "
        "class=\"n\">{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td></"
        "tr>",
        c["case"].get<int>(), html_escape(c["kind"].get<std::string>()),
        html_escape(c["robot"].get<std::string>()), html_escape(c["motion"].get<std::string>()),
        hidden, html_escape(c["verdict"].get<std::string>()), names);
  }
  return "<h2>Every case</h2><details><summary>Show all</summary><div "
         "class=\"scroll\"><table><thead><tr><th>case</th><th>kind</th><th>robot</th><th>motion</"
         "th><th>hidden (size over floor)</th><th>verdict</th><th>names</th></tr></thead><tbody>" +
         rows + "</tbody></table></div></details>";
}

}  // namespace

std::string proof_html(const Json& proof) {
  int met = 0, all = 0;
  for (const Json& t : proof["targets"]) {
    met += t["verdict"] == "met" ? 1 : 0;
    all += 1;
  }
  const Json& cost = proof["cpu_minutes_per_hundred_on_two_cores"];
  std::string seal;
  if (proof.contains("seal")) {
    seal = fmt::format(
        "<p class=\"quiet\">Sealed before the run: Merkle root <code>{}</code>, tool SHA-256 "
        "<code>{}</code>. Every hash was checked before scoring. Seed {}.</p>",
        html_escape(proof["seal"]["merkle_root"].get<std::string>()),
        html_escape(proof["seal"]["tool_sha256"].get<std::string>()), proof["seal"]["seed"].dump());
  }
  if (proof.contains("leak_test")) {
    const Json& leak = proof["leak_test"];
    seal += fmt::format(
        "<p class=\"quiet\">Leak test: a classifier on form and moments tells vanishing effects "
        "from none in {:.0f} % of {} pairs (95 % between {:.0f} and {:.0f} %): {}.</p>",
        100.0 * leak["accuracy"].get<double>(), leak["pairs"].get<int>(),
        100.0 * leak["ci95"][0].get<double>(), 100.0 * leak["ci95"][1].get<double>(),
        leak["at_chance"].get<bool>() ? "chance"
                                      : "NOT chance: the form of the cases reveals their content");
  }
  return fmt::format(
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta "
      "http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src "
      "'unsafe-inline'\"><meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">"
      "<title>ravencal prove</title>{}</head><body><h1>Blind proof of ravencal diagnose</h1><p "
      "class=\"verdict\">{} of {} targets met on {} cases; {} gave no report.</p>{}"
      "<p class=\"quiet\">Processor time per hundred cases over two cores: {:.1f} min to make "
      "them, {:.1f} min to diagnose.</p>{}{}{}{}{}{}{}{}</body></html>\n",
      kStyle, met, all, proof["cases"].get<int>(), proof["without_report"].get<int>(), seal,
      cost["generate"].get<double>(), cost["diagnose"].get<double>(),
      targets_html(proof) + worlds_html(proof), sizes_html(proof), kinds_html(proof),
      others_html(proof), reliability_html(proof["reliability"]), confusion_html(proof),
      real_html(proof), cases_html(proof));
}

}  // namespace ravencal::prove
