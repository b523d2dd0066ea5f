"""A thousand kinematic Woodbots in two hosts, watched and not; ten thousand."""

from __future__ import annotations

from benchmarks.contest import Contender, Table, Tell, interleave
from benchmarks.report import Section, Target, table

TITLE = "A swarm in two hosts"
UNWATCHED, APART, HERE = "unwatched", "watched from apart", "watched from the clock"
CROWD, MANY = "watched from apart, as a crowd", "10,000 robots, crowd"
RAW, RAW_WATCHED = "raw zenoh, unwatched", "raw zenoh, watched"
RAW_APART = "raw zenoh, watched from apart"

TEXT = """Kinematic Woodbots, half of them in each of two processes; lock-step.
*Watched*: every state is put on its own key at every tick, and reaches one subscriber,
in the ticking process (*from the clock*) or in one of its own (*from apart*). *As a
crowd*: each host puts the states of all its robots in one message. *Raw zenoh* puts as
many states, and computes nothing."""

#: what each way of running is compared with
FLOOR = {UNWATCHED: RAW, APART: RAW_APART, CROWD: RAW_APART, HERE: RAW_WATCHED}


def contenders(robots: int, ticks: int) -> list[Contender]:
    half, long = robots // 2, ticks * 4
    return [
        Contender(UNWATCHED, "swarm", (robots, long, "unwatched")),
        Contender(APART, "swarm", (robots, ticks, "apart")),
        Contender(CROWD, "swarm", (robots, long, "crowd")),
        Contender(HERE, "swarm", (robots, ticks, "here")),
        Contender(RAW, "raw_zenoh", (2, long, half, "unwatched")),
        Contender(RAW_WATCHED, "raw_zenoh", (2, ticks, half)),
        Contender(RAW_APART, "raw_zenoh", (2, ticks, half, "apart")),
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
    big = None if quick else ten_thousand(tell)
    if big is not None:
        rows += _rows(big)
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
    if big is not None and big.runs[MANY]:
        share = found.ratio(CROWD, RAW_WATCHED)
        section.targets += [
            Target("1000 robots, as a crowd, over raw zenoh, watched", share, 0.7),
            Target(f"{MANY}, ticks/s", big.spread(MANY), 20, form=".0f"),
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


def ten_thousand(tell: Tell) -> Table:
    """10,000 robots, once each way: a rate to know, not to compare."""
    ways = (("unwatched", 200), ("apart", 30), ("crowd", 200))
    big = [
        Contender(f"10,000 robots, {where}", "swarm", (10_000, ticks, where))
        for where, ticks in ways
    ]
    return interleave(big, 1, tell)


def _rows(found: Table) -> list[list[str]]:
    rows = [
        [name, f"{runs[0]['rate']:.1f}", "-", f"{runs[0]['start']:.1f}"]
        for name, runs in found.runs.items()
        if runs
    ]
    failed = found.missing.items()
    return rows + [[name, "did not run", "-", reason] for name, reason in failed]
