// SPDX-License-Identifier: Apache-2.0
//
// The page of a blind proof, drawn from its proof.json: the targets first, then figures by size and
// kind, other methods, real recordings, every case.
"use strict";

const proof = JSON.parse(document.getElementById("data").textContent);

const soft = (text) => element("span.soft", text);
const hits = (part) => (part?.of ? [share(part.share), " ", soft(`(${part.hits}/${part.of})`)] : "–");
const effect = ({ joint, id }) => `${joint} / ${id}`;

function verdict_mark(verdict, text = verdict) {
  return element({ met: "span.strong", "not met": "span.worse" }[verdict] ?? "span.soft", text);
}

function median(spread, factor, unit) {
  if (!spread?.of) return "–";
  const [low, high] = spread.ci95.map((end) => fixed(factor * end, 2));
  return [`${fixed(factor * spread.median, 2)}${unit}`, element("br"), soft(`${low} to ${high}; ${spread.of}`)];
}

// Rows with a heading each; a wide table scrolls.
const titled = (header, rows, kind = "table") =>
  element("div.scroll", table(header, rows.map(([title, ...cells]) => [row_header(title), ...cells]), kind));

// ------------------------------------------------------------------ targets

const targets = () => table(["verdict", "target", "measured"],
  proof.targets.map(({ target, figure: measured, verdict }) => [verdict_mark(verdict), target, measured]));

function worlds() {
  const shown = Object.entries(proof.worlds ?? {});
  if (!shown.length) return [];
  return [note("The worlds move the robot by different laws of friction, cable and servo."),
    table(["target (cases)", ...shown.map(([world, { cases }]) => [world, " ", soft(`(${cases})`)]).map((text) => element("th", text))],
      proof.targets.map(({ target }, t) => [target, ...shown.map(([, world]) =>
        verdict_mark(world.targets[t].verdict, world.targets[t].figure))]))];
}

// ------------------------------------------------------------------ one effect by its size

const sizes = Object.entries(proof.one_effect.by_size_over_floor);
const size_lines = [["top1", "after", "strongest name right"], ["set", "recorded", "right name in a set"],
  ["silent", "before", "nothing found"]];

function size_chart() {
  const [width, height] = [460, 190];
  const data = Object.fromEntries(size_lines.map(([name], i) => [name, sizes.flatMap(([, figures], size) => {
    const { share: part, ci95: [low, high] } = figures[name];
    return part === null ? [] : [{ at: size + 0.14 * (i - 1), value: 100 * part, low: 100 * low, high: 100 * high }];
  })]));
  const marks = size_lines.flatMap(([name, colour]) => {
    const [x, from, stroke] = [at("x", "at"), { data: name }, colours[colour]];
    return [mark("rule", { x, y: at("y", "low"), y2: at("y", "high"), stroke, strokeWidth: 2 }, { from }),
      mark("symbol", { x, y: at("y", "value"), fill: stroke, size: 60 }, { from })];
  });
  const words = sizes.map(([size], i) => text_mark({ scale: "x", value: i }, height + 14, size, { align: "center" }));
  return chart("shares by size of the hidden effect", width, height + 40, data, [
    panel([0, 0, width, height], [-0.5, sizes.length - 0.5], [0, 100], [axis("left", "cases [%]")], [...marks, ...words]),
    text_mark(width / 2, height + 32, "size of the hidden effect over the floor", { align: "center" }),
  ]);
}

const meanings = note("A floor is the error that noise alone leaves in a channel; the strongest name is the one that takes " +
  "most off the error.");

function size_table() {
  const columns = [...sizes, ["3 and more", proof.one_effect.at_3_floors_and_more]];
  const row = (title, cell) => [title, ...columns.map(([, figures]) => cell(figures))];
  const counted = [["top1", "strongest name right"], ["top1_where_nothing_imitates", "the same where no other name fits as well"],
    ["named_at_all", "right name among all"], ["set", "right name in a set"], ["exact", "right name and no other"],
    ["silent", "nothing found"], ["joint", "joint right"], ["stage", "stage right"], ["withdrawn", "right name withdrawn"],
    ["coverage", "95 % interval holds the truth"], ["limit_kept", "silent and below the printed limit"]];
  return titled(["size over floor (cases)", ...columns.map(([size, { cases }]) => `${size} (${cases})`)], [
    ...counted.map(([name, title]) => row(title, (figures) => hits(figures[name]))),
    row("names in the strongest's set, mean", ({ mean_set_size }) => mean_set_size === null ? "–" : fixed(mean_set_size, 2)),
    row("parameter error, median", ({ parameter_error }) => median(parameter_error, 100, " %")),
    row("overlap of intervals, median", ({ interval_overlap }) => median(interval_overlap, 1, "")),
    row("excess removed on the held-out run, median", ({ excess_removed }) => median(excess_removed, 100, " %")),
  ]);
}

// ------------------------------------------------------------------ the other figures

function kinds() {
  const { controls, parameters, two_effects, outside } = proof;
  const pair = "two effects, each at 3 floors and more";
  return [table(["hidden", "said", "cases"], [
    ["nothing", "anything found", hits(controls.any_finding)],
    ["nothing", "physics named", hits(controls.physics_named)],
    ["nothing", "something without a name", hits(controls.unknown)],
    ["a parameter out of tolerance", "that parameter", hits(parameters.found)],
    ["a parameter out of tolerance", "physics named", hits(parameters.called_physics)],
    [pair, "both and nothing else", hits(two_effects.exact)],
    [pair, "either", hits(two_effects.recall)],
    ["outside of the vocabulary", "something without a name there", hits(outside.flagged)],
    ["outside of the vocabulary", "physics named", hits(outside.called_something_known)],
  ]), note(`Of ${outside.cases} effects from outside of the vocabulary ${outside.which_nothing_imitates} count: of the ` +
    "others, parameters and one known effect imitate all but 3 floors.")];
}

function others() {
  const ours = proof.one_effect.at_3_floors_and_more;
  const row = (name, excess, ...shares) => [name, ...shares.map(hits), median(excess, 100, " %")];
  return titled(["method", "false alarms", "right name among all", "right name and no other", "found of two effects",
    "excess removed, median"], [
    row("ravencal diagnose", ours.excess_removed, proof.controls.any_finding, ours.named_at_all, ours.exact,
      proof.two_effects.recall),
    ...Object.entries(proof.baselines).map(([name, one]) =>
      row(name, one.excess_removed, one.false_alarms, one.right_among_names, one.exact, one.pair_recall)),
  ]);
}

function reliability() {
  const rows = proof.reliability.map(({ world, from, to, said, mean_said, share_there, ci95: [low, high] }) =>
    [world, `${fixed(100 * from, 0)} to ${share(to)}`, said, share(mean_said, 1),
      [share(share_there, 1), " ", soft(`(${fixed(100 * low, 0)} to ${fixed(100 * high, 0)})`)]]);
  return rows.length ? [note("Names of physics by the probability that the report gives them, and how many of those " +
    "effects were hidden at that joint."), titled(["world", "said with", "names", "mean said", "there"], rows)] : [];
}

function confusion() {
  const rows = Object.entries(proof.confusion);
  const said = [...new Set(rows.flatMap(([, names]) => Object.keys(names)))].sort();
  if (!said.length) return [];
  const outside = new Set(proof.case_list.filter(({ kind }) => kind === "outside").map(({ hidden }) => hidden[0].id));
  const cell = (truth, name, count) => {
    if (!count) return "";
    const right = name === truth || (name === "unknown" && outside.has(truth));
    const made = element("td.tint", count);
    made.style.setProperty("--share", Math.min(1, 0.3 + 0.2 * count).toFixed(1));
    if (right) made.style.setProperty("--tint", "var(--corrected)");
    return made;
  };
  return [note("Rows: the hidden effect, at 3 times the floor and more. Columns: the strongest name; \"unknown\" is right " +
    "for what is outside of the vocabulary. Blue: right."),
  titled(["", ...said], rows.map(([truth, names]) => [truth, ...said.map((name) => cell(truth, name, names[name]))]),
    "table.upright")];
}

function real() {
  if (!proof.real.length) return [element("p", "Not tried: no recordings were given (--data).")];
  return [note("Ablated: the plant lacks a term that the robot has. Injected: an effect was added to the recording, on " +
    "top of what the robot has of it."),
  table(["track", "recording", "joint / effect", "verdict", "value off by", "overlap in time"],
    proof.real.map(({ track, recording, hidden: [one] }) => [track, recording, effect(one),
      verdict_mark(one.named || one.in_a_set ? "met" : "not met", one.named ? "named" : one.in_a_set ? "in a set" : "missed"),
      one.parameter_error === null ? "–" : share(one.parameter_error, 1),
      one.interval_overlap === null ? "–" : fixed(one.interval_overlap, 2)]))];
}

const cases = () => table(["case", "kind", "robot", "motion", "hidden (size over floor)", "verdict", "names"],
  proof.case_list.map((one) => [one.case, one.kind, one.robot, one.motion,
    lines(one.hidden.map((hidden) => element("span", effect(hidden), " ", soft(fixed(hidden.size_over_floor, 1))))),
    one.verdict, lines(one.names.map((name) => effect(name) + (name.parameter ? " (parameter)" : "")))]));

function trust() {
  const { seal, leak_test: leak, cpu_minutes_per_hundred_on_two_cores: cost } = proof;
  return [
    seal ? note(`Sealed before the run: Merkle root ${seal.merkle_root}, tool SHA-256 ${seal.tool_sha256}. Every hash was ` +
      `checked before scoring. Seed ${seal.seed}.`) : "",
    leak ? note(`Leak test: a classifier on form and moments tells vanishing effects from none in ${share(leak.accuracy)} of ` +
      `${leak.pairs} pairs (95 % between ${leak.ci95.map((end) => share(end)).join(" and ")}): `,
    leak.at_chance ? "chance." : element("span.worse", "not chance: the form of the cases reveals their content.")) : "",
    note(`Processor time per hundred cases over two cores: ${fixed(cost.generate, 1)} min to make them, ` +
      `${fixed(cost.diagnose, 1)} min to diagnose.`),
  ];
}

// ------------------------------------------------------------------ the page

const met = proof.targets.filter(({ verdict }) => verdict === "met").length;
show_page("", `${met} of ${proof.targets.length} targets met on ${proof.cases} cases; ${proof.without_report} gave no report.`,
  trust(), [
    ["targets", "Targets", targets()],
    ["worlds", "By world", worlds()],
    ["sizes", "One hidden effect, by its size", figure(size_chart(), "Shares of cases", "Lines are 95 % intervals."),
      key(size_lines.map(([, colour, words]) => ["solid", 4, colour, words])), meanings, size_table()],
    ["kinds", "Cases with no effect, a wrong parameter, two effects, an unknown effect", kinds()],
    ["others", "Other methods on the same cases", others()],
    ["reliability", "Do probabilities mean what they say?", reliability()],
    ["confusion", "Confusion of effects", confusion()],
    ["real", "On real recordings", real()],
    ["cases", "Every case", folded("Show all", cases())],
  ]);
