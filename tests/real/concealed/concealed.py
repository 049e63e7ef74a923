#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""concealed.sh RAVENCAL DATA_DIR OUT_DIR: what `ravencal diagnose` says of real machines whose published physics is
taken out of the plant (cases.toml). Prints a Markdown table; OUT_DIR/concealed.html is the same with the free runs
of every length and the page of each case.

Exit status: 0 where at least nine cases in ten are right, 1 where fewer are, 2 usage, 3 a case that did not run.
"""
import html
import json
import pathlib
import re
import subprocess
import sys
import tomllib

HERE = pathlib.Path(__file__).resolve().parent
PROFILES = HERE.parents[2] / "tools" / "profiles"
ASKED = 0.9
COLUMNS = ("set", "concealed", "known", "said", "held-out error given / improved / floor",
           "free run of 1 s given / improved", "right")
PAGE = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>Effects concealed on real machines</title><style>
body {{ font: 15px/1.45 sans-serif; margin: 2rem auto; max-width: 90rem; padding: 0 1rem; color: #222 }}
table {{ border-collapse: collapse }} th, td {{ border: 1px solid #bbb; padding: .35rem .6rem; text-align: left;
vertical-align: top }} th {{ background: #f2f2f2 }} .no {{ background: #fbe3e0 }}
td:nth-last-child(2) {{ white-space: nowrap }}
</style></head><body><h1>Effects concealed on real machines</h1>
<p>Each row takes published physics out of the plant of a real machine and asks <code>ravencal diagnose</code> for it.
A row is right where all effects that were taken out are named, with values inside the tolerance that is asked, and
nothing else is named. Held-out errors and free runs are of recordings that no fit saw. <i>Refitted</i> is the given
plant with its own numbers fitted again.</p>
<table><tr>{head}</tr>
{rows}</table><p><b>{summary}</b></p></body></html>
"""


def plant_without(text, removed, set_keys, of_joint):
    blocks = re.split(r"(?m)^(?=\s*\[)", text)
    kept, joint = [], ""
    for block in blocks:
        name = re.search(r'(?m)^name = "(.*)"', block)
        joint = name[1] if name and "[[joint]]" in block else joint
        concerned = not of_joint or joint == of_joint
        if not (concerned and any(f'id = "{effect}"' in block for effect in removed)):
            kept.append(block)
    kept = "".join(re.sub(rf'(?m)^\s*"({"|".join(removed)})\..*\n', "", b) if removed else b for b in kept)
    for key, value in set_keys.items():
        kept, changed = re.subn(rf"(?m)^(\s*{key} = )[-+.\deE]+", rf"\g<1>{value}", kept)
        if changed != 1:
            raise ValueError(f"concealed.py: the plant has {key} {changed} times, not once")
    return kept


def files_of(data, patterns):
    files = [str(f) for pattern in patterns for f in sorted(data.glob(pattern))]
    if not files:
        raise FileNotFoundError(f"concealed.py: {data} has none of {', '.join(patterns)}")
    return files


def diagnosed(ravencal, data, out, machine, case):
    out.mkdir(parents=True, exist_ok=True)
    plant = out / "plant.toml"
    plant.write_text(plant_without((HERE / machine["plant"]).read_text(), case.get("remove", []),
                                   case.get("set_keys", {}), case.get("joint", "")))
    done = subprocess.run([ravencal, "diagnose", *files_of(data, machine["training"]), "--plant", plant, "--profile",
                           PROFILES / machine["profile"], "--held-out", *files_of(data, machine["held_out"]),
                           "--out", out, "--placebo", "0"], capture_output=True, text=True)
    if done.returncode > 1:
        raise RuntimeError(done.stdout + done.stderr)
    return json.loads((out / "report.json").read_text())


def is_right(report, expected, is_complete):
    """Each expected effect with its value, and no other one; errors without a name of complete models none."""
    named = {e["id"]: e for e in report["effects"] if is_complete or e["id"] != "unknown"}
    if set(named) != {e["id"] for e in expected} or (is_complete and report["unexplained"]):
        return False
    for e in expected:
        if "value" not in e:
            continue
        value = next(p["value"] for p in named[e["id"]]["parameters"] if p["name"] == e["parameter"])
        if abs(value - e["value"]) > e["tolerance"] * abs(e["value"]):
            return False
    return True


def said_of(report):
    said = [f"{effect['id']} " + ", ".join(f"{p['name']} {p['value']:.3g} ({p['ci95'][0]:.3g} to {p['ci95'][1]:.3g})"
                                           for p in effect["parameters"] if not p["name"].startswith("begin_"))
            for effect in report["effects"]]
    return "; ".join(said + ["unexplained" for _ in report["unexplained"]]) or "nothing"


def figures(report, metric, with_floor):
    for row in report["held_out"]:
        if row["metric"] == metric:
            floor = f" / {row['floor']:.3g}" if with_floor else ""
            return f"{row['before']:.3g} / {row['after']:.3g}{floor} {row['unit']}"
    return ""


def known(machine, expected):
    values = [f"{e['parameter']} {e['value']} +- {100 * e['tolerance']:.0f} %" for e in expected if "value" in e]
    return f"{'; '.join(values) or '-'} ({machine['source']})"


def drift(report):
    return "\n".join(f"{row['horizon_s']:g} s: {row['before']:.3g} / {row['refitted']:.3g} / {row['after']:.3g} "
                     f"{row['unit']}" for row in report["drift"])


def page_row(folder, cells, drift_text, as_expected):
    set_name, concealed, *others = cells[:-2]
    link = f'<a href="{html.escape(folder)}/report.html">{html.escape(concealed)}</a>'
    shown = [html.escape(text) for text in (*others, drift_text, cells[-1].strip("*"))]
    tds = "".join(f"<td>{text}</td>" for text in (html.escape(set_name), link, *shown)).replace("\n", "<br>")
    return f"<tr{'' if as_expected else ' class=no'}>{tds}</tr>\n"


def main():
    if len(sys.argv) != 4:
        print(__doc__, file=sys.stderr)
        return 2
    ravencal, data, out = sys.argv[1], pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3])
    cases = tomllib.loads((HERE / "cases.toml").read_text())
    print("| " + " | ".join(COLUMNS) + " |\n|" + "---|" * len(COLUMNS))
    right, rows = 0, ""
    for number, case in enumerate(cases["case"]):
        machine = cases[case["set"]]
        folder = f"{number:02}_{case['set']}"
        try:
            report = diagnosed(ravencal, data, out / folder, machine, case)
        except (OSError, ValueError, RuntimeError) as error:
            print(error, file=sys.stderr)
            return 3
        as_expected = is_right(report, case["expect"], machine.get("is_complete", True))
        right += as_expected
        cells = (case["set"], case["concealed"], known(machine, case["expect"]), said_of(report),
                 figures(report, "effort_rmse", True), figures(report, "free_run_1s_rmse", False),
                 "yes" if as_expected else "**no**")
        print("| " + " | ".join(cells) + " |", flush=True)
        rows += page_row(folder, cells, drift(report), as_expected)
    summary = f"{right} of {len(cases['case'])} right"
    head = "".join(f"<th>{name}</th>" for name in (*COLUMNS[:-2], "free run given / refitted / improved", COLUMNS[-1]))
    (out / "concealed.html").write_text(PAGE.format(head=head, rows=rows, summary=summary))
    print(f"\n{summary}\n{out / 'concealed.html'}")
    return 0 if right >= ASKED * len(cases["case"]) else 1


if __name__ == "__main__":
    sys.exit(main())
