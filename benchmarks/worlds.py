"""Worlds: many robots in one world of an engine, next to the engine alone."""

from __future__ import annotations

from importlib.util import find_spec

from benchmarks.contest import Contender, Tell, interleave
from benchmarks.report import Section, Target, table

TITLE = "Many robots in one world"
ROBOTS = (1, 10, 50)

TEXT = """Woodbots in one MuJoCo world, each driving in a circle, at `dt="10 ms"` in
steps of 1 ms: an experiment with a process for the world, a process for the input that
commands all of them, and the clock, at full speed; and `mj_step` alone, on the same
model from the same state. In the experiment every robot is told its command, and its
state and all its sensors are read at every tick. Ticks per second."""


def measure(repeats: int, quick: bool, tell: Tell) -> Section:
    if find_spec("mujoco") is None:
        return Section("worlds", TITLE, ["MuJoCo is not installed: not measured."])
    rows, targets = [], []
    for robots in ROBOTS[:1] if quick else ROBOTS:
        ticks = 30 if quick else max(200, 4000 // robots)
        ours, alone = f"rems_net, {robots}", f"mj_step, {robots}"
        contenders = [
            Contender(ours, "worlds", ("rems", robots, ticks)),
            Contender(alone, "worlds", ("bare", robots, ticks)),
        ]
        found = interleave(contenders, repeats, tell)
        rates = [found.spread(name).show(".0f") for name in (ours, alone)]
        ratio = found.ratio(alone, ours)
        rows.append([str(robots), *rates, ratio.show()])
        what = f"time of a tick over mj_step, {robots} robots"
        targets.append(Target(what, ratio, 1.3, False))
    head = ["robots", "rems_net", "mj_step alone", "times as long"]
    return Section("worlds", TITLE, [TEXT, table(head, rows)], targets)
