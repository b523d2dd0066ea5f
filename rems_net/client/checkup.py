"""Checkup of a fabric whose router answers: clocks, agents, laptops.

The answers come from programs of other users, so they are checked, bounded, and made
printable.
"""

import json
import math
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from statistics import median
from typing import Any

import rems_net
from rems_net.router.asking import printable
from rems_net.router.keys import agent_of
from rems_net.router.mail import Mail
from rems_net.router.session import Session

#: questions whose round trips are measured
ASKED = 20
#: s. Round trip beyond which people notice late commands.
SLOW = 0.1
#: s. Largest difference of two laptops' system times without a report.
APART = 5.0
#: agents. Above this number they are not asked one by one.
MOST = 300
#: findings of one kind that are reported
TOLD = 5


@dataclass(frozen=True, slots=True)
class Finding:
    """One finding: whether it is good, and what to do if not."""

    well: bool
    sentence: str

    def __str__(self) -> str:
        return f"{'ok  ' if self.well else 'BAD '} {self.sentence}"


def check_up(session: Session) -> Iterator[Finding]:
    """Examine the fabric of this session."""
    runs = session.who(session.key("clock", "@run", "*"))
    yield _clocks(session.fabric, len(runs))
    if runs:
        took, finding = _round_trip(session)
        yield finding
        if took:
            yield from _laptop(session)
    agents = session.who(session.key("*", "*", "@alive"))
    if 0 < len(agents) <= MOST:
        yield from _twice(session)
        yield from _definitions(session)


def _clocks(fabric: str, count: int) -> Finding:
    if count > 1:
        return Finding(
            False,
            f"fabric {fabric!r} has {count} clocks, so agents receive two times: end "
            "one of them, or give it a --fabric of its own",
        )
    if count:
        return Finding(True, f"fabric {fabric!r} has one clock")
    return Finding(
        False,
        f"fabric {fabric!r} has robots and no clock: they stand still until "
        "`rems router serve` or `rems run` starts one",
    )


def _round_trip(session: Session) -> tuple[list[float], Finding]:
    """Measure how long a question to the clock takes; it answers in Zenoh's thread."""
    took = []
    for _ in range(ASKED):
        begun = time.monotonic()
        if session.ask(session.key("clock", "@age"), timeout=1.0, first=True):
            took.append(time.monotonic() - begun)
    if not took:
        return took, Finding(
            False,
            f"the clock of {session.fabric!r} does not answer: it is frozen, or cut "
            "off",
        )
    middle, worst, lost = median(took), max(took), ASKED - len(took)
    slow = middle >= SLOW or lost
    return took, Finding(
        not slow,
        f"a question to its clock takes {1000 * middle:.1f} ms, at worst "
        f"{1000 * worst:.1f} ms; {lost} of {ASKED} had no answer"
        + (": the network is slow; go nearer to it" if slow else ""),
    )


def _laptop(session: Session) -> Iterator[Finding]:
    """Compare the clock's laptop with this one."""
    begun = time.time()
    answers = session.ask(session.key("clock", "@why"), timeout=2.0, first=True)
    ended = time.time()
    told = _read(answers[0]) if answers else {}
    here, there = rems_net.__version__, told.get("version")
    if isinstance(there, str) and there != here:
        there = printable(there[:40])
        yield Finding(
            False,
            f"its clock has rems_net {there}, and this laptop {here}. Type here: pip "
            f'install "rems-net=={there}"; or there: pip install "rems-net=={here}"',
        )
    now = told.get("now")
    if isinstance(now, (int, float)) and math.isfinite(now):
        # The clock read its time at some time in between.
        ahead = max(now - ended, 0.0) - max(begun - now, 0.0)
        if abs(ahead) > APART:
            way = "ahead of" if ahead > 0 else "behind"
            yield Finding(
                False,
                f"the system time of its clock's laptop is {_span(abs(ahead))} {way} "
                "that of this one: set both from the internet. The fabric has its own "
                "time; dates of files, and TLS, go wrong",
            )


def _span(seconds: float) -> str:
    return f"{seconds:.0f} s" if seconds < 120 else f"{seconds / 60:.0f} min"


def _twice(session: Session) -> Iterator[Finding]:
    """Yield names for which more than one program answers."""
    key = session.key("*", "*", "@schema")
    counts = Counter(mail.key for mail in session.ask(key, timeout=2.0))
    for full in sorted(key for key, count in counts.items() if count > 1)[:TOLD]:
        agent = printable(agent_of(full))
        yield Finding(
            False,
            f"{counts[full]} programs answer for {agent}: end all but one, or give it "
            "another --name",
        )


def _definitions(session: Session) -> Iterator[Finding]:
    """Yield classes of one name with different content, on purpose or by mistake."""
    found: dict[str, dict[str, str]] = {}
    for mail in session.ask(session.key("*", "*", "@why"), timeout=2.0):
        of = _read(mail).get("made_of")
        if isinstance(of, list) and len(of) == 2:
            name, digest = (printable(str(one)[:80]) for one in of)
            agent = printable(agent_of(mail.key))
            found.setdefault(name, {}).setdefault(digest, agent)
    unlike = [(name, made) for name, made in sorted(found.items()) if len(made) > 1]
    for name, made in unlike[:TOLD]:
        one, other, *_ = sorted(made.values())
        yield Finding(
            True,
            f"{one} and {other} are both a {name}, by files that differ; if they are "
            "to be alike, copy the file from one laptop to the other, and start both "
            "anew",
        )


def _read(mail: Mail) -> dict[str, Any]:
    """Return the answer as a dict; an empty one if it is malformed."""
    try:
        told = json.loads(mail.payload)
    except (ValueError, RecursionError):
        return {}
    return told if isinstance(told, dict) else {}
