# SPDX-License-Identifier: Apache-2.0
"""From a simulated arm to its calibration, cell by cell.

Usage: example.py PLANT, e.g. tools/plants/raven2.toml; of the Debian package /usr/share/ravencal/tools/plants/raven2.toml.
"""
# %% A robot, as its simulation has it.
import sys

import numpy as np
import ravencal

plant = ravencal.Plant.load(sys.argv[1])
print([joint.name for joint in plant.joints])


# %% Recordings. With a robot: ravencal.load("run1.db"), or ravencal.load("run1.csv", profile="run1.toml").
# Here the digital twin makes two, each along slow sines through the workspace, with 500 g at the tool that the plant lacks.
def motion(seed, duration_s=100.0):
    t_s = np.arange(0.0, duration_s, 0.01)
    random = np.random.default_rng(seed)
    middle = np.array([np.radians(40), np.radians(82), 0.375])  # rad, rad, m
    reach = np.array([np.radians(20), np.radians(27), 0.045])
    rates_hz = random.uniform(0.1, 0.2, 3)
    return t_s, middle + reach * np.sin(2 * np.pi * rates_hz * t_s[:, None])


# Another seed wanders otherwise, and another homing leaves another constant: the test has neither of the training.
training = ravencal.simulate(plant, motion(1), seed=1, homing_seed=1, payload_g=500)
test = ravencal.simulate(plant, motion(2), seed=2, homing_seed=2, payload_g=500)

# A channel is a NumPy array that looks into the recording. What the robot believes is off by so much:
for joint in plant.joints:
    error = test[f"truth.{joint.name}"] - test[f"jpos.{joint.name}"]
    print(f"{joint.name}: {np.sqrt(np.mean(error**2)):.4f} {'rad' if joint.kind == 'revolute' else 'm'} RMS")

# %% What does the simulation lack? `placebos` (20 where nothing is said) would measure how often such an answer is false.
report = ravencal.diagnose(training, test, plant=plant, placebos=0)
print(report.verdict.headline)
for cause in report.causes:
    print(f"{cause.name}: {cause.sentence} ({', '.join(cause.joints)})")
    for effect in (report.effects[number] for number in cause.effects):
        print(f"  {effect.joint} {effect.id}", [f"{p.name} {p.value:.3g} {p.unit}" for p in effect.parameters])
# report.write("why") leaves the page, report.json and plant_improved.toml; report.improved is that plant.

# %% Learn the error, and try the calibration on the recording that training did not see.
model = ravencal.train(training)
evaluation = ravencal.evaluate(model, test)
print(evaluation)
for joint in evaluation.joints:
    print(f"{joint.joint}: {joint.raw.rmse:.4g} -> {joint.calibrated.rmse:.4g} {joint.unit}")
# model.save("arm.onnx") writes what `ravencal convert` makes weights of.
