# SPDX-License-Identifier: Apache-2.0
"""Commands in the text of a document: each exists, and has the options that the text names."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Iterable, Iterator, Mapping
from functools import lru_cache
from pathlib import Path


@lru_cache(maxsize=None)
def help_of(program: Path, *command: str) -> str:
    return subprocess.run([program, *command, "--help"], capture_output=True, text=True, check=True).stdout


def commands_of(program: Path, *command: str) -> set[str]:
    listed = help_of(program, *command).partition("\nSubcommands:")[2]
    return set(re.findall(r"^  ([a-z]+) ", listed, re.MULTILINE))


def spans_of(text: str) -> Iterator[tuple[int, list[str]]]:
    """Line number and words of each span in backticks outside of blocks."""
    prose = re.sub(r"^```.*?^```$", lambda block: "\n" * block.group().count("\n"), text, flags=re.MULTILINE | re.DOTALL)
    for span in re.finditer(r"`([^`]+)`", prose):
        yield prose.count("\n", 0, span.start()) + 1, span.group(1).split()


def fault_of(programs: Mapping[str, Path], words: list[str]) -> str:
    """Of a span that begins with a program, or with a command of `ravencal`."""
    name = words[0] if words[0] in programs else "ravencal"
    program = programs[name]
    known = commands_of(program)
    words = words[1:] if words[0] == name else words if words[0] in known else []
    command: list[str] = []
    while words and not words[0].startswith("-") and (under := commands_of(program, *command)):
        if words[0] not in under:
            return f"there is no command {words[0]}"
        command.append(words.pop(0))
    options = set(re.findall(r"--[a-z0-9-]+", help_of(program, *command)))
    wrong = [word for word in words if word.startswith("--") and word not in options]
    return f"{' '.join(command) or name} has no {', '.join(wrong)}" if wrong else ""


def unknown_words(programs: Mapping[str, Path], source: Path, documents: Iterable[Path]) -> list[str]:
    faults = []
    for document in documents:
        for line, words in spans_of(document.read_text(encoding="utf-8")):
            fault = fault_of(programs, words)
            if fault:
                faults.append(f"{document.relative_to(source)}:{line}: `{' '.join(words)}`: {fault}")
    return faults
