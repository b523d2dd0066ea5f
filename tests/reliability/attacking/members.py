"""Attacks by members of a fabric, and by users of a router with a class list."""

import os
import threading
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from unittest.mock import patch

from rems_net import Experiment
from rems_net.agents.clock.clock import Clock
from rems_net.agents.protocol.badge import new_run
from rems_net.agents.protocol.messages import pack_age
from rems_net.client import join
from rems_net.errors import AgentError
from rems_net.router.find import VARIABLE
from rems_net.router.gate.classlist import load_class
from rems_net.router.mail import Mail, Mailbox
from rems_net.router.message import pack, pack_stamp
from rems_net.router.session import Session
from rems_net.router.settings import Link
from rems_net.router.stop_store import class_router
from tests.agents.runs import PARTS, Told, digest, free_port, until
from tests.reliability.attacks import Bench, Outcome, attack

NAMES = "name,team\nanna,team1\nben,team2\n"


def lab(seconds: float) -> Experiment:
    made = Experiment("attacked", dt=0.02, duration=seconds, folder=PARTS)
    made.input("steady", "parts.py:Steady")
    made.robot("a", "parts.py:Cart", "parts.py:Euler", command="input/steady")
    made.output("csv", "csv")
    return made


def during(bench: Bench, seconds: float, beside: Callable[[Clock, str], None]) -> Told:
    """A run with something done beside it."""

    def begin(clock: Clock) -> None:
        until(lambda: clock.tick.n > 5)
        beside(clock, told.endpoint)

    told = Told(begin)
    with suppress(AgentError):
        lab(seconds).run(bench.folder / "out", pace=1, show=told)
    return told


@attack(
    "a member copies another's badge, and puts a second value for the same tick",
    "the recording changes without a word",
    quick=False,
)
def copied_badge(bench: Bench) -> Outcome:
    def copy(clock: Clock, endpoint: str) -> None:
        with Session(Link(endpoint)) as session:
            box, key = Mailbox(), "rems/input/steady/@step/value"
            session.watch(key, box)
            mail = box.get(20.0)
            assert isinstance(mail, Mail)
            n = clock.tick.n
            stamp = pack_stamp(n, n / 50, mail.stamp().badge)
            for _ in range(3):
                session.publisher(key).put(pack({"speed": 0.5, "turn": 0.0}), stamp)

    told = during(bench, 1.5, copy)
    said = [line for line in told.said if "a second value of tick" in line]
    return Outcome(
        f"each reader warns: tick, key, the badge's owner; {len(said)} warning"
        if said
        else "not a word",
        bool(said),
    )


@attack(
    "a command with a stamp 10^9 ticks ahead of the clock",
    "counts as fresh for ever",
)
def far_ahead(bench: Bench) -> Outcome:
    states: list[float] = []

    def command(clock: Clock, endpoint: str) -> None:
        with join(at=endpoint) as fabric:
            publisher = fabric.session.publisher("rems/robot/free/command")
            value, first = pack({"speed": 1.0, "turn": 0.0}), clock.tick.n
            while clock.tick.n < first + 10:
                publisher.put(value, pack_stamp(clock.tick.n + 10**9, 1.0))
                threading.Event().wait(0.02)
            state = fabric.get("robot/free/state")["rems/robot/free/state"]
            states.append(state["values"]["x"]["value"])
            fabric.clock("end")

    made = Experiment("future", dt=0.02, duration=20.0, folder=PARTS)
    made.robot("free", "parts.py:Cart", "parts.py:FreeEuler")

    def begin(clock: Clock) -> None:
        until(lambda: clock.tick.n > 5)
        command(clock, told.endpoint)

    told = Told(begin)
    made.run(bench.folder / "out", pace=1, show=told)
    return Outcome(
        "dropped, with a warning" if states == [0.0] else "obeyed", states == [0.0]
    )


@attack(
    "a program takes the clock's name while the router restarts",
    "the run goes on, the recording has the same bytes",
    quick=False,
)
def clock_name(bench: Bench) -> Outcome:
    router = bench.router()
    quiet = lab(4.0)
    quiet.run(bench.folder / "quiet", show=Told())

    def take(clock: Clock) -> None:
        until(lambda: clock.tick.n > 20)
        other = new_run()
        with Session(Link(router.endpoint)) as session:
            session.present("rems/clock/@alive")
            session.present(f"rems/clock/@run/{other}")
            session.answer_at_once(
                "rems/clock/@age",
                lambda question: question.answer(
                    "rems/clock/@age", pack_age(other, 0.0, 0)
                ),
            )
            router.kill()
            router.start()
            with suppress(AssertionError):
                until(lambda: clock.tick.n > 190, 10.0)

    told = Told(take)
    with patch.dict(os.environ, {VARIABLE: router.endpoint}), suppress(AgentError):
        lab(4.0).run(bench.folder / "out", pace=1, show=told)
    same = digest(bench.folder / "quiet") == digest(bench.folder / "out")
    return Outcome(
        "the run goes on, the recording has the same bytes" if same else "the run ends",
        same,
    )


@attack(
    "`@rems/who` asked about another user of the class",
    "answers anybody: role and team of every user",
)
def another_user(bench: Bench) -> Outcome:
    users = load_class(_names(bench), "rems")
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    with class_router(endpoint, users):
        link = Link(endpoint, user="anna", password=users.passwords["anna"])
        with Session(link) as anna:
            own = until(lambda: anna.ask("@rems/who/anna"))
            others = [
                *anna.ask("@rems/who/ben", timeout=0.5),
                *anna.ask("@rems/who/*", timeout=0.5),
            ]
    return Outcome(
        "refused by the router; about oneself it answers"
        if own and not others
        else "answers",
        bool(own) and not others,
    )


@attack("lease theft: a team takes the lease of another team's robot", "not tried")
def lease_theft(bench: Bench) -> Outcome:
    users = load_class(_names(bench), "rems")
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    asked: list[str] = []
    with class_router(endpoint, users) as router:
        key = "team1/robot/bot/@lease"
        router.answer_at_once(key, lambda question: asked.append(question.key))
        link = Link(endpoint, user="ben", password=users.passwords["ben"])
        with Session(link) as ben:
            until(lambda: ben.ask("@rems/who/ben"))
            for holder in ("robot/mine of ben", ""):
                for one in (key, "*/robot/bot/@lease", "**"):
                    ben.ask(one, pack((7, holder)), timeout=0.3)
                    ben.put(one, pack((7, holder)))
    return Outcome(
        "refused by the router" if not asked else f"{len(asked)} questions got through",
        not asked,
    )


def _names(bench: Bench) -> Path:
    path = bench.folder / "names.csv"
    path.write_text(NAMES, encoding="utf-8")
    return path
