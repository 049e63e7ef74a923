#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What `ravencal train` expects of itself, and what comes on test files.

    train_rows.py RAVENCAL DATA OUT [SET...]

RAVENCAL: the program. DATA: the folder with the recordings, each in a folder of its own. OUT: a folder
for models and simulated recordings, which are made once. SET: davinci, berkeley, jhu, so101, twin;
without any, all. Prints per joint and test the RMSE with the expected one and its 95 % interval, then
how many lie inside and the median of tested over expected. Units are degrees and mm.
"""

import csv
import json
import pathlib
import statistics
import subprocess
import sys

SO101_TRAINING = ["velocity_ramp", "trapezoidal_profile", "multisine", "workspace_sweep"]
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

    def recorded(self, name, trajectory, seed):
        """A recording of the twin."""
        motion, recording = self.out / f"{name}.csv", self.out / f"{name}.db"
        if not recording.exists():
            call(self.ravencal, "trajectory", *trajectory, "--out", motion, "--force")
            plant = pathlib.Path(__file__).resolve().parents[2] / "tools/plants/raven2.toml"
            call(self.ravencal, "simulate", "--plant", plant, "--trajectory", motion, "--seed", seed,
                 "--out", recording)
        return recording

    def twin(self):
        """A seed of the twin is a homing: one session, and five with tests that are homed anew."""
        zigzag = {n: ["zigzag", "--sparsity", f"1/{n}"] for n in range(2, 7)}
        one = [self.recorded(f"one_z{n}", zigzag[n], 2) for n in (2, 3)]
        five = [self.recorded(f"z{n}", motion, n) for n, motion in zigzag.items()]
        random = {n: ["sinusoid", "--duration-s", "120", "--seed", n] for n in range(1, 4)}
        same = [self.recorded(f"s{n}", motion, 2) for n, motion in random.items()]
        anew = [self.recorded(f"h{n}", motion, 100 + n) for n, motion in random.items()]
        self.add("twin_4min", one, {"same_session": same})
        self.add("twin_21min", five, {"homed_anew": anew})


def main():
    if len(sys.argv) < 4:
        sys.exit(__doc__)
    ravencal, data, out = (pathlib.Path(a) for a in sys.argv[1:4])
    out.mkdir(parents=True, exist_ok=True)
    rows = Rows(ravencal, data, out)
    for name in sys.argv[4:] or ("davinci", "berkeley", "jhu", "so101", "twin"):
        getattr(rows, name)()
    rows.summary()


main()
