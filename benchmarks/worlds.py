"""Worlds: many robots in one world of an engine, next to the engine alone."""

from __future__ import annotations

from importlib.util import find_spec

from benchmarks.contest import Contender, Tell, interleave
from benchmarks.report import Section, Target, table

TITLE = "Many robots in one world"
ROBOTS = (1, 10, 50)
#: of 1 ms in a tick
STEPS = (100, 10)

TEXT = """Woodbots in one MuJoCo world: an experiment at full speed, and `mj_step`
alone on the same model, both in steps of 1 ms. In the experiment the state and all
sensors of each robot are read at every tick. Ticks per second:"""


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
