#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What `ravencal train` expects of itself, and what comes on test files.

    train_rows.py RAVENCAL DATA OUT [SET...]

RAVENCAL: the program. DATA: the folder with the recordings, each in a folder of its own. OUT: a folder
for models and simulated recordings, which are made once. SET: davinci, berkeley, jhu, so101, twin;
without any, all of these. Prints per joint and test the RMSE with the expected one and its 95 % interval,
then how many lie inside and the median of tested over expected. Units are degrees and mm. Further sets
of the twin: lengths (0.65 to 20.8 min of zig-zag), rivals (`compare` on the rows of twin, 4.3 min) and
equations (what is left where the twin's equations are known).

Each recording of the twin has a run seed of its own, and none that is tested on has the homing of one
that trains: what wanders, and the constant that a homing leaves, are new in every test.
"""

import csv
import json
import math
import pathlib
import statistics
import subprocess
import sys

SO101_TRAINING = ["velocity_ramp", "trapezoidal_profile", "multisine", "workspace_sweep"]
TWIN = pathlib.Path(__file__).resolve().parents[2] / "tools/plants/raven2.toml"
SO101_JOINTS = ["rotation", "pitch", "elbow", "wrist_pitch", "wrist_roll"]


def call(*arguments):
    done = subprocess.run([str(a) for a in arguments], capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, arguments))}\n{done.stderr}")
    return done.stdout


class Rows:
    def __init__(self, ravencal, data, out):
        self.ravencal, self.data, self.out = ravencal, data, out
        self.ratios, self.inside = [], 0

    def profile(self, name):
        root = pathlib.Path(__file__).resolve().parents[2]
        return ["--profile", root / "tools/profiles" / f"{name}.toml"]

    def add(self, name, training, tests, *options, train_options=()):
        """One model, and a line per joint and test."""
        model = self.out / f"{name}.onnx"
        call(self.ravencal, "train", *training, "--out", model, *options, *train_options)
        for test, files in tests.items():
            figures = self.out / f"{name}_{test}.json"
            call(self.ravencal, "evaluate", model, *files, "--json", figures, *options)
            for joint in json.loads(figures.read_text())["joints"]:
                self.line(name, test, joint)

    def line(self, name, test, joint):
        expected, came = joint["expected"], joint["calibrated"]["rmse"]
        low, high = expected["interval_95"]
        inside = low <= came <= high
        self.inside += inside
        self.ratios.append(came / expected["rmse"])
        print(f"{name:<16} {test:<18} {joint['joint']:<12} {joint['unit']:<4}"
              f" bias removed {joint['bias_removed']['rmse']:8.3f}  came {came:7.3f}"
              f"  expected {expected['rmse']:7.3f} [{low:7.3f}, {high:7.3f}]"
              f" {'yes' if inside else 'no '}"
              f"  about the mean: came {joint['rmse_about_mean']:7.3f},"
              f" expected {expected['rmse_about_mean']:7.3f}"
              f"  confidence {joint['confidence']:4.2f}"
              f", distance ranks errors {joint.get('distance_rank', float('nan')):5.2f}",
              flush=True)

    def summary(self):
        count = len(self.ratios)
        print(f"{self.inside} of {count} inside; median of tested over expected"
              f" {statistics.median(self.ratios):.2f}")

    def davinci(self):
        folder = self.data / "davinci_tool4"
        tests = {"unseen_loads": sorted(folder.glob("test_*.csv")),
                 "later": sorted(folder.glob("later_*.csv"))}
        profile = self.profile("davinci_tool4")
        self.add("davinci", sorted(folder.glob("train_*.csv")), tests, *profile)
        with_torque = self.out / "davinci_torque.toml"
        with_torque.write_text(profile[1].read_text().replace(
            'unit = "mN_m"\nrole = "load"', 'unit = "mN_m"\nrole = "drive_torque"', 1))
        self.add("davinci_torque", sorted(folder.glob("train_*.csv")),
                 {"unseen_loads": tests["unseen_loads"]}, "--profile", with_torque)
        self.add("davinci_one", [folder / "train_f01_load010.csv"],
                 {"unseen_loads": tests["unseen_loads"]}, *profile)

    def berkeley(self):
        folder = self.data / "dvrk_berkeley"
        tests = {name: [folder / f"{name}.csv"]
                 for name in ("train_peg", "train_pickplace", "verif_random_user")}
        self.add("berkeley", [folder / "train_random.csv"], tests, *self.profile("dvrk_berkeley"),
                 train_options=["--joints", "q4,q5,q6"])

    def jhu(self):
        """Three depths of the tip train, four others test."""
        depths = {"train": ("0.205", "0.155", "0.105"),
                  "test": ("0.1925", "0.18", "0.1425", "0.13")}
        with open(self.data / "dvrk_jhu_tracker/dwell_means.csv", newline="") as file:
            header, *rows = csv.reader(file)
        depth = header.index("nominal_depth_m")
        for use, wanted in depths.items():
            with open(self.out / f"jhu_{use}.csv", "w", newline="") as file:
                writer = csv.writer(file)
                writer.writerow(header)
                writer.writerows(r for r in rows
                                 if any(abs(-float(r[depth]) - float(w)) < 1e-6 for w in wanted))
        self.add("jhu", [self.out / "jhu_train.csv"], {"depths": [self.out / "jhu_test.csv"]},
                 *self.profile("dvrk_jhu_tracker"))

    def so101(self):
        folder = self.data / "so101"
        training = [folder / f"{name}.csv" for name in SO101_TRAINING]
        tests = {name: [folder / f"{name}.csv"] for name in ("step_response", "chirp_sweep")}
        self.add("so101", training, tests, *self.profile("so101"),
                 train_options=["--joints", ",".join(SO101_JOINTS)])

    def recorded(self, name, trajectory, seed, homing_seed):
        """A recording of the twin."""
        motion, recording = self.out / f"{name}.csv", self.out / f"{name}.db"
        if not recording.exists():
            call(self.ravencal, "trajectory", *trajectory, "--out", motion, "--force")
            call(self.ravencal, "simulate", "--plant", TWIN, "--trajectory", motion, "--seed", seed,
                 "--homing-seed", homing_seed, "--out", recording)
        return recording

    def twin_zigzags(self):
        """Of sparsity 1/2 to 1/6, each after a homing of its own; 20.8 min."""
        return [self.recorded(f"z{n}", ["zigzag", "--sparsity", f"1/{n}"], n, n) for n in range(2, 7)]

    def twin_session(self):
        """Two zig-zags after one homing; 4.3 min."""
        return [self.recorded(f"one_z{n}", ["zigzag", "--sparsity", f"1/{n}"], 10 + n, 12)
                for n in (2, 3)]

    def twin_tests(self):
        """Three random motions, each after a homing of its own."""
        return [self.recorded(f"h{n}", ["sinusoid", "--duration-s", "120", "--seed", n], 100 + n, 100 + n)
                for n in range(1, 4)]

    def twin(self):
        self.add("twin_4min", self.twin_session(), {"homed_anew": self.twin_tests()})
        self.add("twin_21min", self.twin_zigzags(), {"homed_anew": self.twin_tests()})

    def lengths(self):
        """The first zig-zags of five, and the first 39 s of one."""
        zigzags, tests = self.twin_zigzags(), {"homed_anew": self.twin_tests()}
        self.add("twin_0.65min", zigzags[:1], tests, train_options=["--to-s", "39"])
        for count in range(1, len(zigzags) + 1):
            self.add(f"twin_{count}_zigzags", zigzags[:count], tests)

    def rivals(self):
        print(call(self.ravencal, "compare", "--train", *self.twin_session(), "--test", *self.twin_tests(),
                   "--methods", "bias", "ridge", "gp", "bouc_wen", "chosen", "--no-curve",
                   "--out", self.out / "rivals"))

    def equations(self):
        """`simulate --follow` with the very plant, about each recording's mean, as homing draws it."""
        squares = {}
        for number, test in enumerate(self.twin_tests()):
            followed = call(self.ravencal, "simulate", "--plant", TWIN, "--follow", test, "--force", "--json",
                            "--out", self.out / f"followed_{number}.db")
            for joint in json.loads(followed)["joints"]:
                squares.setdefault(joint["joint"], []).append(joint["rmse"] ** 2)
        for joint, each in squares.items():
            unit, per_si = ("mm", 1e3) if joint == "insertion" else ("deg", math.degrees(1))
            print(f"{'twin_equations':<16} {joint:<12} {unit:<4} about the mean"
                  f" {per_si * math.sqrt(statistics.mean(each)):7.3f}")


def main():
    if len(sys.argv) < 4:
        sys.exit(__doc__)
    ravencal, data, out = (pathlib.Path(a) for a in sys.argv[1:4])
    out.mkdir(parents=True, exist_ok=True)
    rows = Rows(ravencal, data, out)
    for name in sys.argv[4:] or ("davinci", "berkeley", "jhu", "so101", "twin"):
        getattr(rows, name)()
    if rows.ratios:
        rows.summary()


main()
