// SPDX-License-Identifier: Apache-2.0
//
// Draws specifications of charts with Vega, in one font and in the page's colours: CSS variables, so that
// dark, light and print need one drawing. Vega's modules register themselves through define_module(); its
// expression interpreter stands in for eval, which the page's policy forbids.
"use strict";

const font = "system-ui, 'Segoe UI', 'Noto Sans', 'Liberation Sans', sans-serif";
const words = { labelColor: "currentColor", titleColor: "currentColor", labelFont: font, titleFont: font,
  labelFontSize: 11, titleFontSize: 11.5, titleFontWeight: "normal" };
const chart_config = {
  background: "transparent",
  axis: { ...words, titlePadding: 7, domainColor: "var(--rule)", tickColor: "var(--rule)", gridColor: "var(--grid)",
    tickSize: 4, labelOverlap: true },
  axisLeft: { minExtent: 34 },
  legend: words,
  text: { font, fontSize: 11.5, fill: "currentColor" },
};

const modules = new Map();
const aliases = { "vega-selections": "vega-selection" };

function require_module(name) {
  const found = modules.get(aliases[name] ?? name);
  if (!found) throw new Error(`module ${name} is not in this page`);
  return found;
}

function define_module(name, body) {
  const module = { exports: {} };
  body(module.exports, module, require_module);
  modules.set(name, module.exports);
}

// A column travels as whole multiples of its quantum, null = missing; Vega wants one object a row.
function expand_columns(data) {
  for (const set of data ?? []) {
    if (!set.columns) continue;
    const names = Object.keys(set.columns);
    const rows = names.length ? set.columns[names[0]].v.length : 0;
    set.values = Array.from({ length: rows }, (_, row) => {
      const item = {};
      for (const name of names) {
        const { q, v } = set.columns[name];
        item[name] = v[row] === null ? null : v[row] * q;
      }
      return item;
    });
    delete set.columns;
  }
}

async function draw_chart(container, spec) {
  const vega = {
    parse: require_module("vega-parser").parse,
    View: require_module("vega-view").View,
    interpreter: require_module("vega-interpreter").expressionInterpreter,
  };
  expand_columns(spec.data);
  const view = new vega.View(vega.parse(spec, chart_config, { ast: true }), {
    expr: vega.interpreter,
    renderer: "svg",
    container,
  });
  await view.runAsync();
  const svg = container.querySelector("svg");
  svg.setAttribute("viewBox", `0 0 ${svg.getAttribute("width")} ${svg.getAttribute("height")}`);
}

// The specifications in #charts, each for the element of its id.
function listed_charts() {
  const charts = JSON.parse(document.getElementById("charts").textContent);
  return charts.map(({ id, spec }) => ({ container: document.getElementById(id), spec }));
}

async function draw_charts(charts = listed_charts()) {
  Object.assign(
    require_module("vega-dataflow").transforms,
    require_module("vega-transforms"),
    require_module("vega-view-transforms"),
    require_module("vega-encode"),
  );
  let drawn = 0;
  for (const { container, spec } of charts) {
    try {
      await draw_chart(container, spec);
      ++drawn;
    } catch (error) {
      container.textContent = `This chart could not be drawn: ${error.message}`;
      container.classList.add("problem");
    }
  }
  document.documentElement.dataset.chartsDrawn = `${drawn}/${charts.length}`;
}

// Paper cannot be unfolded.
window.addEventListener("beforeprint", () => {
  for (const details of document.querySelectorAll("main details")) details.open = true;
});
