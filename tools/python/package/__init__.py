# SPDX-License-Identifier: Apache-2.0
"""Joint calibration and diagnosis of simulations, as the program ravencal does them.

Recordings, plants, models and reports are the program's files; a function calls the same library as the command of its
name. What cannot be done raises a subclass of ravencal.Error with the program's own sentence. Ctrl-C ends long work.
"""
import json as _json
import types as _types

from . import _ravencal
from ._ravencal import *


class Record(_types.SimpleNamespace):
    """An object of a JSON document: its members are attributes, and items where their name is a word of Python."""

    def __getitem__(self, name):
        return self.__dict__[name]


def _parse(text):
    return _json.loads(text, object_hook=lambda members: Record(**members))


Plant.joints = property(lambda plant: _parse(plant._json()).joints, doc="Joints with their effects, keys as in the file.")


class Report(Record):
    """What a diagnosis found: report.json, its members as attributes."""

    def __init__(self, made):
        super().__init__(**vars(_parse(made.json())))
        self._made = made

    @property
    def improved(self):
        """The plant with what was found."""
        return self._made.improved()

    def json(self):
        """The text of report.json."""
        return self._made.json()

    def write(self, folder):
        """Writes what `ravencal diagnose --out` writes."""
        self._made.write(folder)

    def __repr__(self):
        return f"<ravencal.Report: {self.verdict.kind}>"


def diagnose(training, held_out=None, *, plant, simulated=None, held_out_from_s=None, all_rows=False, alpha=0.02,
             placebos=_ravencal._USUAL_PLACEBOS, seed=1, threads=0, progress=None):
    """Finds where a plant and recordings of its robot differ, and which physics the plant lacks."""
    return Report(_ravencal._diagnose(training, held_out, plant, simulated, held_out_from_s, all_rows, alpha, placebos,
                                      seed, threads, progress))
