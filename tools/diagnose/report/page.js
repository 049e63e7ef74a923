// SPDX-License-Identifier: Apache-2.0
//
// The page of a diagnosis, drawn from its report.json: what to know first, then the causes, then what
// to do, then the rest.
"use strict";

const report = JSON.parse(document.getElementById("data").textContent);

const in_words = (id) => id.replaceAll("_", " ");
const place = ({ joint, stage }) => `${joint}, ${stage}`;
const is_worse = ({ before, after }) => after > before;
// Rows of which the figures are.
const on_rows = report.looked_at.some(({ held_out_rows }) => held_out_rows > 0)
  ? "on motion that no fit saw" : "on the rows that were fitted";
const effects_of = (cause) => cause.effects.map((i) => report.effects[i]);

// ------------------------------------------------------------------ the first screen

// The figure that stands for a joint; undefined where none does.
const figure_of = (line) => report.held_out.find((h) => h.joint === line.joint && h.metric === line.metric);

function joint_lines() {
  return element("dl.joints", report.joints.map((line) => {
    const figure = figure_of(line);
    return [element("dt", line.joint), element(figure && is_worse(figure) ? "dd.worse" : "dd", line.sentence)];
  }));
}

function chain_cell(cell) {
  const tint = (value, part, kind) => {
    const made = element(kind, quantity(value, cell.unit));
    made.style.setProperty("--share", Math.min(part, 1).toFixed(3));
    return made;
  };
  const worse = is_worse(cell) ? ".worse" : "";
  const figure = cell.metric
    ? element("span.tints", tint(cell.before, cell.share_before, "span.tint"),
      tint(cell.after, cell.share_after, `span.tint${worse}`))
    : element("span.none", cell.without_figure);
  return [figure, cell.effects.length ? element("span.found", in_words(cell.effects.join(", "))) : ""];
}

// The chain of each joint, from the command to the sensor.
function chain() {
  const joints = [...new Set(report.chain.map(({ joint }) => joint))];
  const cells = joints.map((joint) => report.chain.filter((cell) => cell.joint === joint));
  const stages = (cells[0] ?? []).map(({ stage }) => (stage === "joint" ? "joint, run free for 1 s" : stage));
  const rows = cells.map((row, i) => [row_header(joints[i]), ...row.map(chain_cell)]);
  return [table(["", ...stages], rows, "table.chain"),
    note(`RMSE ${on_rows}, first of the plant as it is, then with what was found; colour: share of ` +
      "the squared error above the floor.")];
}

function held_out_chart() {
  const rows = report.joints.map(figure_of).filter((held_out) => Number.isFinite(held_out?.change)).map((held_out) => {
    const [value, low = null, high = null] = scaled([held_out.change, ...(held_out.change_ci95 ?? [])], 100);
    const label = `${held_out.joint}, ${held_out.figure}`;
    return { label, value, low, high, text: signed_share(held_out.change), worse: is_worse(held_out) };
  });
  return figure(
    rows.length && interval_chart(`change of the error ${on_rows}`, "change of the RMSE [%]", 0, 200, rows),
    `Error ${on_rows}`, "95 % intervals over stretches of time. Red: the improved plant is worse.");
}

function trace(channel, one) {
  const { name, factor } = display_unit(channel.unit);
  const is_effort = !one.motion.length;
  const [recorded, before, after] = [one.recorded, one.before, one.after].map((line) =>
    scaled(is_effort ? line : added(line, one.motion), factor));
  const recording = report.recordings[one.recording];
  const rows = one.cross_validated ? "Each row under a fit that did not see it."
    : one.fitted ? "Rows that were fitted: none were held out." : "Held-out rows.";
  const spec = trace_chart(`${place(channel)}: recorded and simulated`, one.t_s, recorded, before, after,
    `${is_effort ? "effort" : "position"} [${name}]`, `error [${name}]`);
  return element("div",
    figure(spec, place(channel) + (recording ? ` in ${recording.name}` : ""), `${rows} Error = simulated − recorded.`),
    key([["solid", 4, "recorded", "recorded"], ["dashed", 2, "before", "simulated before"],
      ["solid", 2, "after", "simulated after"]]));
}

// A trace of the channel that stands for the joint whose error was most above its floor.
function foremost_trace() {
  const excess = (channel) => {
    const held_out = report.joints.filter(({ joint }) => joint === channel.joint).map(figure_of)[0];
    const shows = held_out && (channel.stage === "transmission") === (held_out.metric === "position_rmse");
    return shows && channel.traces.length ? 1 - ((held_out.floor ?? 0) / held_out.before) ** 2 : -1;
  };
  const [first] = report.channels.filter((channel) => excess(channel) > -1).sort((a, b) => excess(b) - excess(a));
  return first && trace(first, first.traces[0]);
}

// ------------------------------------------------------------------ causes

// No recording makes a probability of one or zero, nor one by chance of zero.
const chance = (p) => (p !== null && p < 1e-4 ? "< 0.0001" : fixed(p, 4));
const probability_text = (p) => (p > 0.995 ? "over 99 %" : p < 0.01 ? "below 1 %" : share(p));

function evidence(effect) {
  const { held_out_before, held_out_after, held_out_share, rows, size, unit, p_value, invariance_spread } = effect.evidence;
  // What has no name cannot be taken out.
  const on = rows === "fitted" ? "on the rows that were fitted" : "on motion that no fit saw";
  const weight = effect.id === "unknown" ? [["without a name", quantity(size, unit)]] : [
    [`error of the improved plant ${on}, without it → with it`, change(held_out_before, held_out_after, unit)],
    held_out_before > 0 && ["its share of the squared error", share(held_out_share, 1)],
  ];
  const facts = [
    effect.probability !== undefined && ["probability", probability_text(effect.probability)],
    ...weight,
    ["p", chance(p_value)],
    ["differs between circumstances by", share(invariance_spread)],
  ];
  return element("dl.facts-line", facts.filter(Boolean).map(([name, value]) =>
    element("div", element("dt", name), element("dd", value))));
}

// Friction, play and elasticity only.
function sides({ sides: at }) {
  if (!at) return "";
  const places = [[at.encoder, "the motor's encoder"], [at.gearbox, "the gearbox"]].filter(([side]) => side !== "none");
  const decided = places.filter(([side]) => side !== "undecided").map(([side, of]) => `on the ${side}'s side of ${of}`);
  const open = places.filter(([side]) => side === "undecided").map(([, of]) => `on which side of ${of}`);
  return note([
    decided.length && `It sits ${decided.join(" and ")}.`,
    open.length && `These recordings do not show ${open.join(" and ")} it sits.`,
    at.decided_by && `To decide it: ${at.decided_by}.`,
  ].filter(Boolean).join(" "));
}

// The times of single events are too many for a card.
function parameters(effect) {
  const shown = effect.parameters.filter(({ name }) => !name.startsWith("begin_"));
  const events = effect.parameters.length - shown.length;
  const rows = shown.map(({ name, value, unit, ci95 }) =>
    [in_words(name), element("b", quantity(value, unit)), interval_text(ci95, unit)]);
  const title = `${effect.joint}: ${in_words(effect.id)}${effect.from ? ` from ${effect.from}` : ""}`;
  return [table([title, "value", "95 % interval"], rows), evidence(effect), sides(effect),
    events ? note(`${events} times stand in report.json.`) : ""];
}

function rivals(cause) {
  const rows = cause.partings.map(({ id, rival, experiment, minutes }) => element("li", in_words(id), " or ",
    element("b", in_words(rival)), `: ${experiment}`, minutes === null ? "" : ` (${minutes.toFixed(0)} min)`));
  if (rows.length) return [element("p.lead", "Rivals, and the recording that parts them"), element("ul", rows)];
  const [{ separate_by }] = effects_of(cause);
  if (!separate_by) return "";
  return [element("p.lead", cause.status === "no_name" ? "To find its name" : "No rival. To confirm it"),
    element("ul", element("li", separate_by))];
}

function residual_chart(channel, over) {
  const { points } = channel;
  const motion = display_unit(channel.position_unit);
  const axes = {
    position: [motion.factor, `position [${motion.name}]`],
    speed: [motion.factor, `speed [${motion.name}/s]`],
    load: [1, `effort passed on [${display_unit(channel.load_unit).name}]`],
    t_s: [1, "time in its recording [s]"],
    hold_s: [1, "at rest for [s]"],
  };
  const [factor, title] = axes[over];
  // Rows in motion have no time at rest; fewer rows than these show nothing.
  const [fewest, least_s] = over === "hold_s" ? [20, 0.05] : [1, -Infinity];
  const kept = points[over].flatMap((value, i) => (value >= least_s ? [i] : []));
  if (kept.length < fewest) return null;
  const { name, factor: error_factor } = display_unit(channel.unit);
  const of = (values, by = 1) => scaled(kept.map((i) => values[i]), by);
  return pair_chart(`${place(channel)}: error over ${title}`, of(points[over], factor), of(points.speed),
    of(points.before, error_factor), of(points.after, error_factor), title, `error [${name}]`);
}

// A sensor's effect is seen between the transmission's two ends.
function cause_chart(cause) {
  for (const { joint, stage, shown_over } of effects_of(cause)) {
    const shown_in = stage === "sensor" ? "transmission" : stage;
    const channel = report.channels.find((one) => one.joint === joint && one.stage === shown_in);
    const spec = channel && (residual_chart(channel, shown_over) ?? residual_chart(channel, "position"));
    if (spec)
      return figure(spec, `What the plant leaves of ${place(channel)}`, "Each point is a moment; triangles: the joint " +
        "moves backwards. Before: the plant as it is. After: with all that was found.");
  }
  return "";
}

function card(cause) {
  return element("article.card",
    element("h3", `${cause.name} `, element("span.soft", cause.joints.join(", ")), " ",
      element(`span.chip.${cause.status}`, in_words(cause.status))),
    element("p", cause.sentence),
    element("div.narrow-and-wide", element("div", effects_of(cause).map(parameters), rivals(cause)), cause_chart(cause)));
}

// ------------------------------------------------------------------ what was looked at

// Each recording apart, with the figures on those of its rows that no fit saw.
function recordings() {
  const header = ["recording", "", "length", `error ${on_rows}, before → after`];
  return table(header, report.recordings.map((recording, i) => {
    const figures = report.held_out.flatMap((held_out) => held_out.by_recording
      .filter((one) => one.recording === i)
      .map(({ before, after }) => [`${held_out.joint}, ${held_out.figure}: `, change(before, after, held_out.unit)]));
    const role = recording.held_out ? "held out" : "fitted";
    return [recording.name, role, quantity(recording.duration_s, "s"), lines(figures)];
  }));
}

function channels_seen() {
  return table(["joint", "stage", "rows", "held out", "band", "positions", "fastest", "at rest", "load", "compared over"],
    report.looked_at.map((l) => [l.joint, l.stage, l.rows, l.held_out_rows, interval_text(l.band_hz, "Hz"),
      interval_text(l.position, l.position_unit), `${quantity(l.fastest, l.position_unit)}/s`, share(l.rest_share),
      l.load ? interval_text(l.load, l.effort_unit) : "not known", l.circumstances.join(", ")]));
}

function not_seen() {
  const rows = report.not_looked_at.map(({ joint, stage, because }) => [joint, stage, because]);
  return rows.length ? [element("h3", "What these recordings do not show"), table(["joint", "stage", "because"], rows)] : "";
}

// ------------------------------------------------------------------ details

function held_out_table() {
  return table(["joint", "figure", "plant as it is", "improved", "floor", "change, 95 %"], report.held_out.map((h) => {
    const interval = h.change_ci95 ? ` [${h.change_ci95.map(signed_share).join(", ")}]` : "";
    return [h.joint, h.figure, ...[h.before, h.after, h.floor].map((error) => quantity(error, h.unit)),
      worse_if(is_worse(h), signed_share(h.change) + interval)];
  }));
}

function drift() {
  return table(["joint", "run of", "plant as it is", "its numbers refitted", "improved"], report.drift.map((d) =>
    [d.joint, `${general(d.horizon_s)} s`, quantity(d.before, d.unit), quantity(d.refitted, d.unit),
      worse_if(d.after > d.before, quantity(d.after, d.unit))]));
}

function two_estimates() {
  const value = (at, interval, unit) => `${quantity(at, unit)} (${interval_text(interval, unit)})`;
  return [
    note("Allowed: three deviations of both and 4 % for the form of laws, of which no model has the robot's own."),
    table(["joint", "number", "by its efforts (95 %)", "by its motion alone (95 %)", "apart", "allowed", "agree"],
      report.two_estimates.map((e) => [e.joint, `${in_words(e.id)}, ${in_words(e.parameter)}`,
        value(e.equation_error, e.equation_error_ci95, e.unit), value(e.free_run, e.free_run_ci95, e.unit),
        quantity(Math.abs(e.free_run - e.equation_error), e.unit), quantity(e.allowed, e.unit),
        worse_if(!e.agree, e.agree ? "yes" : "no: a law is missing")])),
  ];
}

function error_left() {
  const rows = report.error_left.map((e) => {
    const measured = e.measured_by !== "none";
    return [e.joint, e.stage, worse_if(!e.reached, quantity(e.left, e.unit)),
      quantity(e.floor, e.unit), e.measured_by === "repetition"
        ? `repetition: ${e.compared_rows} rows that share ${share(e.agreement)} of their circumstances` : e.measured_by,
      measured ? quantity(e.allowed, e.unit) : "", `${general(100 * e.share_left)} %`];
  });
  return rows.length ? [
    note("What decides whether physics is missing: of the rows in which the motor moves and does not turn round, each " +
      "recording's constant taken off, by the plant with its numbers as the fit has them. No effect has a part in this " +
      "floor. Red: more is left than chance and the form of simulations allow."),
    table(["joint", "stage", "left", "floor", "measured by", "allowed",
      "share left above the floor"], rows),
  ] : [];
}

function mismatch() {
  const most = 6;
  const header = ["joint", "stage", "circumstances", "times", "positions", "excess", "floor", "p"];
  return table(header, report.mismatch.map((m) => {
    const times = m.where.interval_s.slice(0, most).map(([from, to]) => `${from.toFixed(1)} to ${to.toFixed(1)} s`);
    if (m.where.interval_s.length > most) times.push("and more in report.json");
    const positions = m.where.position.map((one) => interval_text(one, "Nm".includes(m.unit) ? "m" : "rad"));
    return [m.joint, m.stage, m.where.regime.join("; "), lines(times), positions.join(" "), quantity(m.excess_rmse, m.unit),
      quantity(m.floor, m.unit), chance(m.p_value)];
  }));
}

function known_together() {
  return table(["joint", "stage", "product", "value (SI)", "95 %", "alone uncertain"], report.known_together.map((c) => {
    const factors = c.parameters.map(({ id, name, power }, i) =>
      [i ? " × " : "", `${in_words(id)} ${in_words(name)}`, power === 1 ? "" : element("sup", general(power, 6))]);
    const alone = c.parameters.map(({ name, relative_deviation }) => `${in_words(name)} by ${share(relative_deviation)}`);
    return [c.joint, c.stage, factors, general(c.value), interval_text(c.ci95, "1"), alone.join(", ")];
  }));
}

const candidates = () => table(["joint", "stage", "effect", "gain", "z", "p", "size", "outcome"],
  report.candidates.map((c) => [c.joint, c.stage, in_words(c.id), ...(c.z === null ? ["", "", "", ""]
    : [share(c.gain_share, 2), fixed(c.z, 1), chance(c.p_value), quantity(c.size, c.unit)]), c.outcome]));

const limits = () => table(["joint", "effect", "would have been found from", "of"], report.not_found
  .filter((n) => n.detection_limit !== undefined)
  .map((n) => [n.joint, in_words(n.id), quantity(n.detection_limit, n.unit), in_words(n.parameter)]));

// Effects of one joint and reason in one row.
function untestable() {
  const same = (a, b) => a.joint === b.joint && a.not_testable_because === b.not_testable_because;
  const all = report.not_found.filter((n) => n.detection_limit === undefined);
  const firsts = all.filter((n, i) => all.findIndex((other) => same(n, other)) === i);
  return table(["joint", "effects", "because"], firsts.map((n) =>
    [n.joint, all.filter((other) => same(n, other)).map(({ id }) => in_words(id)).join(", "), n.not_testable_because]));
}

// The size of each effect in parts of the data.
function sizes(channel) {
  const effects = [...new Set(channel.scales.map(({ effect }) => effect))];
  return effects.map((effect) => {
    const rows = channel.scales.filter((one) => one.effect === effect).map(({ circumstance, scale, deviation }) => ({
      label: circumstance, value: scale, low: scale - 1.96 * deviation, high: scale + 1.96 * deviation,
      text: fixed(scale, 2),
    }));
    return figure(interval_chart(`${in_words(effect)}: size by circumstance`, "of its size on all data", 1, 3, rows),
      `Size of ${in_words(effect)} by circumstance`);
  });
}

function channel_charts(channel) {
  const { where, waterfall } = channel;
  const [error, motion] = [display_unit(channel.unit), display_unit(channel.position_unit)];
  const bars = scaled(waterfall.map(({ rmse }) => rmse), error.factor).map((value, i) => ({ value, marked: i === 0 }));
  const steps = waterfall.length > 1 && bar_chart(`${place(channel)}: error as the model grows`,
    waterfall.map(({ step }) => in_words(step)), [{ title: "", unit: error.name, reference: null, bars }]);
  const map = where.before.length && map_chart(`${place(channel)}: error over position and speed`,
    scaled(where.position_edges, motion.factor), scaled(where.speed_edges, motion.factor),
    ["before", "after"].map((title) => ({ title, scale: 0, values: scaled(where[title], error.factor), rows: where.rows })),
    `position [${motion.name}]`, `speed [${motion.name}/s]`, error.name);
  const charts = [
    channel.traces.map((one) => trace(channel, one)),
    figure(steps, `Error as the model grows, ${on_rows}`),
    figure(map, "Error over position and speed", "Hatched: too little data."),
    ...[["position", "Error over position"], ["speed", "Error over speed"], ["load", "Error over effort"],
      ["hold_s", "Error at rest"]].map(([over, title]) => figure(residual_chart(channel, over), title)),
    sizes(channel),
  ].flat();
  return charts.some(Boolean) ? element("div.charts", charts) : "";
}

// ------------------------------------------------------------------ the page

const sources = { recordings: "recordings", held_out: "held out", plant: "plant" };
const facts = Object.entries(report.provenance);
const [first_trace, held_out] = [foremost_trace(), held_out_chart()];
show_page(
  facts.filter(([name]) => sources[name]).map(([name, text]) => `${sources[name]}: ${text}`).join(" · "),
  report.verdict.headline,
  [joint_lines(), ...chain(), first_trace || held_out ? element("div.wide-and-narrow", first_trace, held_out) : ""],
  [
    ["causes", "Causes", report.causes.map(card)],
    ["next", "What to record next", element("ol.next", report.next.map(({ experiment, minutes, why }) => element("li",
      element("b", experiment), " ", element("span.soft", `(${minutes.toFixed(1)} min)`), element("br"), why)))],
    ["looked-at", "What was looked at", recordings(), channels_seen(), not_seen()],
    ["details", "Details",
      folded("The verdict in full", element("p", report.verdict.text)),
      folded(`Every figure ${on_rows}`, held_out_table()),
      report.drift.length ? folded("Drift of each drive on its own, by the length of the run", drift()) : "",
      report.two_estimates.length ? folded("Numbers of the drives by two estimators", ...two_estimates()) : "",
      folded("What is left of the error", ...error_left()),
      folded("Where the plant and the recordings part", mismatch()),
      report.channels.map((channel) => folded(place(channel), channel_charts(channel))),
      folded("Known only together", known_together()),
      folded("Candidates and their gates", candidates()),
      folded("Not found, and from which size it would have been", limits()),
      folded("Not testable with these recordings", untestable())],
    ["provenance", "Provenance", table([], facts.map(([name, text]) => [row_header(in_words(name)), text]), "table.facts")],
  ],
);
