# SPDX-License-Identifier: Apache-2.0
"""Documented chains of commands, drawn at random: what users do with the program, in their order."""

from __future__ import annotations

import json
import math
import re

from chain import Chain

ARM_PLANTS = ("raven2", "raven2_published")
# Plant, profile and recording of robots that are no RAVEN, below the folder of recordings.
OTHER_ROBOTS = (
    ("emps", "emps", "emps/emps_train.csv"),
    ("bam_xl330", "bam_xl330", "bam_xl330/xl330_kp200_sin_sin.csv"),
    ("raven2_uiuc", "raven2_uiuc", "raven2_uiuc/raven2_joint123.csv"),
)
# Two programs that state the same error differ by the rounding of what they print.
SAME_ERROR = 1e-3
WORSE = "calibrated is worse than raw"


def motion(chain: Chain, name: str, longest_s: float = 90.0) -> str:
    """A trajectory file of one kind; says which."""
    draw = chain.random
    kind = draw.choice(("sinusoid", "sinusoid", "zigzag"))
    options: list[object] = []
    if kind == "zigzag":
        options += ["--sparsity", draw.choice(("1/1", "1/2", "1/3")), "--kind", draw.choice(("x", "y", "z", "xy", "yz", "xz", "xyz"))]
    else:
        options += ["--duration-s", round(draw.uniform(20.0, longest_s)), "--seed", chain.seed()]
        options += ["--pace", draw.choice((1, 2, 4)), "--mode", draw.choice(("paper", "code"))]
    chain.ravencal("trajectory", kind, *options, "--out", name)
    return " ".join(map(str, (kind, *options)))


def recording(chain: Chain, name: str, plant: str, trajectory: str, *options: object) -> None:
    """Each with a run seed and a homing of its own, so that no test shares the training's."""
    seed = chain.seed()
    chain.ravencal(
        "simulate", "--plant", plant, "--trajectory", trajectory, "--seed", seed, "--homing-seed", seed, *options, "--out", name
    )


def calibrate(chain: Chain) -> None:
    """Trajectory, recordings, a model, its weights, the plugin in the loop; figures that agree."""
    draw = chain.random
    plant = chain.plant(draw.choice(ARM_PLANTS))
    load = ("--payload-g", draw.choice((0, 250, 500)))
    motion(chain, "train.csv")
    motion(chain, "test.csv")
    recording(chain, "train.db", plant, "train.csv", *load)
    recording(chain, "test.db", plant, "test.csv", *load)
    method = draw.choice(
        (
            (),
            (),
            ("--method", "linear"),
            ("--method", "units"),
            ("--features", "light-open"),
            ("--features", "light-open", "--hidden", "64,32", "--epochs", 20),
            ("--validate", "validate.db", "--features", "light-open", "--hidden", "32", "--epochs", 10),
        )
    )
    if "--validate" in method:
        motion(chain, "validate.csv")
        recording(chain, "validate.db", plant, "validate.csv", *load)
    chain.ravencal("train", "train.db", *method, "--seed", chain.seed(), "--out", "model.onnx")
    chain.ravencal("info", "model.onnx")
    chain.ravencal(
        "evaluate", "model.onnx", "test.db", "--as-applied", chain.programs.plugin,
        "--json", "evaluate.json", "--report", "evaluate.html",
    )
    find_on_page(chain, chain.json("evaluate.json"), "evaluate.html")
    convert_and_host(chain)


def find_on_page(chain: Chain, evaluated: dict, name: str) -> None:
    """The first table of the page states the errors of the JSON, rounded to the digits that it shows."""
    path = chain.folder / name
    page = path.read_text() if path.exists() else ""
    for joint in evaluated.get("joints", []):
        row = re.search(rf'<th scope="row">{joint["joint"]} \[.*?</tr>', page)
        shown = re.findall(r"<td[^>]*>([\d.]+)</td>", row.group()) if row else []
        stated = [joint[kind][what] for kind in ("raw", "bias_removed", "calibrated") for what in ("rmse", "peak")]
        for text, value in zip(shown[1:], stated):
            half_a_digit = 0.5 * 10.0 ** -len(text.partition(".")[2])
            if not math.isclose(float(text), value, rel_tol=1e-9, abs_tol=1.001 * half_a_digit):
                chain.fault("disagree", f"{name}, {joint['joint']}: {text} on the page, {value} in the JSON")
        if len(shown) < 1 + len(stated):
            chain.fault("disagree", f"{name} has no row of {joint['joint']}")


def convert_and_host(chain: Chain) -> None:
    """What the documents say: int8 is refused where it costs more than 2 %, and bf16 is the next choice; a model that
    makes a joint worse on the recording of --check is refused."""
    precision = chain.random.choice(("f32", "f32", "bf16", "int8"))
    convert = ("convert", "model.onnx", "--out", "weights.blob", "--check", "test.db", "--precision")
    if precision == "int8":
        converted = chain.ravencal(*convert, "int8", "--calibrate", "train.db", may_find=True)
        if converted.exit_code == 1 and WORSE not in converted.err:
            chain.fault("int8 refused", converted.err.strip() or converted.out.strip())
            precision = "bf16"
    if precision != "int8":
        converted = chain.ravencal(*convert, precision, may_find=True)
    if WORSE in converted.err:
        chain.fault("worse", converted.err.strip())
    if converted.exit_code != 0:
        return
    chain.ravencal("info", "weights.blob")
    chain.ravencal(
        "host", "--plugin", chain.programs.plugin, "--weights", "weights.blob", "--recording", "test.db",
        "--rate-hz", 0, "--json", "host.json", last=True,
    )
    if precision == "f32":
        compare_errors(chain, chain.json("evaluate.json").get("as_applied", {}), chain.json("host.json"))


def compare_errors(chain: Chain, applied: dict, hosted: dict) -> None:
    """`evaluate --as-applied`, which is in f32, and `host` say the same of one recording."""
    in_loop = {joint["joint"]: joint for joint in hosted.get("joints", [])}
    if not applied.get("joints"):
        chain.fault("disagree", "evaluate says nothing of the plugin")
    for joint in applied.get("joints", []):
        other = in_loop.get(joint["joint"])
        if other is None:
            chain.fault("disagree", f"host says nothing of {joint['joint']}")
            continue
        for kind in ("raw", "bias_removed", "calibrated"):
            ours, theirs = joint[kind]["rmse"], other[kind]["rmse"]
            if not math.isclose(ours, theirs, rel_tol=SAME_ERROR):
                chain.fault("disagree", f"{kind} {joint['joint']}: evaluate {ours}, host {theirs}")


def encoders(chain: Chain) -> None:
    """Edges of the external encoders through the driver and the merge, then a model."""
    plant = chain.plant("raven2")
    motion(chain, "t.csv", 40.0)
    recording(chain, "robot.db", plant, "t.csv", "--edges", "edges.db")
    config = chain.programs.source / "quadrature_reader/encoders.toml"
    chain.encoders("--config", config, "--replay", "edges.db", "--replay-speed", 0, "--home", "--out", "truth.db")
    chain.ravencal("merge", "robot.db", "truth.db", "--clock", "wall", "--delay-ms", 0, "--out", "train.db")
    chain.ravencal("info", "train.db")
    chain.ravencal("train", "train.db", "--method", "linear", "--out", "model.onnx")
    motion(chain, "u.csv", 40.0)
    recording(chain, "test.db", plant, "u.csv")
    chain.ravencal("evaluate", "model.onnx", "test.db", "--json", "evaluate.json")


def channels_of(chain: Chain, file: str, *options: object) -> dict[str, tuple]:
    described = chain.ravencal("info", file, *options, "--json")
    if described.exit_code != 0:
        return {}
    return {c["name"]: (c["role"], c.get("joint"), c["unit"]) for c in json.loads(described.out)["channels"]}


def exchange(chain: Chain) -> None:
    """Out of the program and in again: what a recording says of itself stays."""
    plant = chain.plant(chain.random.choice(ARM_PLANTS))
    motion(chain, "t.csv", 30.0)
    recording(chain, "r.db", plant, "t.csv")
    before = channels_of(chain, "r.db")
    form = chain.random.choice(("generic", "generic", "raven2", "raven2-bag", "h5", "mat"))
    if form in ("h5", "mat"):
        chain.ravencal("export", "r.db", "--out", f"r.{form}")
        return
    out = "r.bag" if form == "raven2-bag" else "r.out.csv"
    chain.ravencal("export", "r.db", "--profile", form, "--out", out)
    arm = ("--arm", "gold") if form == "raven2" else ()
    chain.ravencal("import", out, "--profile", form, *arm, "--out", "again.db")
    after = channels_of(chain, "again.db")
    if form == "generic" and before != after:
        lost = [name for name in before if after.get(name) != before[name]]
        chain.fault("round trip", f"{len(lost)} of {len(before)} channels differ, {lost[:3]}")
    if form == "generic":
        chain.ravencal("train", "again.db", "--method", "linear", "--out", "model.onnx", last=True)
        chain.ravencal("diagnose", "again.db", "--plant", plant, "--placebo", 0, "--out", "why", last=True)


def diagnose(chain: Chain) -> None:
    """Recordings of a plant, diagnosed with the very plant: nothing is missing."""
    draw = chain.random
    name = draw.choice(ARM_PLANTS)
    plant = chain.plant(name)
    moved = motion(chain, "fit.csv")
    recording(chain, "fit.db", plant, "fit.csv")
    held_out: tuple[object, ...] = ()
    if draw.random() < 0.4:
        motion(chain, "held_out.csv", 40.0)
        recording(chain, "held_out.db", plant, "held_out.csv")
        held_out = ("--held-out", "held_out.db")
    chain.ravencal("diagnose", "fit.db", *held_out, "--plant", plant, "--placebo", 0, "--out", "why")
    judge_clean(chain, f"{name}, {moved}")
    if draw.random() < 0.3:
        chain.ravencal("suggest", "why", "--plant", plant, "--try", 0)


def judge_clean(chain: Chain, what: str) -> None:
    """Faults of a diagnosis of recordings that the plant itself made."""
    report = chain.json("why/report.json")
    named = [f"{effect['joint']} {effect['id']}" for effect in report.get("effects", [])]
    if named:
        chain.fault("named", f"{what}: {', '.join(named)}")
    if report.get("verdict", {}).get("kind") == "unexplained":
        chain.fault("unexplained", what)
    worse = [
        f"{row['joint']} {row['metric']} {row['before']:.3g} to {row['after']:.3g}"
        for row in report.get("held_out", [])
        if row["after"] > 1.05 * max(row["before"], row["floor"] or 0.0)
    ]
    if worse:
        chain.fault("harm", f"{what}: {'; '.join(worse)}")


def other_robot(chain: Chain) -> None:
    """A recording of another robot's, simulated along its commands, diagnosed with the very plant."""
    if chain.programs.data is None:
        return
    plant_name, profile, file = chain.random.choice(OTHER_ROBOTS)
    plant = chain.plant(plant_name)
    profile_file = chain.programs.source / "tools/profiles" / f"{profile}.toml"
    source = chain.programs.data / file
    chain.ravencal("info", source, "--profile", profile_file)
    chain.ravencal("simulate", "--plant", plant, "--follow", source, "--profile", profile_file, "--seed", chain.seed(), "--out", "s.db")
    chain.ravencal("diagnose", "s.db", "--plant", plant, "--placebo", 0, "--out", "why")
    judge_clean(chain, f"{plant_name}, along {file}")


# Each road with its share of the chains.
ROADS = ((calibrate, 9), (diagnose, 10), (exchange, 5), (encoders, 3), (other_robot, 3))


def walk(chain: Chain) -> str:
    """Draws one road and walks it; its name."""
    roads, shares = zip(*ROADS)
    road = chain.random.choices(roads, shares)[0]
    road(chain)
    return road.__name__
