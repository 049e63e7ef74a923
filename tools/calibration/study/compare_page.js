// SPDX-License-Identifier: Apache-2.0
//
// The page of a comparison of methods, drawn from its compare.json: errors by method, the tables, errors by place,
// then what was compared.
"use strict";

const comparison = JSON.parse(document.getElementById("data").textContent);
const done = comparison.methods.filter(({ status }) => status === "done");

// RMSE of each method with its interval and its largest error, on a logarithmic axis.
function error_chart({ joint, unit }, k) {
  const figures = done.map(({ title, ours, joints }) => ({ title, ours, ...joints[k].sets.test })).filter(({ rmse }) => rmse !== null);
  if (!figures.length) return null;
  const [label_width, width, height] = [190, 320, 21 * figures.length];
  const least = Math.min(...figures.map(({ rmse, rmse_ci95: [low] }) => low ?? rmse));
  const from = 10 ** (Math.floor(2 * Math.log10(0.9 * Math.max(least, 1e-9))) / 2);
  const to = Math.max(1.05 * Math.max(...figures.map(({ peak }) => peak)), 10 * from);
  const inside = (value) => Math.max(value, from);
  const rows = figures.map(({ title, ours, rmse, rmse_ci95: [low, high], peak }, i) => ({
    title, row: i + 0.5, rmse: inside(rmse), low: inside(low ?? rmse), high: inside(high ?? rmse), peak: inside(peak),
    colour: ours ? colours.after : colours.recorded,
    text: `${title}: RMSE ${general(rmse, 4)}, peak ${general(peak, 4)} ${unit}`,
  }));
  const [y, source] = [at("y", "row"), { from: { data: "rows" } }];
  const axes = [axis("bottom", `error [${unit}], logarithmic`,
    { format: "~g", values: log_ticks([from, to]), tickCount: undefined })];
  return chart(`RMSE and peak of ${joint} by method`, label_width + width, height + 44, { rows }, [
    panel([label_width, 0, width, height], [from, to], [rows.length, 0], axes, [
      text_mark(-8, y, { field: "title" }, { align: "right" }, source.from),
      mark("rect", { x: 0, x2: at("x", "rmse"), yc: y, height: 12, fill: { field: "colour" } }, source),
      mark("rule", { x: at("x", "low"), x2: at("x", "high"), y, stroke: "currentColor", strokeWidth: 1.5 }, source),
      mark("rule", { x: at("x", "peak"), y: { ...y, offset: -6 }, y2: { ...y, offset: 6 }, stroke: colours.before,
        strokeWidth: 2, tooltip: { field: "text" } }, { ...source, interactive: true }),
    ], {}, "linear", "log"),
  ]);
}

const bars = () => [
  note("On the test recordings; lines: 95 % intervals."),
  key([["solid", 9, "after", "RMSE, ours"], ["solid", 9, "recorded", "RMSE, others'"], ["solid", 2, "before", "largest error"]]),
  element("div.pair", done[0].joints.map((joint, k) => figure(error_chart(joint, k), joint.joint))),
];

function maps() {
  const { x, x_unit, x_edges, y, y_unit, y_edges } = comparison.map;
  const mapped = done.filter((method) => method.maps.length);
  if (!x_edges.length || !mapped.length) return [];
  return [
    note("RMSE by place. Colours end at the largest of the joint's maps but the raw one. Hatched: not tested."),
    ...mapped[0].maps.map(({ joint, unit }, k) => figure(
      map_chart(`error of ${joint} by place and method`, x_edges, y_edges, mapped.map(({ id, title, maps: own }) => (
        { title, scale: 0, values: own[k].rmse, beyond: id === "raw" })), `${x} [${x_unit}]`, `${y} [${y_unit}]`, unit, [140, 140]),
      `${joint} [${unit}]`)),
  ];
}

const methods = () => table(["method", "after", "what training chose, or why there is nothing", "why not in the loop"],
  comparison.methods.map(({ title, source, status, remark, reason, loop }) => [row_header(title), source,
    status === "done" ? remark : reason, loop.loadable ? loop.why_not_measured : loop.why_not]));

show_page("", comparison.verdict, [], [
  ["bars", "Errors by method", done.length ? bars() : []],
  ["tables", "Figures", comparison.tables.flatMap(study_table)],
  ["maps", "Where the error is", maps()],
  ["methods", "Methods", methods()],
  ["facts", "Recordings and settings",
    table([], Object.entries(comparison.facts).map(([name, text]) => [row_header(name), text]), "table.facts")],
]);
