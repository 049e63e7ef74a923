# SPDX-License-Identifier: Apache-2.0
#
# Types of `import ravencal`. Values are in SI units (rad, m, N m) where nothing else is said; times named t_s and *_s are
# in s, t_ns in ns. A path is a str or a pathlib.Path. Functions raise ravencal.Error as each subclass says, and
# KeyboardInterrupt at Ctrl-C.
import os
from types import SimpleNamespace
from typing import Any, Callable, Mapping, Optional, Sequence, Tuple, Union, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

_Path = Union[str, "os.PathLike[str]"]
_Recordings = Union["Recording", Sequence["Recording"]]
_Progress = Optional[Callable[[float, str], object]]
"""Called with the share done, 0 to 1, and what is in work, on the calling thread, about every 50 ms. What it raises ends
the work and comes out of the call."""
_Floats = NDArray[np.float64]

class Error(Exception):
    """What ravencal cannot do; the message is the program's sentence: what, where, the value, and the remedy."""

class UsageError(Error):
    """Asks for something that does not exist or does not fit."""

class DataError(Error):
    """The content of a file or of arrays is wrong."""

class IoError(Error):
    """The operating system refuses to read or write."""

class DeviceError(Error):
    """A device is missing or failed."""

class Channel:
    """A column of a recording. Units and roles: FORMATS.md."""

    def __init__(self, name: str, unit: str = "1", role: str = "feature", joint: str = "") -> None: ...
    @property
    def name(self) -> str: ...
    @property
    def unit(self) -> str: ...
    @property
    def role(self) -> str: ...
    @property
    def joint(self) -> str: ...

class Event:
    """Something that happened at a time: homing, a drop, an episode."""

    @property
    def t_ns(self) -> int: ...
    @property
    def kind(self) -> str: ...
    @property
    def detail(self) -> str: ...

class FollowedJoint:
    """How simulate(follow=...) simulated a joint."""

    @property
    def joint(self) -> str: ...
    @property
    def how(self) -> str: ...
    @property
    def rmse(self) -> float:
        """Of the simulated position against the recorded one, rad or m."""
    @property
    def drawn_constant(self) -> Optional[float]:
        """Recorded minus simulated position where homing draws a constant; no part of rmse."""

class Recording:
    """Samples over time, one column per channel. It never changes: its arrays are read-only views, without a copy, and
    keep it alive. recording["elbow.position"] is one channel, [rows]; KeyError says which name was meant."""

    @staticmethod
    def from_arrays(
        values: Mapping[str, ArrayLike],
        *,
        t_s: Optional[ArrayLike] = None,
        t_ns: Optional[ArrayLike] = None,
        channels: Optional[Sequence[Channel]] = None,
        meta: Mapping[str, str] = ...,
        name: str = "arrays",
        skip_bad: bool = False,
    ) -> "Recording":
        """From arrays by name, each [rows], with their times [rows], which never decrease. `channels` say which arrays are
        taken and what they are; values are in their units. Without, the names say it: "truth.elbow_rad" (FORMATS.md,
        profile generic). NaN is a lost value. `name` stands in messages; `skip_bad` drops rows whose time
        runs backwards."""
    def __getitem__(self, channel: str) -> _Floats: ...
    def __contains__(self, name: object) -> bool: ...
    @property
    def t_ns(self) -> NDArray[np.int64]: ...
    @property
    def samples(self) -> _Floats:
        """[rows, channels], Fortran order."""
    @property
    def rows(self) -> int: ...
    @property
    def channels(self) -> list[Channel]: ...
    @property
    def meta(self) -> dict[str, str]: ...
    @property
    def events(self) -> list[Event]: ...
    @property
    def source(self) -> str:
        """The file that it was read from, or a name."""
    @property
    def followed(self) -> list[FollowedJoint]:
        """Of simulate(follow=...); else empty."""
    def save(self, path: _Path, *, overwrite: bool = False) -> None:
        """Writes a .db."""

class Record(SimpleNamespace):
    """An object of a JSON document: members are attributes; record["from"] reads those whose name is a word of Python."""

    def __getattr__(self, name: str) -> Any: ...
    def __getitem__(self, name: str) -> Any: ...

class Plant:
    """A robot as its simulation has it."""

    @staticmethod
    def load(path: _Path) -> "Plant":
        """From a plant (.toml) or a robot model of others (.xml: MJCF, .urdf)."""
    def text(self) -> str:
        """The plant as TOML."""
    def save(self, path: _Path, *, overwrite: bool = False) -> None:
        """Writes text()."""
    @property
    def name(self) -> str: ...
    @property
    def source(self) -> str: ...
    @property
    def joints(self) -> list[Record]:
        """name, kind, reduction, effects and more of each, keys as in the file."""
    @property
    def notes(self) -> list[str]:
        """What a robot model says and no plant can hold."""

class GuessedProfile:
    """What the columns of a table may be; str() shows it column by column."""

    @property
    def text(self) -> str:
        """The profile (.toml), for load(profile=...) once it is saved and corrected."""
    @property
    def questions(self) -> list[str]:
        """What is to be checked."""

class Model:
    """A calibration: what it corrects, from which inputs."""

    @staticmethod
    def load(path: _Path) -> "Model":
        """From an ONNX file of ravencal."""
    def save(self, path: _Path, *, overwrite: bool = False) -> None:
        """Writes an ONNX file."""
    @property
    def joints(self) -> list[str]: ...
    @property
    def features(self) -> list[str]: ...
    @property
    def origin(self) -> str: ...
    @property
    def provenance(self) -> dict[str, str]: ...
    @property
    def choice(self) -> str:
        """The table of what was tried and what was chosen; empty of a model that was loaded."""
    @property
    def warnings(self) -> list[str]: ...

class ErrorStatistics:
    """Of a joint's error, rad or m."""

    @property
    def rmse(self) -> float: ...
    @property
    def peak(self) -> float: ...

class JointEvaluation:
    """How well one joint is corrected, in `unit`: rad or m."""

    @property
    def joint(self) -> str: ...
    @property
    def unit(self) -> str: ...
    @property
    def raw(self) -> ErrorStatistics: ...
    @property
    def bias_removed(self) -> ErrorStatistics: ...
    @property
    def calibrated(self) -> ErrorStatistics: ...
    @property
    def t_s(self) -> _Floats: ...
    @property
    def truth(self) -> _Floats: ...
    @property
    def estimate(self) -> _Floats: ...
    @property
    def corrected(self) -> _Floats: ...

class Evaluation:
    """How well a model corrects recordings; str() is the program's table, evaluation["elbow"] one joint."""

    @property
    def joints(self) -> list[JointEvaluation]: ...
    def __getitem__(self, joint: str) -> JointEvaluation: ...
    @property
    def warnings(self) -> list[str]: ...
    def json(self) -> str:
        """What `ravencal evaluate --json` writes (deg, mm)."""

class Report(Record):
    """What a diagnosis found: the members of report.json (shared/schemas/report.schema.json)."""

    schema: int
    verdict: Record
    mismatch: list[Record]
    effects: list[Record]
    kept_without_name: list[Record]
    held_out: list[Record]
    drift: list[Record]
    two_estimates: list[Record]
    error_left: list[Record]
    unexplained: list[Record]
    not_found: list[Record]
    known_together: list[Record]
    coupled_cables: list[Record]
    joints: list[Record]
    chain: list[Record]
    causes: list[Record]
    recordings: list[Record]
    looked_at: list[Record]
    not_looked_at: list[Record]
    candidates: list[Record]
    provenance: Record
    channels: list[Record]
    next: list[Record]
    @property
    def improved(self) -> Plant:
        """The plant with what was found."""
    def json(self) -> str:
        """The text of report.json."""
    def write(self, folder: _Path) -> None:
        """Writes report.json, report.html, plant_improved.toml and, of a robot model, robot_improved.xml or .urdf into the
        folder, which is made if absent."""

def load(
    path: _Path,
    profile: Optional[_Path] = None,
    arm: str = "gold",
    skip_bad: bool = False,
    from_s: Optional[float] = None,
    to_s: Optional[float] = None,
) -> Recording:
    """Reads a recording (.db), or another table or bag through a profile: a name, a file, or FILE.toml beside the table.
    `from_s` and `to_s` keep a part, in s since the first row; `skip_bad` drops rows that cannot be read."""

def guess_profile(data: Union[_Path, Mapping[str, ArrayLike]], joints: Sequence[str] = ..., skip_bad: bool = False) -> GuessedProfile:
    """Says what the columns of a table, or arrays by name, may be. `joints`: names of the plant's joints, in its order;
    `skip_bad` drops rows that cannot be read."""

@overload
def simulate(
    plant: Plant,
    trajectory: Union[_Path, Tuple[ArrayLike, ArrayLike]],
    *,
    out: Optional[_Path] = None,
    overwrite: bool = False,
    edges: Optional[_Path] = None,
    seed: int = 1,
    homing_seed: int = 1,
    payload_g: Optional[float] = None,
    rate_hz: Optional[float] = None,
    rehome_every_s: float = 0.0,
    rehomings: int = 0,
    drift: bool = False,
    progress: _Progress = None,
) -> Recording:
    """A plant along a trajectory, a RAVEN arm by its digital twin: a CSV of `ravencal trajectory`, or times [rows] in s, rising,
    and joints [rows, joints of the plant] in rad or m. Seeds, edges, homings and drift are the twin's. Without `out` the
    recording stays in memory."""

@overload
def simulate(
    plant: Plant,
    *,
    follow: Recording,
    out: Optional[_Path] = None,
    overwrite: bool = False,
    payload_g: Optional[float] = None,
    restart_s: float = 1.0,
    open_loop: bool = False,
) -> Recording:
    """Any plant along a recording of its robot: the same channels, simulated."""

def train(
    training: _Recordings,
    *,
    method: str = "auto",
    features: str = "",
    joints: Sequence[str] = ...,
    seed: int = 3,
    arm: str = "",
    robot: str = "",
    controller: str = "",
    coordinates: str = "",
    progress: _Progress = None,
) -> Model:
    """Learns the joint error, as `ravencal train` does by itself: candidates are compared on parts of the training that they
    were not fitted to. method: auto, linear or units. `arm` (gold, green), `robot`, `controller` and `coordinates` (motor,
    corrected) say what the files do not."""

def evaluate(model: Model, recordings: _Recordings, *, same_seed: bool = False) -> Evaluation:
    """Says how well a model corrects recordings that training never saw. A simulated recording with a run seed of the
    training is refused (DataError) without `same_seed`; with it, the table and the JSON say so."""

def diagnose(
    training: _Recordings,
    held_out: Optional[_Recordings] = None,
    *,
    plant: Plant,
    simulated: Optional[_Recordings] = None,
    held_out_from_s: Optional[float] = None,
    all_rows: bool = False,
    alpha: float = 0.02,
    placebos: int = 20,
    seed: int = 1,
    threads: int = 0,
    progress: _Progress = None,
) -> Report:
    """Finds where a plant and recordings of its robot differ, and which physics the plant lacks. Figures are on `held_out`,
    else on rows from `held_out_from_s` on, else on those that were fitted. The same recordings, plant, options and seed give
    the report of `ravencal diagnose`, number by number."""
