"""A thousand kinematic Woodbots in two hosts, watched and not; ten thousand."""

from __future__ import annotations

from benchmarks.contest import Contender, Table, Tell, interleave
from benchmarks.report import Section, Target, table

TITLE = "A swarm in two hosts"
UNWATCHED, APART, HERE = "unwatched", "watched from apart", "watched from the clock"
RAW, RAW_WATCHED = "raw zenoh, unwatched", "raw zenoh, watched"

TEXT = """Kinematic Woodbots, each with its own name, keys, command and state, half of
them in each of two host processes; lock-step. *Unwatched*: nobody subscribes to the
states, so nothing is encoded. *Watched from apart*: every state is put on its own key
at every tick and reaches one subscriber in a process of its own, written with plain
zenoh-python, a client of the router like any program of a user; the rate counts what
it received. *Watched from the clock*: the subscriber is a `Session.watch` in the
process that ticks and routes. Raw zenoh puts as many states of four numbers from two
processes and computes nothing; its subscriber is in the ticking process. `Over raw
zenoh` compares with raw zenoh watched or unwatched, whichever is alike."""

#: what each way of running is compared with
FLOOR = {UNWATCHED: RAW, APART: RAW_WATCHED, HERE: RAW_WATCHED}


def contenders(robots: int, ticks: int) -> list[Contender]:
    half, long = robots // 2, ticks * 4
    return [
        Contender(UNWATCHED, "swarm", (robots, long, "unwatched")),
        Contender(APART, "swarm", (robots, ticks, "apart")),
        Contender(HERE, "swarm", (robots, ticks, "here")),
        Contender(RAW, "raw_zenoh", (2, long, half, "unwatched")),
        Contender(RAW_WATCHED, "raw_zenoh", (2, ticks, half)),
    ]


def measure(repeats: int, quick: bool, tell: Tell) -> Section:
    robots, ticks = (20, 50) if quick else (1000, 250)
    found = interleave(contenders(robots, ticks), repeats, tell)
    section = Section("swarm", TITLE, [TEXT])
    rows = [
        [
            name,
            found.spread(name).show(".0f"),
            _floor(found, name),
            _start(found, name),
        ]
        for name, runs in found.runs.items()
        if runs
    ]
    if not quick:
        rows += _ten_thousand(tell)
    head = [f"{robots} robots", "ticks/s", "over raw zenoh", "s to the first tick"]
    section.text.append(table(head, rows))
    section.text += [f"Left out: {reason}" for reason in found.missing.values()]
    aims = [
        ("all states reach one subscriber", APART, 100),
        (UNWATCHED, UNWATCHED, 400),
    ]
    section.targets = [
        Target(f"1000 robots, {what}, ticks/s", found.spread(name), bound, form=".0f")
        for what, name, bound in aims
        if found.runs[name] and not quick
    ]
    return section


def _start(found: Table, name: str) -> str:
    if "start" not in found.runs[name][0]:
        return "-"
    return found.spread(name, "start").show(".1f")


def _floor(found: Table, name: str) -> str:
    floor = FLOOR.get(name)
    if floor is None or not found.runs[floor]:
        return "-"
    return found.ratio(name, floor).show()


def _ten_thousand(tell: Tell) -> list[list[str]]:
    """10,000 robots, once each way: a rate to know, not to compare."""
    big = [
        Contender(f"10,000 robots, {where}", "swarm", (10_000, ticks, where))
        for where, ticks in (("unwatched", 200), ("apart", 30))
    ]
    found = interleave(big, 1, tell)
    rows = [
        [name, f"{runs[0]['rate']:.1f}", "-", f"{runs[0]['start']:.1f}"]
        for name, runs in found.runs.items()
        if runs
    ]
    failed = found.missing.items()
    return rows + [[name, "did not run", "-", reason] for name, reason in failed]
