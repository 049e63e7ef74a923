// SPDX-License-Identifier: Apache-2.0
//
// The page of an ablation: the paper's findings, each table with its charts, errors by place.
"use strict";

const study = JSON.parse(document.getElementById("data").textContent);

function verdict() {
  const count = (wanted) => study.findings.filter((finding) => finding.verdict === wanted).length;
  return `${count("holds")} of the paper's findings hold, ${count("does not hold")} do not, ` +
    `${count("undecided")} are undecided, ${count("not tested")} not tested.`;
}

function findings() {
  if (!study.findings.length) return [];
  const kinds = { "holds": "td.strong", "does not hold": "td.worse" };
  return [
    table(["finding", "condition", "verdict"], study.findings.map(({ statement, condition, verdict: word }) =>
      [row_header(statement), condition, element(kinds[word] ?? "td", word)])),
    note("A finding holds where the 95 % interval says so, and is undecided where the interval contains both; changes " +
      "are of the mean over joints of RMSE ratios. Twin or your recordings, not the authors' robot."),
    element("ul", study.findings.filter(({ evidence }) => evidence).map(({ statement, condition, verdict: word, evidence }) =>
      element("li.note", element("b", `${statement} (${condition}): ${word}.`), ` ${evidence}.`))),
  ];
}

// Its groups with the indices of their columns.
function groups_of(columns) {
  const names = [...new Set(columns.map(({ group }) => group))].filter(Boolean);
  return names.map((name) => [name, [...columns.keys()].filter((i) => columns[i].group === name)]);
}

// A chart per condition, a panel per joint.
function bars({ title, columns, rows }) {
  const reference = rows.find((row) => ["no ablation", "none"].includes(row.title)) ?? rows[0];
  const bar = ({ mean: value, ci95: [low, high], mark }) => ({ value, low, high, marked: mark === "worse" });
  const rmse_of = (indices) => indices.filter((i) => !columns[i].title.endsWith(" peak"));
  return groups_of(columns).map(([group, all]) => [group, rmse_of(all)]).map(([group, indices]) => figure(
    bar_chart(`${title}, ${group}`, rows.map((row) => row.title), indices.map((i) => ({
      title: columns[i].title, unit: columns[i].unit, reference: reference.cells[i].mean, bars: rows.map(({ cells }) => bar(cells[i])),
    }))),
    group, "Bars: mean RMSE over seeds; lines: 95 % interval; dashed: no ablation; the other colour: more than 30 % above " +
      "it. Bars longer than six times the dashed line are cut."));
}

// A panel per joint, its columns are homings.
function homings(one) {
  const line = ({ title, cells }, indices) => {
    const own = indices.map((i) => cells[i]);
    return { name: title, values: own.map(({ mean }) => mean), low: own.map(({ ci95 }) => ci95[0]), high: own.map(({ ci95 }) => ci95[1]) };
  };
  return figure(setting_chart(one.title, "homings since training", groups_of(one.columns).map(([title, indices]) => (
    { title, lines: one.rows.map((row) => line(row, indices)) }))), one.title,
  "Each point is a test recording after so many homings since training; vertical lines: 95 % interval. Logarithmic.");
}

const maps = () => study.maps.flatMap(({ condition, x, y, joints }) => joints.map(({ joint, unit, raw, bias, none }) => figure(
  map_chart(joint, x.edges, y.edges, [{ title: "before calibration", scale: 0, ...raw }, { title: "bias removed", scale: 1, ...bias },
    { title: "calibrated, first seed", scale: 1, ...none }], x.title, y.title, unit),
  `${condition}, ${joint}`,
  "RMS error by place, both directions of motion. Raw has colours of its own. Hatched: untested.")));

show_page(
  `${study.study}: ${study.networks} networks${study.missing ? `; INCOMPLETE, ${study.missing} are missing` : ""}`, verdict(), [], [
    ["findings", "The paper's findings, checked", findings()],
    ...study.tables.map((one) => [one.id, one.title.split(":")[0], study_table(one),
      one.id.startsWith("homing_") ? homings(one) : bars(one)]),
    ["maps", "Errors over the workspace", maps()],
    ["provenance", "Provenance", table([], study.provenance.map(([name, text]) => [row_header(name), text]), "table.facts")],
  ]);
