"""Run contenders in turn, in fresh processes, and compare them run by run."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from statistics import median
from typing import Any

#: seconds a program may take
LIMIT = 300.0

Numbers = dict[str, float]
Tell = Callable[[str], None]


class ProgramError(Exception):
    """A contender that could not run: what it was, and its last line."""


@dataclass(frozen=True)
class Contender:
    """A program of `benchmarks.programs`, and what it is given."""

    name: str
    program: str
    args: tuple[object, ...] = ()


@dataclass(frozen=True)
class Spread:
    """Several measurements of one thing."""

    values: tuple[float, ...]

    @property
    def median(self) -> float:
        return median(self.values)

    def show(self, form: str = ".2f") -> str:
        """`0.71 (0.69 to 0.80)`: the median, the smallest and the largest."""
        low, high = min(self.values), max(self.values)
        return f"{self.median:{form}} ({low:{form}} to {high:{form}})"


def run(contender: Contender) -> Numbers:
    """One run in a process of its own. Raises ProgramError."""
    command = [sys.executable, "-m", f"benchmarks.programs.{contender.program}"]
    command += [str(a) for a in contender.args]
    # An installed package is compiled; one that is compiled at every start is not it.
    env = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, timeout=LIMIT, env=env
        )
    except subprocess.TimeoutExpired:
        raise ProgramError(f"{contender.name}: no result in {LIMIT:.0f} s") from None
    lines = done.stdout.strip().splitlines()
    if done.returncode or not lines:
        said = (done.stderr.strip().splitlines() or ["it said nothing"])[-1]
        raise ProgramError(f"{contender.name}: {said}")
    result: dict[str, Any] = json.loads(lines[-1])
    return {k: float(v) for k, v in result.items()}


def _try_twice(contender: Contender, tell: Tell) -> Numbers:
    """A busy machine may fail a run; what cannot run fails twice."""
    try:
        return run(contender)
    except ProgramError as error:
        tell(f"again: {error}")
        return run(contender)


class Table:
    """The results of interleaved runs: run i of every contender within one minute.

    A run that failed is an empty result; a contender without any has no runs.
    """

    def __init__(self, contenders: Sequence[Contender]):
        self.runs: dict[str, list[Numbers]] = {c.name: [] for c in contenders}
        self.missing: dict[str, str] = {}

    def spread(self, name: str, what: str = "rate") -> Spread:
        return Spread(tuple(r[what] for r in self.runs[name] if r))

    def ratio(self, name: str, other: str, what: str = "rate") -> Spread:
        """Of each pair of neighbouring runs, `name` over `other`."""
        pairs = zip(self.runs[name], self.runs[other], strict=True)
        return Spread(tuple(a[what] / b[what] for a, b in pairs if a and b))


def interleave(contenders: Sequence[Contender], repeats: int, tell: Tell) -> Table:
    """Run all contenders in turn, `repeats` times.

    One that cannot run (a peer that is not installed) is left out, with the reason.
    """
    table = Table(contenders)
    for i in range(repeats):
        for contender in contenders:
            if contender.name in table.missing:
                continue
            try:
                result = _try_twice(contender, tell)
            except ProgramError as error:
                tell(f"left out: {error}")
                if i:
                    table.runs[contender.name].append({})
                else:
                    table.missing[contender.name] = str(error)
                continue
            table.runs[contender.name].append(result)
            shown = ", ".join(f"{k} {v:.4g}" for k, v in result.items())
            tell(f"run {i + 1} of {repeats}: {contender.name}: {shown}")
    return table
