# SPDX-License-Identifier: Apache-2.0
"""One chain of commands: each runs under limits, and what no command may do becomes a fault."""

from __future__ import annotations

import json
import math
import os
import random
import re
import resource
import shlex
import signal
import subprocess
import tempfile
import threading
from dataclasses import dataclass, field
from pathlib import Path

ADDRESS_SPACE_BYTES = 6 << 30
# Against commands that hang; a command's time is judged by its processor time.
LONGEST_WAIT_S = 300.0
# What a command may need on recordings of minutes: a minute on the two cores of a small machine.
LARGEST_CPU_S = 2 * 60.0
LARGEST_MEMORY_BYTES = 1 << 30
NOT_FINITE = re.compile(r"(?<![\w.-])[-+]?(nan|inf)(inity)?(?![\w-])", re.IGNORECASE)


@dataclass(frozen=True)
class Fault:
    """What a chain showed: a kind that the table counts, and the command with what it said."""

    kind: str
    command: str
    detail: str


@dataclass
class Outcome:
    """How a command ended: exit code (negative: signal), its texts, what it used."""

    exit_code: int
    out: str
    err: str
    cpu_s: float
    memory_bytes: int
    waited_too_long: bool = False


@dataclass(frozen=True)
class Programs:
    """Paths of what is tested, and of what comes with it."""

    ravencal: Path
    encoders: Path
    plugin: Path
    source: Path
    data: Path | None


@dataclass
class Chain:
    """Commands of one seed in a folder of their own, with the faults that they showed."""

    programs: Programs
    folder: Path
    random: random.Random
    wait_s: float = LONGEST_WAIT_S
    commands: list[str] = field(default_factory=list)
    faults: list[Fault] = field(default_factory=list)

    def plant(self, name: str) -> str:
        return str(self.programs.source / "tools/plants" / f"{name}.toml")

    def seed(self) -> int:
        return self.random.randrange(1, 1_000_000)

    def ravencal(self, *arguments: object, may_find: bool = False, last: bool = False) -> Outcome:
        """Runs the program. Exit 1 is a fault unless `may_find`; `last`: the end of the road."""
        return self._run([str(self.programs.ravencal), *map(str, arguments)], may_find, last)

    def encoders(self, *arguments: object) -> Outcome:
        return self._run([str(self.programs.encoders), *map(str, arguments)], False, False)

    def fault(self, kind: str, detail: str) -> None:
        self.faults.append(Fault(kind, self.commands[-1] if self.commands else "", detail))

    def json(self, name: str) -> dict:
        """A JSON file that a command wrote; numbers that JSON does not have are a fault."""
        path = self.folder / name
        if not path.exists():
            self.fault("file missing", name)
            return {}

        def refuse(text: str) -> float:
            self.fault("not finite", f"{name} holds {text}")
            return math.nan

        return json.loads(path.read_text(), parse_constant=refuse)

    def _run(self, command: list[str], may_find: bool, last: bool) -> Outcome:
        shown = shlex.join([Path(command[0]).name, *command[1:]])
        shown = shown.replace(str(self.programs.source) + "/", "")
        self.commands.append(shown)
        outcome = run_limited(command, self.folder, self.wait_s)
        self._judge(outcome, may_find, last)
        return outcome

    def _judge(self, outcome: Outcome, may_find: bool, last: bool) -> None:
        said = (outcome.err.strip() or outcome.out.strip())[-600:]
        if outcome.waited_too_long:
            self.fault("hang", f"not ended after {self.wait_s:.0f} s")
        elif outcome.exit_code < 0:
            self.fault("abort", f"{signal.Signals(-outcome.exit_code).name}: {said}")
        elif outcome.exit_code > 4:
            self.fault("exit code", f"{outcome.exit_code}: {said}")
        elif outcome.exit_code > 1 or (outcome.exit_code == 1 and not may_find):
            kind = "refused at the end of the road" if last else "refused"
            self.fault(kind, f"exit {outcome.exit_code}: {said}")
        if outcome.memory_bytes > LARGEST_MEMORY_BYTES:
            self.fault("memory", f"{outcome.memory_bytes / 2**20:.0f} MB")
        if outcome.cpu_s > LARGEST_CPU_S:
            self.fault("time", f"{outcome.cpu_s:.0f} s of processor time")
        found = NOT_FINITE.search(outcome.out)
        if found:
            self.fault("not finite", outcome.out[max(0, found.start() - 80) : found.end() + 40])


def run_limited(command: list[str], folder: Path, wait_s: float) -> Outcome:
    """Runs `command` in `folder` with limits on address space and waiting time."""

    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_AS, (ADDRESS_SPACE_BYTES, ADDRESS_SPACE_BYTES))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))

    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        process = subprocess.Popen(command, cwd=folder, stdin=subprocess.DEVNULL, stdout=out, stderr=err, preexec_fn=limit)
        watch = threading.Timer(wait_s, process.kill)
        watch.start()
        _, status, usage = os.wait4(process.pid, 0)
        waited_too_long = not watch.is_alive()
        watch.cancel()
        process.returncode = os.waitstatus_to_exitcode(status)
        texts = []
        for file in (out, err):
            file.seek(0)
            texts.append(file.read().decode(errors="replace"))
    cpu_s = usage.ru_utime + usage.ru_stime
    return Outcome(process.returncode, texts[0], texts[1], cpu_s, usage.ru_maxrss * 1024, waited_too_long)
