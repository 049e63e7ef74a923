// SPDX-License-Identifier: Apache-2.0
//
// README's figures from a demo's folder, drawn by the Vega that its pages carry, in their colours:
//   node draw.js DEMO_DIR OUT_DIR
"use strict";
const fs = require("fs");
const path = require("path");
const vm = require("vm");

const [demo, out] = process.argv.slice(2);
const read = (name) => fs.readFileSync(path.join(demo, name), "utf8");
const page = read("report_0g.html");
const scripts = [...page.matchAll(/<script(?: [^>]*)?>([\s\S]*?)<\/script>/g)].map((m) => m[1]);

// page.js and the modules that it registers, as the page runs them.
const context = vm.createContext({ console, setTimeout, clearTimeout, window: { addEventListener() {} } });
for (const script of scripts.slice(1, -1)) vm.runInContext(script, context);
const require_module = vm.runInContext("require_module", context);
Object.assign(
  require_module("vega-dataflow").transforms,
  ...["transforms", "view-transforms", "encode"].map((name) => require_module(`vega-${name}`)),
);

const charts = JSON.parse(scripts[0]);
const config = vm.runInContext("chart_config", context);
const variables = page.match(/:root \{[\s\S]*?\}\s*@media[^{]*\{[\s\S]*?\}\s*\}/)[0];

async function draw(name, spec) {
  const { parse } = require_module("vega-parser");
  const { View } = require_module("vega-view");
  const whole = { padding: 6, config, ...spec };
  const svg = await new View(parse(whole), { renderer: "none" }).runAsync().then((v) => v.toSVG());
  const style = `<style>${variables.replace("@media screen and", "@media")} svg { color: var(--ink); }</style>`;
  const short = (attribute) => attribute.replace(/(\d+\.\d)\d+/g, "$1");
  const small = svg.replace(/ (?:d|transform)="[^"]*"/g, short).replace(/(<svg[^>]*>)/, `$1${style}`);
  fs.writeFileSync(path.join(out, name), small);
}

const font_size = 12;
const scale_x = (domain, width) => ({ name: "x", type: "linear", domain, range: [0, width], zero: false, nice: false });
const axis = (orient, scale, title, more = {}) => ({ orient, scale, title, grid: true, ...more });
const text = (x, y, words, colour, align = "left") => ({
  type: "text",
  encode: {
    enter: { x: { value: x }, y: { value: y }, text: { value: words }, fill: { value: colour }, align: { value: align }, fontSize: { value: font_size } },
  },
});

// (1) The error of one joint over the test recording.
function columns_of(set, stride) {
  const { t, v } = set.columns;
  const rows = [];
  for (let i = 0; i < t.v.length; i += stride) {
    if (v.v[i] !== null) rows.push({ t: t.v[i] * t.q, v: v.v[i] * v.q });
  }
  return rows;
}

function error_over_time() {
  const { spec } = charts.find((c) => c.spec.description === "elbow: position and error over the whole length");
  const set = (name) => columns_of(spec.data.find((d) => d.name === name), 2);
  const line = (name, colour) => ({
    type: "line",
    from: { data: name },
    encode: {
      enter: { x: { scale: "x", field: "t" }, y: { scale: "y", field: "v" }, stroke: { value: colour }, strokeWidth: { value: 1.3 } },
    },
  });
  return {
    width: 720,
    height: 180,
    data: [{ name: "raw", values: set("raw_error") }, { name: "corrected", values: set("corrected_error") }],
    scales: [
      scale_x([0, 300], 720),
      { name: "y", type: "linear", domain: { fields: [{ data: "raw", field: "v" }, { data: "corrected", field: "v" }] }, range: [180, 0], zero: true, nice: true },
    ],
    axes: [axis("bottom", "x", "time [s]"), axis("left", "y", "error of the elbow [deg]", { tickCount: 6 })],
    marks: [
      line("raw", "var(--raw)"),
      line("corrected", "var(--corrected)"),
      text(0, -4, "as the robot believes", "var(--raw)"),
      text(150, -4, "calibrated", "var(--corrected)"),
    ],
  };
}

// (2) RMSE of the six rows; (3) held-out error of the joint before and after its diagnosis.
function bars(rows, stages, title) {
  const values = rows.flatMap((row) => stages.map((stage) => ({ row: row.name, stage: stage.name, colour: stage.colour, value: row[stage.name], shown: `${Number(row[stage.name].toPrecision(3))} ${row.unit}`, share: (100 * row[stage.name]) / row[stages[0].name] })));
  const step = 13 * stages.length + 10;
  const height = rows.length * step;
  return {
    width: 520,
    height,
    data: [{ name: "bars", values }],
    scales: [
      { name: "x", type: "linear", domain: [0, 100], range: [0, 520] },
      { name: "row", type: "band", domain: rows.map((r) => r.name), range: [0, height], paddingInner: 0.22, paddingOuter: 0.1 },
      { name: "stage", type: "band", domain: stages.map((s) => s.name), range: [0, step * 0.78] },
    ],
    axes: [axis("bottom", "x", title), { orient: "left", scale: "row", title: "", domain: false, ticks: false }],
    marks: [
      {
        type: "rect",
        from: { data: "bars" },
        encode: {
          enter: { x: { value: 0 }, x2: { scale: "x", field: "share" }, y: { signal: "scale('row', datum.row) + scale('stage', datum.stage)" }, height: { scale: "stage", band: 0.86 }, fill: { field: "colour" } },
        },
      },
      {
        type: "text",
        from: { data: "bars" },
        encode: {
          enter: { x: { signal: "scale('x', datum.share) + (datum.share > 85 ? -4 : 4)" }, align: { signal: "datum.share > 85 ? 'right' : 'left'" }, baseline: { value: "middle" }, y: { signal: "scale('row', datum.row) + scale('stage', datum.stage) + 6" }, text: { field: "shown" }, fill: { signal: "datum.share > 85 ? 'white' : 'currentColor'" }, fontSize: { value: 10.5 } },
        },
      },
      ...stages.map((stage, i) => text(150 * i, -5, stage.name, stage.colour)),
    ],
  };
}

const kStages = [
  { name: "raw", colour: "var(--raw)" },
  { name: "bias removed", colour: "var(--bias)" },
  { name: "calibrated", colour: "var(--corrected)" },
];

function reductions() {
  const rows = [["unloaded", "evaluate_0g.json"], ["500 g", "evaluate_500g.json"]].flatMap(([load, file]) =>
    JSON.parse(read(file)).joints.map((joint) => {
      const factor = joint.unit === "rad" ? 180 / Math.PI : joint.unit === "m" ? 1e3 : 1;
      const unit = { rad: "°", m: "mm", deg: "°" }[joint.unit] ?? joint.unit;
      return { name: `${joint.joint}, ${load}`, unit, raw: joint.raw.rmse * factor, "bias removed": joint.bias_removed.rmse * factor, calibrated: joint.calibrated.rmse * factor };
    }),
  );
  return bars(rows, kStages, "RMSE on unseen motion, % of raw");
}

function diagnosed() {
  const { hidden, held_out } = JSON.parse(read("one/one.json"));
  if (!held_out) throw new Error("one.json has no held-out error; take another seed");
  const factor = { rad: 180 / Math.PI, m: 1e3 }[held_out.unit] ?? 1;
  const unit = { rad: "°", m: "mm" }[held_out.unit] ?? held_out.unit.replaceAll("_", " ");
  const row = { name: hidden.joint, unit, before: held_out.before * factor, after: held_out.after * factor };
  const stages = [
    { name: "before", colour: "var(--raw)" },
    { name: "after", colour: "var(--corrected)" },
  ];
  return bars([row], stages, `${hidden.id} hidden: error on held-out motion, % of before`);
}

fs.mkdirSync(out, { recursive: true });
Promise.all([
  draw("error_over_time.svg", error_over_time()),
  draw("reductions.svg", reductions()),
  draw("diagnosed.svg", diagnosed()),
]).catch((error) => {
  console.error(`draw.js: ${error.message}`);
  process.exit(3);
});
