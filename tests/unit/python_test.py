# SPDX-License-Identifier: Apache-2.0
"""`import ravencal`: arrays that look into recordings, errors with the program's sentences, Ctrl-C, progress, the numbers of
the program, and stubs that say what the module has."""
import ast
import gc
import json
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import threading
import unittest

import numpy as np
import ravencal

PROGRAM = os.environ["RAVENCAL_PROGRAM"]
PLANT = pathlib.Path(os.environ["RAVENCAL_SOURCE_DIR"]) / "tools/plants/raven2.toml"

ROBOT_MODEL = """<mujoco><compiler angle="radian"/><worldbody><body>
<joint name="elbow" type="hinge" axis="0 1 0" damping="0.1" frictionloss="0.2" armature="0.01"/>
<inertial pos="0.1 0 0" mass="1" diaginertia="0.01 0.02 0.02"/></body></worldbody>
<actuator><motor joint="elbow"/></actuator></mujoco>"""


def motion(seed, duration_s=20.0):
    t_s = np.arange(0.0, duration_s, 0.01)
    rates_hz = np.random.default_rng(seed).uniform(0.1, 0.2, 3)
    middle, reach = np.array([0.7, 1.43, 0.375]), np.array([0.3, 0.4, 0.04])
    return t_s, middle + reach * np.sin(2 * np.pi * rates_hz * t_s[:, None])


def two_channels(rows=1000):
    t_s = 0.01 * np.arange(rows)
    return ravencal.Recording.from_arrays({"estimate.elbow_deg": 30 * np.sin(t_s), "truth.elbow_deg": 31 * np.sin(t_s)},
                                          t_s=t_s)


class Test(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.addCleanup(os.chdir, os.getcwd())
        os.chdir(folder.name)

    def refused(self, kind, work, *words):
        with self.assertRaises(kind) as caught:
            work()
        for word in words:
            self.assertIn(word, str(caught.exception))
        return str(caught.exception)

    def program(self, *arguments):
        done = subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)


class Recordings(Test):
    def test_arrays_look_into_the_recording(self):
        recording = two_channels()
        self.assertEqual(recording.samples.shape, (1000, 2))
        self.assertTrue(recording.samples.flags.f_contiguous)
        self.assertEqual(recording.t_ns.dtype, np.int64)
        self.assertEqual(recording.t_ns[1], 10_000_000)
        self.assertTrue(np.shares_memory(recording.samples, recording["truth.elbow"]))
        self.assertTrue(np.shares_memory(recording.t_ns, recording.t_ns))  # two views
        for array in (recording.samples, recording["truth.elbow"], recording.t_ns):
            with self.assertRaises(ValueError):
                array[0] = 1

    def test_an_array_keeps_its_recording_alive(self):
        recording = two_channels(100_000)
        array, wanted = recording["truth.elbow"], recording["truth.elbow"].copy()
        del recording
        gc.collect()
        other = [two_channels(100_000) for _ in range(5)]  # would take its memory
        np.testing.assert_array_equal(array, wanted)
        self.assertEqual(len(other), 5)

    def test_a_saved_recording_is_read_back(self):
        recording = two_channels()
        recording.save("a.db")
        read = ravencal.load(pathlib.Path("a.db"))
        np.testing.assert_array_equal(read.samples, recording.samples)
        np.testing.assert_array_equal(read.t_ns, recording.t_ns)
        self.assertEqual([(c.name, c.unit, c.role, c.joint) for c in read.channels],
                         [("estimate.elbow", "rad", "joint_estimate", "elbow"), ("truth.elbow", "rad", "joint_truth", "elbow")])
        self.assertEqual(read.source, "a.db")
        self.refused(ravencal.UsageError, lambda: recording.save("a.db"), "a.db: exists already")
        recording.save("a.db", overwrite=True)
        part = ravencal.load("a.db", from_s=1, to_s=2)
        self.assertEqual((part.rows, part.meta["from_s"]), (100, "1"))

    def test_channels_say_what_arrays_are(self):
        stamps = np.array([1_700_000_000_000_000_001, 1_700_000_000_000_000_002])
        recording = ravencal.Recording.from_arrays(
            {"a": [1.0, np.nan], "b": [[1, 2], [3, 4]], "c": ["not", "read"][:0]}, t_ns=stamps, meta={"robot": "R"},
            channels=[ravencal.Channel("b[1]", unit="deg", role="motor_position", joint="j"), ravencal.Channel("a")])
        np.testing.assert_array_equal(recording.t_ns, stamps)
        np.testing.assert_allclose(recording["b[1]"], np.radians([2, 4]))
        self.assertTrue(np.isnan(recording["a"][1]))
        self.assertEqual(recording.channels[0].unit, "rad")
        self.assertEqual(recording.meta["robot"], "R")
        self.assertIn("a", recording)
        self.assertNotIn("b", recording)

    def test_names_of_arrays_suffice_with_stamps_too(self):
        recording = ravencal.Recording.from_arrays({"truth.elbow_rad": [1, 2]}, t_ns=[5, 6])
        self.assertEqual((recording.channels[0].role, list(recording.t_ns)), ("joint_truth", [5, 6]))

    def test_errors_name_place_value_and_what_exists(self):
        make = ravencal.Recording.from_arrays
        a = [ravencal.Channel("a")]
        self.refused(KeyError, lambda: two_channels()["truth.elbo"], "did you mean 'truth.elbow'?")
        self.refused(ravencal.IoError, lambda: ravencal.load("none.db"), "none.db: no such file")
        self.refused(ravencal.UsageError, lambda: ravencal.load("none.csv"), "a .csv needs --profile")
        self.refused(ravencal.UsageError, lambda: ravencal.Channel("a", role="load_"), "did you mean 'load'?")
        self.refused(ravencal.UsageError, lambda: make({"a": [1]}, channels=a), "t_s or as t_ns")
        self.refused(ravencal.DataError, lambda: make({"a": [1, 2]}, t_s=[2, 1], channels=a), "row 1: time runs backwards")
        self.refused(ravencal.DataError, lambda: make({"a": [1, 2]}, t_s=[1], channels=a), "'a' has 2 values and 't_s' has 1")
        self.refused(ravencal.DataError, lambda: make({"a": [1, 2]}, t_ns=[1], channels=a), "there are 1 stamps")
        self.refused(ravencal.DataError, lambda: make({"ab": [1]}, t_s=[1], channels=a), "no column 'a'")
        self.refused(ravencal.DataError, lambda: make({"a": [1j]}, t_s=[1], channels=a), "'a' is no array of numbers")
        for kind in (ravencal.UsageError, ravencal.DataError, ravencal.IoError, ravencal.DeviceError):
            self.assertTrue(issubclass(kind, ravencal.Error))

    def test_rows_that_cannot_be_read_are_dropped_on_request(self):
        lines = ["t_s,pos_elbow_deg,tau_elbow_Nm"] + [
            f"{0.02 * i:.2f},{9 * np.sin(0.2 * i):.4f},{np.cos(i):.4f}" for i in range(40)
        ]
        lines[17] = "0.32"
        pathlib.Path("cut.csv").write_text("\n".join(lines), encoding="utf-8")
        guessed = ravencal.guess_profile("cut.csv", skip_bad=True)
        pathlib.Path("cut.toml").write_text(guessed.text, encoding="utf-8")
        channels = [ravencal.Channel("a", "rad", "joint_estimate", "a")]
        for work in (
            lambda **how: ravencal.guess_profile("cut.csv", **how),
            lambda **how: ravencal.load("cut.csv", profile="cut.toml", **how),
            lambda **how: ravencal.Recording.from_arrays({"a": [1, 2, 3]}, t_s=[1, 3, 2], channels=channels, **how),
        ):
            self.assertNotIn("--skip-bad", self.refused(ravencal.DataError, work, "use skip_bad=True"))
            work(skip_bad=True)

    def test_a_guessed_profile_reads_the_table(self):
        t_s = 0.01 * np.arange(500)
        arrays = {"t_s": t_s, "pos_elbow_deg": 30 * np.sin(t_s), "tau_elbow": np.cos(t_s)}
        guessed = ravencal.guess_profile(arrays, joints=["elbow"])
        self.assertIn("[[channel]]", guessed.text)
        self.assertTrue(all(isinstance(question, str) for question in guessed.questions))
        np.savez("run.npz", **arrays)
        of_file = ravencal.guess_profile("run.npz", joints=["elbow"])
        self.assertEqual(of_file.text.split("\n", 1)[1], guessed.text.split("\n", 1)[1])
        pathlib.Path("run.toml").write_text(of_file.text, encoding="utf-8")
        read = ravencal.load("run.npz", profile="run.toml")
        np.testing.assert_allclose(read["elbow.position"], np.radians(arrays["pos_elbow_deg"]))


class Plants(Test):
    def test_a_plant_keeps_its_text(self):
        plant = ravencal.Plant.load(PLANT)
        self.assertEqual([joint.name for joint in plant.joints], ["shoulder", "elbow", "insertion"])
        self.assertIn("coupling", [effect.id for effect in plant.joints[1].effects])
        plant.save("plant.toml")
        self.assertEqual(ravencal.Plant.load("plant.toml").text(), plant.text())
        self.refused(ravencal.UsageError, lambda: plant.save("plant.toml"), "exists already")
        pathlib.Path("wrong.toml").write_text(plant.text().replace("mass_kg", "mas_kg", 1), encoding="utf-8")
        self.refused(ravencal.DataError, lambda: ravencal.Plant.load("wrong.toml"), "wrong.toml:", "mass_kg is missing")

    def test_a_robot_model_is_a_plant(self):
        pathlib.Path("robot.xml").write_text(ROBOT_MODEL, encoding="utf-8")
        plant = ravencal.Plant.load("robot.xml")
        self.assertEqual([joint.name for joint in plant.joints], ["elbow"])
        self.refused(ravencal.DataError, lambda: ravencal.simulate(plant, motion(1)), "the 1 joints of robot.xml")
        t_s, joints = motion(1)
        self.assertEqual(ravencal.simulate(plant, (t_s, joints[:, 1:2])).samples.shape[0], len(t_s))


class Program(Test):
    """What the module makes is what the program makes of the same files."""

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        plant = ravencal.Plant.load(PLANT)
        for seed in (1, 2):
            ravencal.simulate(plant, motion(seed), seed=seed, homing_seed=seed, out=f"{cls.folder.name}/{seed}.db")

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def setUp(self):
        super().setUp()
        for seed in (1, 2):
            os.symlink(f"{self.folder.name}/{seed}.db", f"{seed}.db")
        self.plant = ravencal.Plant.load(PLANT)
        self.one, self.two = ravencal.load("1.db"), ravencal.load("2.db")

    def same_files(self, one, other):
        self.assertEqual(sorted(os.listdir(one)), sorted(os.listdir(other)))
        for name in os.listdir(one):
            self.assertEqual(pathlib.Path(one, name).read_bytes(), pathlib.Path(other, name).read_bytes(), name)

    def test_simulations_are_the_same(self):
        self.program("trajectory", "sinusoid", "--duration-s", 5, "--seed", 3, "--out", "t.csv")
        self.program("simulate", "--plant", PLANT, "--trajectory", "t.csv", "--seed", 4, "--payload-g", 250, "--out", "p.db")
        made, read = ravencal.simulate(self.plant, "t.csv", seed=4, payload_g=250), ravencal.load("p.db")
        np.testing.assert_array_equal(made.samples, read.samples)
        self.assertEqual(made.meta, read.meta)
        self.program("simulate", "--plant", PLANT, "--follow", "p.db", "--out", "f.db")
        followed = ravencal.simulate(self.plant, follow=read)
        np.testing.assert_array_equal(followed.samples, ravencal.load("f.db").samples)
        self.assertEqual([joint.joint for joint in followed.followed], ["shoulder", "elbow", "insertion"])

    def test_models_and_their_figures_are_the_same(self):
        model = ravencal.train(self.one, method="linear")
        model.save("m.onnx")
        self.program("train", "1.db", "--method", "linear", "--out", "p.onnx")
        self.assertEqual(pathlib.Path("m.onnx").read_bytes(), pathlib.Path("p.onnx").read_bytes())
        self.assertEqual(ravencal.Model.load("p.onnx").features, model.features)
        self.program("evaluate", "p.onnx", "2.db", "--json", "e.json")
        evaluation = ravencal.evaluate(model, [self.two])
        self.assertEqual(evaluation.json(), pathlib.Path("e.json").read_text(encoding="utf-8"))
        elbow = evaluation["elbow"]
        self.assertAlmostEqual(np.sqrt(np.mean((elbow.corrected - elbow.truth) ** 2)), elbow.calibrated.rmse)
        self.assertLess(elbow.calibrated.rmse, elbow.raw.rmse)
        self.assertEqual(evaluation.warnings, [])
        self.refused(ravencal.DataError, lambda: ravencal.evaluate(model, self.one), "1.db: has the run seed 1 of 1.db", "same")
        same = ravencal.evaluate(model, self.one, same_seed=True)
        self.assertIn("the model was trained on it", same.warnings[0])
        self.assertIn("same seed: ", str(same))
        self.assertEqual(json.loads(same.json())["same_seed"][0]["seed"], 1)
        self.assertNotIn("same_seed", json.loads(evaluation.json()))
        self.refused(KeyError, lambda: evaluation["elbo"], "did you mean 'elbow'?")
        self.refused(ravencal.UsageError, lambda: ravencal.train([self.one, self.one]), "1.db: is given twice")
        self.refused(ravencal.UsageError, lambda: ravencal.train(self.one, method="linea"), "did you mean 'linear'?")

    def test_reports_are_the_same(self):
        report = ravencal.diagnose(self.one, self.two, plant=self.plant, placebos=1, seed=5)
        report.write("module")
        self.program("diagnose", "1.db", "--held-out", "2.db", "--plant", PLANT, "--placebo", 1, "--seed", 5, "--out", "program")
        self.same_files("module", "program")
        document = json.loads(report.json())
        written = json.loads(pathlib.Path("program/report.json").read_text(encoding="utf-8"))
        self.assertEqual(set(written.pop("files")), {"report.html", "plant_improved.toml"})
        self.assertEqual(document, written)
        self.assertEqual(report.verdict.kind, document["verdict"]["kind"])
        self.assertIn(report.improved.text(), pathlib.Path("module/plant_improved.toml").read_text(encoding="utf-8"))

    def test_reports_of_a_table_in_any_order_are_the_same(self):
        for name in "12":
            self.program("export", f"{name}.db", "--out", f"{name}.csv")
        tables = [ravencal.load(f"{name}.csv", profile="1.csv.toml") for name in "21"]
        ravencal.diagnose(tables, plant=self.plant, placebos=0, held_out_from_s=12).write("module")
        self.program("diagnose", "1.csv", "2.csv", "--profile", "1.csv.toml", "--plant", PLANT, "--placebo", 0,
                     "--held-out-from", 12, "--out", "program")
        self.same_files("module", "program")

    def test_another_simulator_replaces_the_plant(self):
        other = ravencal.simulate(self.plant, follow=self.one, payload_g=300, out="s.db")
        ravencal.diagnose(self.one, plant=self.plant, simulated=other, placebos=0).write("module")
        self.program("diagnose", "1.db", "--plant", PLANT, "--simulated", "s.db", "--placebo", 0, "--out", "program")
        self.same_files("module", "program")

    def test_a_robot_model_is_written_back(self):
        pathlib.Path("robot.xml").write_text(ROBOT_MODEL, encoding="utf-8")
        t_s = 0.01 * np.arange(3000)
        position = 0.5 * np.sin(2 * t_s)
        effort = -2 * np.sin(2 * t_s) * 0.03 + 0.1 * np.cos(2 * t_s) + 0.2 * np.sign(np.cos(2 * t_s)) - 0.98 * np.cos(position)
        ravencal.Recording.from_arrays({"p": position, "e": effort + 0.01 * np.cos(37 * t_s)}, t_s=t_s, channels=[
            ravencal.Channel("p", "rad", "joint_estimate", "elbow"), ravencal.Channel("e", "N_m", "drive_torque", "elbow"),
        ]).save("r.db")
        ravencal.diagnose(ravencal.load("r.db"), plant=ravencal.Plant.load("robot.xml"), placebos=0).write("module")
        self.program("diagnose", "r.db", "--plant", "robot.xml", "--placebo", 0, "--out", "program")
        self.assertIn("robot_improved.xml", os.listdir("module"))
        self.same_files("module", "program")

    def test_what_counts_twice_is_refused(self):
        diagnose = ravencal.diagnose
        same = ravencal.load("./1.db")
        self.refused(ravencal.UsageError, lambda: diagnose([self.one, same], plant=self.plant), "1.db: is given twice")
        self.refused(ravencal.UsageError, lambda: diagnose(self.one, same, plant=self.plant), "is among the recordings to fit")
        arrays = two_channels()
        self.refused(ravencal.UsageError, lambda: diagnose(arrays, arrays, plant=self.plant), "arrays: is given twice")
        self.refused(ravencal.UsageError, lambda: diagnose([], plant=self.plant), "at least one")
        self.refused(ravencal.UsageError, lambda: diagnose(self.one, plant=self.plant, alpha=0.9), "alpha: 0.9 is not in")
        self.refused(TypeError, lambda: diagnose("1.db", plant=self.plant), "ravencal.load reads a file")
        begin, end = ravencal.load("1.db", to_s=10), ravencal.load("1.db", from_s=10)
        report = diagnose(begin, end, plant=self.plant, placebos=0)
        self.assertEqual((report.provenance.from_s, report.provenance.to_s), ("none, 10", "10, none"))

    def test_progress_rises_on_the_calling_thread_while_others_run(self):
        shares, threads, other = [], set(), []
        stop = threading.Event()
        counter = threading.Thread(target=lambda: [other.append(1) for _ in iter(lambda: stop.wait(0.001), True)])
        counter.start()

        def progress(share, what):
            self.assertTrue(what)
            shares.append((share, len(other)))
            threads.add(threading.current_thread())

        ravencal.diagnose(self.one, plant=self.plant, placebos=2, progress=progress)
        stop.set()
        counter.join()
        self.assertGreater(len(shares), 2)
        self.assertEqual(shares, sorted(shares))
        self.assertTrue(all(0 <= share <= 1 for share, _ in shares))
        self.assertEqual(threads, {threading.current_thread()})
        self.assertGreater(shares[-1][1], shares[0][1], "no other thread ran")

    def test_what_progress_raises_comes_out(self):
        for work in (lambda progress: ravencal.diagnose(self.one, plant=self.plant, progress=progress),
                     lambda progress: ravencal.train(self.one, progress=progress),
                     lambda progress: ravencal.simulate(self.plant, motion(1, 1000), progress=progress)):
            with self.assertRaises(ZeroDivisionError):
                work(lambda share, what: 1 // 0)

    def test_ctrl_c_is_a_keyboard_interrupt(self):
        """Of work that would take hours; a test that waits for it hangs."""
        for work in ("diagnose(ravencal.load('1.db'), plant=plant, placebos=10000, ", "simulate(plant, (t, j), "):
            script = f"""import ravencal, numpy as np
plant = ravencal.Plant.load({str(PLANT)!r})
t, j = np.arange(1e6), np.tile([0.7, 1.4, 0.375], (1000000, 1))
try:
    ravencal.{work}progress=lambda share, what: print('begun', flush=True))
except KeyboardInterrupt:
    print('interrupted')
"""
            with subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True) as child:
                self.assertEqual(child.stdout.readline(), "begun\n")
                child.send_signal(signal.SIGINT)
                self.assertEqual(child.communicate()[0].split()[-1], "interrupted")
                self.assertEqual(child.returncode, 0)


def members(body):
    """Public names of the body of a stub's class or file."""
    names = set()
    for node in body:
        if isinstance(node, (ast.FunctionDef, ast.ClassDef)):
            names.add(node.name)
        elif isinstance(node, ast.AnnAssign):
            names.add(node.target.id)
    return {name for name in names if not name.startswith("_")}


class Stubs(unittest.TestCase):
    def test_say_what_the_module_has(self):
        file = pathlib.Path(ravencal.__file__).with_suffix(".pyi")
        self.assertTrue(file.with_name("py.typed").exists())
        body = ast.parse(file.read_text(encoding="utf-8")).body
        self.assertEqual(members(body), {name for name in dir(ravencal) if not name.startswith("_")})
        for node in body:
            if not isinstance(node, ast.ClassDef) or issubclass(getattr(ravencal, node.name), Exception):
                continue
            with self.subTest(node.name):
                had = {name for name in dir(getattr(ravencal, node.name)) if not name.startswith("_")}
                if node.name == "Report":  # its members come with the document
                    schema = pathlib.Path(os.environ["RAVENCAL_SOURCE_DIR"]) / "shared/schemas/report.schema.json"
                    had |= set(json.loads(schema.read_text(encoding="utf-8"))["properties"]) - {"files"}  # of the file alone
                self.assertEqual(members(node.body), had)


if __name__ == "__main__":
    unittest.main()
