"""Attacks by members of a fabric, and by users of a router with a class list."""

import os
from contextlib import suppress
from unittest.mock import patch

from rems_net import Experiment
from rems_net.agents.clock.clock import Clock
from rems_net.agents.protocol.badge import new_run
from rems_net.agents.protocol.messages import pack_age
from rems_net.errors import AgentError
from rems_net.router.find import VARIABLE
from rems_net.router.session import Session
from rems_net.router.settings import Link
from tests.agents.runs import PARTS, Told, digest, until
from tests.reliability.attacks import Bench, Outcome, attack


def lab(seconds: float) -> Experiment:
    made = Experiment("attacked", dt=0.02, duration=seconds, folder=PARTS)
    made.input("steady", "parts.py:Steady")
    made.robot("a", "parts.py:Cart", "parts.py:Euler", command="input/steady")
    made.output("csv", "csv")
    return made


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
