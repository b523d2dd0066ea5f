"""Lock-step with every state published: rems_net, its floor and its peers."""

from __future__ import annotations

from benchmarks.contest import Contender, Table, Tell, interleave
from benchmarks.report import Section, Target, table

TITLE = "Lock-step, one process per agent"
SIZES = (1, 4, 10)
OURS, BARRIER = "rems_net", "with a barrier"
RAW, TWICE = "raw zenoh", "two subscribers"
#: name -> program, and how much slower it may be expected to be
PEERS = {
    OURS: ("rems", 1),
    BARRIER: ("rems", 1),
    RAW: ("raw_zenoh", 1),
    TWICE: ("raw_zenoh", 1),
    "pyzmq": ("zmq_push", 1),
    "dora-rs": ("dora_rs", 1),
    "Ray": ("ray_actors", 5),
}
TARGETS = {RAW: 0.7, "dora-rs": 1.3, "Ray": 5.0}

TEXT = """The clock sends a tick, and each of N agents, a process each, answers with a
state of four numbers, at a key of its own. All but the first column have a barrier:
they send a tick when all have answered the one before. rems_net does so `with a
barrier` (`on_failure="drop"`); else its clock may be 16 ticks ahead
([how](../time.md)). `raw zenoh` is zenoh-python and msgpack only; `two subscribers` has
two in the ticking process, as rems_net does. Median ticks per second:"""


def measure(repeats: int, quick: bool, tell: Tell) -> Section:
    section = Section("lockstep", TITLE, [TEXT])
    rates, ratios = [], []
    for size in SIZES[:1] if quick else SIZES:
        ticks = 100 if quick else 3000
        contenders = [
            Contender(name, program, (size, max(50, ticks // slower), *_how(name)))
            for name, (program, slower) in PEERS.items()
        ]
        tell(f"{size} agents")
        found = interleave(contenders, repeats, tell)
        rates.append([f"{size}", *(_rate(found, name) for name in PEERS)])
        ratios.append([f"{size}", *(_ratio(found, name) for name in TARGETS)])
        if size == SIZES[-1] and found.runs[TWICE] and found.runs[BARRIER]:
            ratio = found.ratio(BARRIER, TWICE)
            told = f"N = {size}, with a barrier over raw zenoh {TWICE}"
            section.targets.append(Target(told, ratio, 0.85))
        for reason in found.missing.values():
            section.text.append(f"Left out: {reason}")
    section.text.append(table(["N", *PEERS], rates))
    head = [f"over {name}, at least {bound:g}" for name, bound in TARGETS.items()]
    section.text.append(table(["N", *head], ratios))
    return section


def _rate(found: Table, name: str) -> str:
    return f"{found.spread(name).median:.0f}" if found.runs[name] else "-"


def _ratio(found: Table, name: str) -> str:
    if not found.runs[name] or not found.runs[OURS]:
        return "-"
    return found.ratio(OURS, name).show()


def _how(name: str) -> tuple[str, ...]:
    return {BARRIER: ("barrier",), TWICE: ("1", "twice")}.get(name, ())
