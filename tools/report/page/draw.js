// SPDX-License-Identifier: Apache-2.0
//
// What pages drawn from data share: elements, numbers with their units, charts. Strings become text
// nodes, whatever they contain.
"use strict";

// ------------------------------------------------------------------ elements

// "p.note" with its children: texts, elements, lists of them; what is empty is left out.
function element(kind, ...children) {
  const [name, ...classes] = kind.split(".");
  const made = document.createElement(name);
  if (classes.length) made.className = classes.join(" ");
  made.append(...children.flat(Infinity).filter((child) => (child ?? "") !== ""));
  return made;
}

// Cells may be whole <th> and <td>. Nothing without rows.
function table(header, rows, kind = "table.words") {
  if (!rows.length) return "";
  const row = (cell_kind, cells) => element("tr", cells.map((cell) =>
    cell instanceof HTMLTableCellElement ? cell : element(cell_kind, cell)));
  const head = row("th", header);
  for (const cell of head.cells) cell.scope = "col";
  const body = element("tbody", rows.map((cells) => row("td", cells)));
  return element(kind, header.length ? element("thead", head) : "", body);
}

// A table of figures as the studies write them; neighbouring columns of one group share a heading.
function study_table({ id, title, row_title, notes, columns, rows }) {
  const starts = columns.map(({ group }, i) => !group || group !== columns[i - 1]?.group);
  const kind = (name, i) => (starts[i] ? `${name}.group` : name);
  const head = (name, text, more) => Object.assign(element(name, text), { scope: "col", ...more });
  const span = (i) => ({ scope: "colgroup", colSpan: [...starts, true].indexOf(true, i + 1) - i });
  const groups = columns.map(({ group }, i) => (starts[i] ? head("th.group", group, span(i)) : ""));
  const names = columns.map(({ title, unit }, i) => head(kind("th", i), unit ? `${title} [${unit}]` : title));
  const grouped = columns.some(({ group }) => group);
  const first = head("th", row_title, { rowSpan: grouped ? 2 : 1 });
  const cell = ({ mean, deviation, ci95: [low, high], theirs, mark, text }, i) => {
    const shown = (value) => value.toFixed(columns[i].decimals);
    const below = (small) => [element("br"), element("small.note", small)];
    return element(kind("td", i) + { best: ".strong", worse: ".worse", "": "" }[mark],
      text || (mean === null ? "–" : shown(mean)),
      text || mean === null || deviation === null ? "" : `\u2009±\u2009${shown(deviation)}`,
      low === null || high === null ? "" : below(`${shown(low)} to ${shown(high)}`),
      theirs === null ? "" : below(`(${shown(theirs)})`));
  };
  const made = element("table", element("caption", title),
    element("thead", grouped ? [element("tr", first, groups), element("tr", names)] : element("tr", first, names)),
    element("tbody", rows.map((row) =>
      element(row.rule_above ? "tr.ruled" : "tr", row_header(row.title), row.cells.map(cell)))));
  made.id = `table-${id}`;
  const region = Object.assign(element("div.scroll", made), { tabIndex: 0, role: "region", ariaLabel: title });
  return [region, ...notes.map((text) => note(text))];
}

const note = (...text) => element("p.note", ...text);
const row_header = (text) => Object.assign(element("th", text), { scope: "row" });
const folded = (title, ...content) => (content.some(Boolean) ? element("details", element("summary", title), content) : "");
const lines = (items) => items.flatMap((item, i) => (i ? [element("br"), item] : [item]));
const worse_if = (worse, content) => (worse ? element("span.worse", content) : content);

// Strokes as the charts draw them, [line style, width in px, name of the colour, meaning] each.
function key(items) {
  return element("ul.key", items.map(([style, width_px, name, meaning]) => {
    const stroke = element("i");
    stroke.style.borderTop = `${width_px}px ${style} ${colours[name]}`;
    return element("li", stroke, meaning);
  }));
}

const figures = [];

// A chart under a heading with a caption, drawn by show_page(); nothing without a chart.
function figure(spec, heading, caption = "") {
  if (!spec) return "";
  const container = Object.assign(element("div.chart"), { tabIndex: 0, role: "group", ariaLabel: heading });
  figures.push({ container, spec });
  return element("figure", element("h3", heading), container,
    element("figcaption", caption && element("p", caption)));
}

// `sections`: [id, title, ...content] each, listed in the header; `opening` stands before them.
function show_page(subtitle, verdict, opening, sections) {
  const shown = sections.filter(([, , ...content]) => content.flat().some(Boolean));
  const link = ([id, title]) => element("li", Object.assign(element("a", title), { href: `#${id}` }));
  const contents = Object.assign(element("nav", element("ul", shown.map(link))), { ariaLabel: "contents" });
  document.querySelector("header").append(element("p.subtitle", subtitle), element("p.verdict", verdict), contents);
  document.querySelector("main").append(...opening, ...shown.flatMap(([id, title, ...content]) =>
    [Object.assign(element("h2", title), { id }), ...content.flat()]));
  return draw_charts(figures);
}

// ------------------------------------------------------------------ numbers

// As %g: zeros at the end are left out.
function general(value, digits = 3) {
  const [mantissa, power] = value.toExponential(digits - 1).split("e").map(Number);
  if (power >= -4 && power < digits) return String(Number(value.toPrecision(digits)));
  return `${mantissa}e${power < 0 ? "-" : "+"}${String(Math.abs(power)).padStart(2, "0")}`;
}

// Degrees and millimetres for people; everything else as it is.
function display_unit(unit) {
  if (unit === "rad") return { name: "deg", factor: 180 / Math.PI };
  if (unit === "m") return { name: "mm", factor: 1e3 };
  return { name: unit === "1" ? "" : unit.replaceAll("_per_", "/").replaceAll("_", " "), factor: 1 };
}

function quantity(value, unit) {
  const { name, factor } = display_unit(unit);
  return value === null ? "not known" : `${general(value * factor)} ${name}`.trim();
}

const interval_text = ([low, high], unit) => `${quantity(low, unit)} to ${quantity(high, unit)}`;
const change = (before, after, unit) => worse_if(after > before, `${quantity(before, unit)} → ${quantity(after, unit)}`);
const fixed = (value, decimals) => value?.toFixed(decimals) ?? "not known";
const share = (part, decimals = 0) => (part === null ? "not known" : `${fixed(100 * part, decimals)} %`);

// A change with its sign. Near a whole fall the tenths tell.
function signed_share(part) {
  const decimals = Math.abs(part) < 0.1 || part < -0.95 ? 1 : 0;
  return `${part < 0 ? "−" : "+"}${share(Math.abs(part), decimals)}`;
}

// ------------------------------------------------------------------ parts of charts

const colours = { recorded: "var(--truth)", before: "var(--raw)", after: "var(--corrected)", worse: "var(--worse)" };

// From the least to the greatest value without the `outermost` share on either side, widened by 4 %.
function extent(values, outermost = 0) {
  const sorted = Float64Array.from(values.filter(Number.isFinite)).sort();
  if (!sorted.length) return [-1, 1];
  const cut = Math.floor(outermost * sorted.length);
  const [from, to] = [sorted[cut], sorted[sorted.length - 1 - cut]];
  const margin = 0.04 * (to - from) || 0.1 * Math.abs(to) || 1;
  return [from - margin, to + margin];
}

const joined = (...extents) => [Math.min(...extents.map(([from]) => from)), Math.max(...extents.map(([, to]) => to))];

// Series in which null has no value.
const scaled = (values, factor) => values.map((value) => (value === null ? null : value * factor));
const added = (a, b, sign = 1) => a.map((value, i) => (value === null || b[i] === null ? null : value + sign * b[i]));

// One object a row from columns by name.
function rows_of(columns) {
  const entries = Object.entries(columns);
  return entries[0][1].map((_, i) => Object.fromEntries(entries.map(([name, values]) => [name, values[i]])));
}

const at = (scale, field) => ({ scale, field });

// Constants of the encoding may stand as they are.
function mark(type, encoding, more) {
  const entries = Object.entries(encoding);
  const enter = entries.map(([name, value]) => [name, typeof value === "object" ? value : { value }]);
  return { type, encode: { enter: Object.fromEntries(enter) }, interactive: false, ...more };
}

const text_mark = (x, y, text, more, from) => mark("text", { x, y, text, baseline: "middle", ...more }, { from });
const axis = (orient, title, more) => (
  { orient, scale: orient === "left" ? "y" : "x", title, grid: true, tickCount: 4, ...more });

// A plot inside a chart, `box` = [x, y, width, height]. Its signals stand in for the chart's, from
// which axes take the length of their grid.
function panel([x, y, width, height], x_extent, y_extent, axes, marks, encoding, y_type = "linear", x_type = "linear") {
  const scale = (name, domain, range, type) => ({ name, type, domain, range, nice: false, zero: false });
  return mark("group", { x, y, width, height, ...encoding }, {
    signals: [{ name: "width", value: width }, { name: "height", value: height }],
    scales: [scale("x", x_extent, [0, width], x_type), scale("y", y_extent, [height, 0], y_type)],
    axes,
    marks,
  });
}

function chart(description, width, height, data, marks, more) {
  const named = Object.entries(data).map(([name, values]) => ({ name, values }));
  return { description, width, height, padding: 4, autosize: "pad", data: named, marks, ...more };
}

// ------------------------------------------------------------------ charts

// What was recorded and what is simulated before and after, the errors below.
function trace_chart(description, t, recorded, before, after, y_title, error_title) {
  const [width, height, gap, error_height] = [590, 112, 12, 66];
  const [was, is] = [before, after].map((line) => added(line, recorded, -1));
  const line = (name, stroke, strokeWidth, dash = []) => mark("line", {
    x: at("x", "t"), y: at("y", name), defined: { signal: `isValid(datum['${name}'])` },
    stroke, strokeWidth, strokeDash: { value: dash }, strokeJoin: "round",
  }, { from: { data: "lines" }, clip: true });
  const zero = mark("rule", { x: 0, x2: width, y: { scale: "y", value: 0 }, stroke: "currentColor", strokeWidth: 0.8 });
  const levels = [line("recorded", colours.recorded, 4), line("before", colours.before, 1.2, [5, 2]),
    line("after", colours.after, 1.2)];
  const errors = [zero, line("was", colours.before, 1.2, [5, 2]), line("is", colours.after, 1.2)];
  const level_extent = joined(extent(recorded), extent(before, 0.002), extent(after));
  const error_extent = joined(extent(was, 0.002), extent(is), [0, 0]);
  const data = { lines: rows_of({ t, recorded, before, after, was, is }) };
  return chart(description, width, height + gap + error_height, data, [
    panel([0, 0, width, height], extent(t), level_extent,
      [axis("bottom", "", { labels: false, ticks: false, tickCount: 10 }), axis("left", y_title)], levels),
    panel([0, height + gap, width, error_height], extent(t), error_extent,
      [axis("bottom", "time [s]", { tickCount: 10 }), axis("left", error_title)], errors),
  ]);
}

// Values with their intervals beside `reference`, rows of { label, value, low, high, text, worse };
// nothing is cut but what exceeds `most` in size.
function interval_chart(description, x_title, reference, most, rows) {
  const [label_width, width, height] = [150, 170, 22 * rows.length];
  const inside = (value) => Math.min(Math.max(value, -most), most);
  const data = rows.map(({ label, value, low, high, text, worse }, i) => ({
    label, text, row: i + 0.5, value: inside(value), low: inside(low ?? value), high: inside(high ?? value),
    colour: worse ? colours.worse : colours.after, ink: worse ? colours.worse : "currentColor",
  }));
  const x_extent = extent([reference, ...data.flatMap(({ value, low, high }) => [value, low, high])]);
  const from = { data: "rows" };
  const [y, stroke] = [at("y", "row"), { field: "colour" }];
  return chart(description, label_width + width + 80, height + 44, { rows: data }, [
    panel([label_width, 0, width, height], x_extent, [rows.length, 0], [axis("bottom", x_title)], [
      mark("rule", { x: { scale: "x", value: reference }, y: 0, y2: height, stroke: "currentColor", strokeWidth: 1 }),
      mark("rule", { x: at("x", "low"), x2: at("x", "high"), y, stroke, strokeWidth: 2.5 }, { from }),
      mark("symbol", { x: at("x", "value"), y, fill: stroke, size: 46 }, { from }),
      text_mark(-10, y, { field: "label" }, { align: "right", limit: label_width - 12 }, from),
      text_mark(width + 12, y, { field: "text" }, { fill: { field: "ink" } }, from),
    ]),
  ]);
}

// Bars from zero, a row per label; panels of { title, unit, reference, bars } side by side, bars of { value,
// low, high, marked }. A panel ends at six times its reference: longer bars are cut, their figures stay.
function bar_chart(description, labels, panels) {
  const [label_width, width, height, step] = [230, 220, 19 * labels.length, 282];
  const y = at("y", "row");
  const data = { labels: labels.map((text, i) => ({ text, row: i + 0.5 })) };
  const bar_panel = ({ title, unit, reference, bars }, i) => {
    const greatest = Math.max(0, ...bars.flatMap(({ value, high }) => [value, high ?? 0]));
    const end = 1.02 * Math.min(greatest, reference > 0 ? 6 * reference : Infinity) || 1;
    const inside = (value) => Math.min(Math.max(value, 0), end);
    data[`bars_${i}`] = bars.flatMap(({ value, low, high, marked }, row) => (value === null ? [] : [{
      row: row + 0.5, value: inside(value), low: inside(low ?? value), high: inside(high ?? value), text: general(value),
      last: inside(Math.max(value, high ?? value)), colour: marked ? colours.before : colours.after,
    }]));
    const from = { data: `bars_${i}` };
    const x = { scale: "x", value: reference };
    const dashed = { stroke: "currentColor", strokeWidth: 1, strokeDash: { value: [3, 3] } };
    const axes = [axis("bottom", `RMSE [${unit}]`)];
    return panel([label_width + i * step, 18, width, height], [0, end], [labels.length, 0], axes, [
      text_mark(0, -10, title),
      i ? [] : text_mark(-8, y, { field: "text" }, { align: "right" }, { data: "labels" }),
      mark("rect", { x: 0, x2: at("x", "value"), yc: y, height: 11, fill: { field: "colour" } }, { from }),
      mark("rule", { x: at("x", "low"), x2: at("x", "high"), y, stroke: "currentColor", strokeWidth: 1.5 }, { from }),
      text_mark({ ...at("x", "last"), offset: 5 }, y, { field: "text" }, {}, from),
      reference === null ? [] : mark("rule", { x, y: 0, y2: height, ...dashed }),
    ].flat());
  };
  return chart(description, label_width + step * panels.length, height + 50, data, panels.map(bar_panel));
}

// Two panels of points, before and after; triangles where `speed` is negative. Their axes of error
// span the same, each about its own middle: a constant error must not hide the shape of the rest.
function pair_chart(description, x, speed, before, after, x_title, y_title) {
  const [width, height, step] = [235, 150, 305];
  const extents = [extent(before, 0.005), extent(after, 0.005)];
  const half = Math.max(...extents.map(([from, to]) => (to - from) / 2));
  const points = (name, i) => {
    const middle = (extents[i][0] + extents[i][1]) / 2;
    const shape = { signal: "datum.speed < 0 ? 'triangle-left' : 'circle'" };
    return panel([i * step, 18, width, height], extent(x), [middle - half, middle + half],
      [axis("bottom", x_title), axis("left", i ? "" : y_title)], [
        mark("symbol", { x: at("x", "x"), y: at("y", name), shape, size: 13, opacity: 0.55, fill: colours[name] },
          { from: { data: "points" }, clip: true }),
        text_mark(0, -9, name),
      ]);
  };
  return chart(description, 2 * step - 60, height + 60, { points: rows_of({ x, speed, before, after }) },
    ["before", "after"].map(points));
}

// RMS over a grid of cells, hatched where it is null; panels of { title, scale, values, rows, beyond }, four side by
// side, `rows` where they are known. Those of one `scale` share their colours, which end at the greatest value of those
// that are not `beyond` them.
function map_chart(description, x_edges, y_edges, panels, x_title, y_title, unit, [width, height] = [250, 180]) {
  const [abreast, columns, step, row_step] = [4, x_edges.length - 1, width + 40, height + 64];
  const cells = ({ values, rows }) => values.flatMap((value, c) => (value === null ? [] : [{
    value, x: x_edges[c % columns], x2: x_edges[c % columns + 1], y: y_edges[Math.floor(c / columns)],
    y2: y_edges[Math.floor(c / columns) + 1], text: `${general(value)} ${unit} RMSE${rows ? `, ${rows[c]} samples` : ""}`,
  }]));
  const plain = { grid: false, tickCount: 5 };
  const [x_extent, y_extent] = [x_edges, y_edges].map((edges) => [edges[0], edges.at(-1)]);
  const map_panel = (one, i) => panel([i % abreast * step, 18 + Math.floor(i / abreast) * row_step, width, height], x_extent, y_extent,
    [axis("bottom", x_title, plain), axis("left", i % abreast ? "" : y_title, { ...plain, labels: i % abreast === 0 })], [
      mark("rect", {
        x: at("x", "x"), x2: at("x", "x2"), y: at("y", "y"), y2: at("y", "y2"), fill: at(`colour_${one.scale}`, "value"),
        tooltip: { field: "text" },
      }, { from: { data: `map_${i}` }, interactive: true }),
      text_mark(0, -10, one.title),
    ], { fill: "url(#untested)" });
  const firsts = panels.filter((one, i) => panels.findIndex(({ scale }) => scale === one.scale) === i);
  const values_of = (scale) => panels.filter((one) => one.scale === scale && !one.beyond).flatMap(({ values }) => values);
  const below = Math.ceil(panels.length / abreast) * row_step;
  return chart(description, Math.min(panels.length, abreast) * step, below + 46,
    Object.fromEntries(panels.map((one, i) => [`map_${i}`, cells(one)])), panels.map(map_panel), {
      scales: firsts.map(({ scale }) => ({
        name: `colour_${scale}`, type: "linear", domain: [0, Math.max(0, ...values_of(scale)) || 1],
        range: { scheme: "viridis" }, clamp: true, zero: true,
      })),
      legends: firsts.map((one) => ({
        fill: `colour_${one.scale}`, type: "gradient", direction: "horizontal", orient: "none",
        legendX: step * panels.indexOf(one), legendY: below + 2, gradientLength: width, tickCount: 3,
        gradientThickness: 10, title: `RMSE [${unit}]`,
      })),
    });
}

// Okabe and Ito, "Color Universal Design" (2008), but black and yellow.
const line_colours = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#808890"];

// Ticks 1, 2 and 5 times powers of ten; only the powers if there would be more than 12.
function log_ticks([from, to]) {
  const ticks = (steps) => Array.from({ length: 40 }, (_, i) => i - 20)
    .flatMap((power) => steps.map((step) => Number(`${step}e${power}`))).filter((tick) => tick >= from && tick <= to);
  return ticks([1, 2, 5]).length > 12 ? ticks([1]) : ticks([1, 2, 5]);
}

// Values on a logarithmic axis over settings 0, 1, 2, ..., panels of { title, lines } side by side, lines of
// { name, values, low, high }, of the same names in every panel.
function setting_chart(description, x_title, panels) {
  const [width, height, step] = [270, 230, 336];
  const data = {};
  const setting_panel = ({ title, lines }, p) => {
    const positive = lines.flatMap(({ values, low, high }) => [...values, ...low, ...high]).filter((value) => value > 0);
    const y_extent = positive.length ? [Math.min(...positive) / 1.15, 1.15 * Math.max(...positive)] : [0.1, 10];
    const settings = (lines[0]?.values ?? [0]).map((_, i) => i);
    const marks = lines.slice(0, line_colours.length).flatMap(({ name, values, low, high }, i) => {
      data[`line_${p}_${i}`] = rows_of({ setting: settings, value: values, low, high }).filter(({ value }) => value > 0)
        .map((row) => ({ ...row, text: `${name}, ${row.setting}: ${general(row.value, 4)}` }));
      const [x, stroke, from] = [at("x", "setting"), line_colours[i], { data: `line_${p}_${i}` }];
      return [
        mark("line", { x, y: at("y", "value"), stroke, strokeWidth: 1.6, strokeJoin: "round" }, { from, clip: true }),
        mark("rule", { x, y: at("y", "low"), y2: at("y", "high"), stroke, strokeWidth: 1 }, { from }),
        mark("symbol", { x, y: at("y", "value"), size: 40, fill: stroke, tooltip: { field: "text" } },
          { from, interactive: true }),
      ];
    });
    const axes = [axis("bottom", x_title, { format: "d", values: settings }),
      axis("left", "RMSE", { format: "~g", values: log_ticks(y_extent), tickCount: undefined })];
    return panel([p * step, 18, width, height], [-0.3, settings.length - 0.7], y_extent, axes,
      [text_mark(0, -10, title), ...marks], {}, "log");
  };
  const names = panels.at(-1).lines.slice(0, line_colours.length).map(({ name }) => name);
  return chart(description, step * panels.length, height + 60, data, panels.map(setting_panel), {
    scales: [{ name: "line", type: "ordinal", domain: names, range: line_colours.slice(0, names.length) }],
    legends: [{ fill: "line", orient: "bottom", symbolType: "circle", columns: 3, labelLimit: 320 }],
  });
}
