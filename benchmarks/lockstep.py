"""Lock-step with every state published: rems_net, its floor and its peers."""

from __future__ import annotations

from benchmarks.contest import Contender, Table, Tell, interleave
from benchmarks.report import Section, Target, table

TITLE = "Lock-step, one process per agent"
SIZES = (1, 4, 10)
OURS, BARRIER = "rems_net", "with a barrier"
RAW, TWICE = "raw zenoh", "heard twice"
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
state of four numbers. Every state goes to its own key and reaches a subscriber in the
process that ticks. In rems_net the clock itself receives every state, too. Values carry
their ticks there, so a fast clock may be 8 ticks ahead of the slowest agent, and
recordings are the same bytes (`docs/time.md`). The others send a tick when all have
answered the one before; rems_net `with a barrier` does so, too (as with
`on_failure="drop"`).

`raw zenoh` does the same with zenoh-python and msgpack only, in the same topology (the
ticking session is the router). So it shows how fast a barrier over Zenoh can be.
`heard twice` is raw zenoh with a second subscriber in the ticking process, which notes
when each state came, as rems_net does here. pyzmq shows the speed of sockets alone,
without keys, discovery or presence. dora-rs runs as nodes of one dataflow and one
daemon, Ray as actors and one `ray.get` per tick."""


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
        others = [name for name in PEERS if name not in (OURS, BARRIER)]
        for ours in (OURS, BARRIER):
            found_here = [_ratio(found, ours, name) for name in others]
            ratios.append([f"{size}", ours, *found_here])
        section.targets += [
            Target(f"N = {size}, rems_net over {name}", found.ratio(OURS, name), bound)
            for name, bound in TARGETS.items()
            if found.runs[name] and found.runs[OURS]
        ]
        if size == SIZES[-1] and found.runs[TWICE] and found.runs[BARRIER]:
            ratio = found.ratio(BARRIER, TWICE)
            told = f"N = {size}, with a barrier over raw zenoh {TWICE}"
            section.targets.append(Target(told, ratio, 0.85))
        for reason in found.missing.values():
            section.text.append(f"Left out: {reason}")
    section.text.append("Ticks per second, median:")
    section.text.append(table(["N", *PEERS], rates))
    section.text.append("rems_net over the others, which all have a barrier:")
    section.text.append(table(["N", "", *others], ratios))
    return section


def _rate(found: Table, name: str) -> str:
    return f"{found.spread(name).median:.0f}" if found.runs[name] else "-"


def _ratio(found: Table, ours: str, name: str) -> str:
    if not found.runs[name] or not found.runs[ours]:
        return "-"
    return found.ratio(ours, name).show()


def _how(name: str) -> tuple[str, ...]:
    return {BARRIER: ("barrier",), TWICE: ("1", "twice")}.get(name, ())
