"""Mutation: of every change of a line in one of five agents, `rems rerun` names the
agent, the first tick, the field and its unit."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from rems_net import Experiment
from rems_net.agents.experiment.again.compared import compare
from rems_net.agents.experiment.again.rebuilt import rebuild
from rems_net.cli.rerun import show
from tests.cli.recorded import recorded

#: five agents with the same arithmetic; each reads the one before
MANY = """
from rems_net import Experiment, In, Input, Out, Process, Schema
from rems_net.units import force, length, velocity

{classes}
"""
PART = """
S{i} = Schema("many{i}", {{"a": length(), "b": velocity(), "c": force()}})


class Part{i}({base}):
{reads}    value = Out(S{i})

    def {method}(self, tick):
        a, b, c = {begin}
        a = a * 0.5 + 0.25 * tick.n
        b = b + 0.125 * (tick.n % 7)
        c = c - 0.0625 * tick.n
        b = b * 0.75 + a
        c = c + 2.0 * (tick.n > 12)
        a = a + 3.0 * (tick.n == 9)
        {end}
"""
#: lines of a step: old, new, and the first tick and the fields that change then
MUTATIONS = [
    ("a * 0.5 + 0.25", "a * 0.5 + 0.26", 1, {"a", "b"}),
    ("0.125 * (tick.n % 7)", "0.130 * (tick.n % 7)", 1, {"b"}),
    ("0.125 * (tick.n % 7)", "0.125 * (tick.n % 8)", 7, {"b"}),
    ("- 0.0625", "- 0.0626", 1, {"c"}),
    ("- 0.0625", "+ 0.0625", 1, {"c"}),
    ("b * 0.75 + a", "b * 0.75 - a", 1, {"b"}),
    ("b * 0.75", "b * 0.7501", 1, {"b"}),
    ("tick.n > 12", "tick.n > 13", 13, {"c"}),
    ("tick.n > 12", "tick.n >= 12", 12, {"c"}),
    ("2.0 * (", "2.5 * (", 13, {"c"}),
    ("3.0 * (", "3.5 * (", 9, {"a"}),
    ("tick.n == 9", "tick.n == 8", 8, {"a"}),
    ("tick.n == 9", "tick.n >= 9", 10, {"a"}),
    ("tick.n == 9", "tick.n == 99", 9, {"a"}),
    ("a + 3.0", "a + 1e-12 + 3.0", 1, {"a"}),
    ("c + 2.0", "c * 1.5 + 2.0", 1, {"c"}),
    ("b + 0.125", "b + 0.0625 + 0.125", 1, {"b"}),
    ("+ 0.25 * tick.n", "+ 0.25 * (tick.n + 1)", 1, {"a", "b"}),
    ("+ 0.25 * tick.n", "+ 0.25 * min(tick.n, 14)", 15, {"a", "b"}),
    ("- 0.0625 * tick.n", "- 0.0625 * max(tick.n, 2)", 1, {"c"}),
]
UNITS = {"a": "m", "b": "m/s", "c": "N"}


def many(folder: Path, which: int = -1, old: str = "", new: str = "") -> None:
    """Write the five agents, the line of one of them changed."""
    parts = []
    for i in range(5):
        text = PART.format(
            i=i,
            base="Process" if i else "Input",
            reads=f"    last = In(S{i - 1})\n" if i else "",
            method="step" if i else "read",
            begin="self.last.a, self.last.b, self.last.c" if i else "1.0, 2.0, 3.0",
            end='self.value = {"a": a, "b": b, "c": c}',
        )
        if i == which:
            assert old in text
            text = text.replace(old, new)
        parts.append(text)
    code = MANY.format(classes="\n".join(parts))
    (folder / "again_many.py").write_text(code, encoding="utf-8")


def named(
    folder: Path, i: int, old: str, new: str, tick: int, fields: set[str]
) -> None:
    many(folder, i, old, new)
    made = rebuild(folder / "run" / "run.mcap", folder)
    made.check()
    result = compare(made)
    agent, differences = result.by_agent()[0]
    kind = "process" if i else "input"
    assert agent == f"{kind}/p{i}", (i, old, new)
    first = {(d.path, d.unit) for d in differences if d.tick == tick}
    assert min(d.tick for d in differences) == tick, (i, old, new, differences)
    assert first >= {(f, UNITS[f]) for f in fields}, (i, old, new, first)
    lines: list[str] = []
    show(result, made.lab.dt, 0, lines.append)
    at = tick * made.lab.dt
    assert lines[0].split("  ")[0] == agent
    assert f"differs from tick {tick} ({at:g} s) on" in lines[0]


@pytest.fixture(scope="module")
def five(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("five")
    many(folder)
    lab = Experiment("many", dt="50 ms", duration="1 s", folder=folder)
    for i in range(5):
        more: dict[str, Any] = (
            {"last": f"{'process' if i > 1 else 'input'}/p{i - 1}/value"} if i else {}
        )
        kind = lab.process if i else lab.input
        kind(f"p{i}", f"again_many.py:Part{i}", **more)
    recorded(lab, folder / "run")
    return folder


def test_twenty_changes_in_one_of_five_agents(five: Path) -> None:
    for k, one in enumerate(MUTATIONS):
        named(five, k % 5, *one)


@pytest.mark.slow
def test_a_hundred_changes_in_one_of_five_agents(five: Path) -> None:
    every = [(i, *one) for i in range(5) for one in MUTATIONS]
    assert len(every) == 100
    for one in every:
        named(five, *one)
