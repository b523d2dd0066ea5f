"""Environments for learning: what they cost over the engine, MuJoCo and each other."""

from __future__ import annotations

from importlib.util import find_spec

from benchmarks.contest import Contender, Spread, Table, Tell, interleave
from benchmarks.report import Section, Target, table

TITLE = "Environments for learning"
NAME = "gym"

TEXT = """Steps a second of a Woodbot in ticks of 10 ms, all in one process, in turn, so
that ratios count. *By hand*: `put`, `step`, and a look at the state. A thousand robots
are computed as columns, and have sensors. On a fabric all agents live in one
[host](../glossary.md). In MuJoCo state and sensors are observed, and
*bare* is `mj_step` alone, in the same steps of 1 ms. *Raw zenoh* is the floor of an
environment on a fabric: zenoh-python alone sends a command and a tick to a process,
which answers with a state."""

ROWS = {
    "engine": "kinematic, by hand",
    "env": "kinematic, environment",
    "columns": "kinematic, 1000 at once, robot-steps",
    "one": "kinematic with sensors, alone",
    "here": "kinematic, on a fabric, host in this process",
    "fabric": "kinematic, on a fabric, host in another one",
    "zenoh": "raw zenoh, the same messages",
    "bare": "MuJoCo, bare",
    "mujoco": "MuJoCo, environment",
    "threads": "MuJoCo, 8 at once, robot-steps",
}


def measure(repeats: int, quick: bool, tell: Tell) -> Section:
    if find_spec("gymnasium") is None:
        return Section("gym", TITLE, ["Gymnasium is not installed: not measured."])
    given = (8, 20) if quick else (400, 1000)
    found = interleave([Contender(NAME, "gym", given)], repeats, tell)
    if NAME in found.missing:
        return Section("gym", TITLE, [TEXT, found.missing[NAME]])
    known = {k: v for k, v in ROWS.items() if k in found.runs[NAME][0]}
    rows = [[text, found.spread(NAME, key).show(".0f")] for key, text in known.items()]
    section = Section("gym", TITLE, [TEXT, table(["steps of", "a second"], rows)])
    wanted = [
        ("an environment over the engine by hand", over(found, "env", "engine"), 0.9),
        ("1000 at once over one alone", over(found, "columns", "one"), 55.0),
        ("a step on a fabric over raw zenoh", over(found, "fabric", "zenoh"), 0.4),
    ]
    if "bare" in known:
        ratio = over(found, "mujoco", "bare")
        wanted.append(("MuJoCo in an environment over bare mj_step", ratio, 0.6))
    section.targets = [Target(what, ratio, bound) for what, ratio, bound in wanted]
    section.targets.append(
        Target("steps/s on a fabric", found.spread(NAME, "here"), 3000, form=".0f")
    )
    tick = per(found, "input", 1e6)
    section.targets.append(
        Target("us of a tick with an input and a robot", tick, 40, False, ".1f")
    )
    if "bare" in known:
        reset = per(found, "reset", 1e3)
        section.targets.append(Target("ms of a reset in MuJoCo", reset, 0.3, False))
    return section


def over(found: Table, name: str, other: str) -> Spread:
    """Return a ratio of two rates of each run."""
    return Spread(tuple(run[name] / run[other] for run in found.runs[NAME] if run))


def per(found: Table, name: str, unit: float) -> Spread:
    """Return the time of one step in each run. unit: of these in a second."""
    return Spread(tuple(unit / run[name] for run in found.runs[NAME] if run))
