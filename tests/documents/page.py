# SPDX-License-Identifier: Apache-2.0
"""A document as a reader follows it, who copies each block into one terminal in the root of a clone.

```sh and ```python are run, in the order of the page. A block whose first line is "# Needs SOMETHING" is not. ```text
behind a block that is run holds parts of its output, in their order; "..." stands for what may differ.
"""

from __future__ import annotations

import contextlib
import os
import re
import shutil
import signal
import subprocess
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from importlib.util import find_spec
from pathlib import Path

FENCE = re.compile(r"```(.*)$")
TAGS = ("sh", "python", "text", "")
NEEDS = re.compile(r"# Needs ([^:]+)")
MARK = "\x1e"
PYTHON_MODULE = "build/release/tools/python"
TAIL_LINES = 40
NOT_SOURCE = ("build", "out", ".git")


@dataclass(frozen=True)
class Places:
    """What is tested, and what comes with it."""

    source: Path
    build: Path
    data: Path


@contextlib.contextmanager
def nothing(_folder: Path) -> Iterator[dict[str, str]]:
    yield {}


@dataclass(frozen=True)
class Page:
    """A document, and what its reader has or waits for and a test does not."""

    path: str
    prepare: str = ""  # shell, run before the page: the reader's own recordings
    shorter: Mapping[str, str] = field(default_factory=dict)  # text of the page: what is run in its place
    missing: Callable[[Places], str] = lambda places: ""  # why this machine cannot run it; "" if it can
    beside: Callable[[Path], contextlib.AbstractContextManager[dict[str, str]]] = nothing  # runs meanwhile; its environment


@dataclass
class Block:
    tag: str
    fence: int  # line number of the opening fence
    lines: list[str]

    @property
    def is_command(self) -> bool:
        return self.tag in ("sh", "python")

    def needs(self, places: Places) -> str:
        """What it needs beyond a build, as its first line says; "" if it can be run."""
        if self.tag == "python" and not ((places.build / "tools/python").is_dir() and find_spec("numpy")):
            return "the Python module and NumPy"
        found = NEEDS.match(self.lines[0]) if self.lines else None
        return found.group(1) if found else ""

    def count(self) -> int:
        """Lines of commands: neither comments, nor what continues a line or stands in a here-document."""
        if self.tag == "python":
            return 1
        count, end, continued = 0, "", False
        for line in self.lines:
            if end:
                end = "" if line == end else end
                continue
            count += bool(line.strip()) and not line.lstrip().startswith("#") and not continued
            continued = line.endswith("\\")
            here = re.search(r"<<'?(\w+)'?", line)
            end = here.group(1) if here else ""
        return count


@dataclass
class Outcome:
    page: str
    blocks: int = 0
    commands: int = 0
    not_run: list[tuple[str, str]] = field(default_factory=list)  # reason, place
    faults: list[str] = field(default_factory=list)


def blocks_of(text: str) -> list[Block]:
    blocks: list[Block] = []
    inside = False
    for number, line in enumerate(text.splitlines(), 1):
        fence = FENCE.match(line)
        if fence and not inside:
            blocks.append(Block(fence.group(1).strip(), number, []))
        elif not fence and inside:
            blocks[-1].lines.append(line)
        inside ^= bool(fence)
    return blocks


def script_of(text: str, blocks: list[Block]) -> str:
    """Commands stand in the lines that they have on the page, so that the shell's own messages lead there."""
    lines = [""] * (len(text.splitlines()) + 1)
    lines[0] = f"set -eu; trap 'echo \"{MARK}line $LINENO: exit status $?\"' ERR; "
    for block in blocks:
        first, last = block.fence - 1, block.fence + len(block.lines)
        lines[first] += f"printf '\\n{MARK}%d\\n' {block.fence}"
        lines[first + 1 : last] = block.lines
        if block.tag == "python":
            lines[first] += f"; PYTHONPATH={PYTHON_MODULE} /usr/bin/python3 - <<'END_OF_BLOCK'"
            lines[last] = "END_OF_BLOCK"
    return "\n".join(lines) + "\n"


def shortened(page: Page, blocks: list[Block], outcome: Outcome) -> None:
    for said, run in page.shorter.items():
        before = [block.lines for block in blocks]
        for block in blocks:
            block.lines = [line.replace(said, run) for line in block.lines]
        if before == [block.lines for block in blocks]:
            outcome.faults.append(f"{page.path}: no block says '{said}', which is to be replaced")


def lacking(expected: list[str], output: str) -> str:
    """The first of the expected lines that does not follow in the output; "" if all do. Blanks do not count."""
    said, at = re.sub(r"[ \t]+", " ", output), 0
    for line in expected:
        found = re.compile(re.escape(" ".join(line.split())).replace(re.escape("..."), ".*?")).search(said, at)
        if not found:
            return line
        at = found.end()
    return ""


def run_shell(script: Path, folder: Path, environment: Mapping[str, str], log: Path) -> int:
    """Exit status; ends what the script left in the background."""
    with log.open("w") as output:
        shell = subprocess.Popen(
            ["bash", script], cwd=folder, env=environment, stdin=subprocess.DEVNULL, stdout=output,
            stderr=subprocess.STDOUT, start_new_session=True,
        )
        try:
            return shell.wait()
        finally:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(shell.pid, signal.SIGKILL)


def copy_of(places: Places, work: Path) -> Path:
    """A clone with a build and, beside it, the recordings, in which a page may write."""
    clone = work / "ravencal"
    shutil.copytree(
        places.source, clone, symlinks=True,
        ignore=lambda folder, names: NOT_SOURCE if Path(folder) == places.source else (),
    )
    (clone / "build").mkdir()
    (clone / "build/release").symlink_to(places.build)
    (work / "shared").mkdir()
    (work / "shared/data").symlink_to(places.data)
    return clone


def environment_of(folder: Path) -> dict[str, str]:
    kept = {name: os.environ[name] for name in ("TMPDIR", "USER", "LOGNAME") if name in os.environ}
    return kept | {
        "PATH": "/usr/local/bin:/usr/bin:/bin", "HOME": str(folder), "LC_ALL": "C.UTF-8", "PYTHONDONTWRITEBYTECODE": "1",
    }


def outputs_of(log: str) -> dict[int, str]:
    """Output of each block, by the line of its fence."""
    parts = re.split(rf"^{MARK}(\d+)\n", log, flags=re.MULTILINE)
    return {int(fence): output for fence, output in zip(parts[1::2], parts[2::2])}


def judge(page: Page, blocks: list[Block], outputs: dict[int, str], outcome: Outcome) -> None:
    """Compares what the page says with what was printed."""
    for block, following in zip(blocks, blocks[1:]):
        if following.tag == "text" and block.fence in outputs:
            line = lacking(following.lines, outputs[block.fence])
            if line:
                outcome.faults.append(
                    f"{page.path}:{following.fence}: the block of line {block.fence} does not print '{line}' there, but\n"
                    + outputs[block.fence].strip()
                )


def made_files(text: str, clone: Path, source: Path) -> Iterator[str]:
    """Files that the page names in a folder that its commands made, and that are not there."""
    for name in re.findall(r"`([\w.-]+/[\w./-]*\.\w+)`", text):
        top = name.split("/")[0]
        if top not in NOT_SOURCE and (clone / top).is_dir() and not (source / top).exists() and not (clone / name).exists():
            yield name


def follow(page: Page, places: Places, work: Path, outcome: Outcome, text: str, blocks: list[Block]) -> None:
    clone = copy_of(places, work)
    run = [block for block in blocks if block.is_command and not block.needs(places)]
    shortened(page, run, outcome)
    outcome.blocks, outcome.commands = len(run), sum(block.count() for block in run)
    with page.beside(work) as more:
        for name, script in (("preparation", "set -eu\n" + page.prepare), (Path(page.path).name, script_of(text, run))):
            log = work / f"{name}.log"
            (work / name).write_text(script, encoding="utf-8")
            status = run_shell(work / name, clone, environment_of(work) | more, log)
            said = log.read_text(encoding="utf-8", errors="replace")
            if status != 0:
                tail = "\n".join(said.replace(MARK, "").splitlines()[-TAIL_LINES:])
                outcome.faults.append(f"{page.path}: {name} ended with {status}\n{tail}")
                return
    judge(page, blocks, outputs_of(said), outcome)
    outcome.faults += [f"{page.path}: its commands do not make {name}" for name in made_files(text, clone, places.source)]


def try_page(page: Page, places: Places, work: Path) -> Outcome:
    """Runs a page in a copy of the source in the folder `work`."""
    outcome = Outcome(page.path)
    text = (places.source / page.path).read_text(encoding="utf-8")
    blocks = blocks_of(text)
    outcome.faults += [
        f"{page.path}:{block.fence}: a block is {', '.join(filter(None, TAGS))} or has no tag, not '{block.tag}'"
        for block in blocks if block.tag not in TAGS
    ]
    for block in blocks:
        if block.is_command and (needs := block.needs(places)):
            outcome.not_run.append((needs, f"{page.path}:{block.fence}, {block.count()} commands"))
    missing = page.missing(places)
    if missing:
        outcome.not_run.append((missing, page.path))
    else:
        follow(page, places, work, outcome, text, blocks)
    return outcome
