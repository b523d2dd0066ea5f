"""Worlds: many robots in one world of an engine, next to the engine alone."""

from __future__ import annotations

from importlib.util import find_spec

from benchmarks.contest import Contender, Tell, interleave
from benchmarks.report import Section, Target, table

TITLE = "Many robots in one world"
ROBOTS = (1, 10, 50)
#: of 1 ms in a tick
STEPS = (100, 10)

TEXT = """Woodbots in one MuJoCo world, each driving in a circle: an experiment with a
process for the world, and the clock, at full speed. Beside it is `mj_step` alone, on
the same model from the same state. In the experiment every robot obeys, and its state
and all its sensors (two lidars, compass, gyro) are read at every tick: of 100 ms, which
is the usual one, and of 10 ms, in steps of 1 ms. Ticks per second.

At 10 ms, with 50 robots, `mj_step` takes about 72 % of the host's main thread, and the
sensors 15 %, half of it for rays. Commands and headings take 5 %, and sending 3 %. With
one robot ten steps of the engine take 0.1 ms, and lock-step as much."""


def measure(repeats: int, quick: bool, tell: Tell) -> Section:
    if find_spec("mujoco") is None:
        return Section("worlds", TITLE, ["MuJoCo is not installed: not measured."])
    rows, targets = [], []
    for steps in STEPS[:1] if quick else STEPS:
        for robots in ROBOTS[:1] if quick else ROBOTS:
            ticks = 30 if quick else max(100, 20_000 // robots // steps)
            given = robots, ticks, steps
            ours, alone = f"rems_net, {given}", f"mj_step, {given}"
            contenders = [
                Contender(ours, "worlds", ("rems", *given)),
                Contender(alone, "worlds", ("bare", *given)),
            ]
            found = interleave(contenders, repeats, tell)
            rates = [found.spread(name).show(".0f") for name in (ours, alone)]
            ratio = found.ratio(alone, ours)
            rows.append([f"{steps} ms", str(robots), *rates, ratio.show()])
            what = f"over mj_step, {robots} robots, ticks of {steps} ms"
            targets.append(Target(what, ratio, 1.3, False))
    head = ["tick", "robots", "rems_net", "mj_step alone", "times as long"]
    return Section("worlds", TITLE, [TEXT, table(head, rows)], targets)
