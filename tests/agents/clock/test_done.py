"""A `done` is for several ticks if more of them wait; before a wait, all is said."""

import os
import signal
from pathlib import Path

import pytest

from rems_net import Experiment
from rems_net.agents.clock.clock import Clock
from rems_net.agents.host.outlet import TOGETHER, Done
from rems_net.agents.protocol.messages import read_done
from rems_net.errors import AgentError
from rems_net.router.mail import Mail, Mailbox
from rems_net.router.session import Session
from rems_net.router.settings import Link
from tests.agents.runs import PARTS, Told, free_port, until


def test_one_done_is_for_several_ticks() -> None:
    with Session(Link(f"tcp/127.0.0.1:{free_port()}", serve=True)) as session:
        box, said = Mailbox(), list[tuple[int, int]]()
        session.watch(session.key("clock", "@step", "done"), box)
        done = Done(session)
        done.open()
        done.badge = 7
        for n in range(1, 403):
            done.note(n)
        done.settle()
        done.settle()  # there is nothing to say any more
        while not said or said[-1] != (7, 402):
            letter = box.get(5.0)
            assert isinstance(letter, Mail)
            said.append(read_done(letter.payload))
        assert box.empty()
        ticks = [n for _, n in said]
        assert ticks == sorted({*ticks})
        # On a busy machine some come alone, since they would be late.
        assert len(ticks) < 402 * 2 / TOGETHER
        assert max(b - a for a, b in zip([0, *ticks], ticks, strict=False)) <= TOGETHER


def test_the_tick_that_does_not_end_is_named(tmp_path: Path) -> None:
    """The others of its process are not said to hold earlier ones."""

    def look(clock: Clock) -> None:
        until(lambda: any("is held" in line for line in told.of("held")))
        pid = next(s["host"] for s in clock.status() if s["agent"] == "input/spin")
        os.kill(int(pid.rpartition(":")[2]), signal.SIGTERM)

    told = Told(look)
    lab = Experiment("spin", dt=0.1, duration=4, folder=PARTS, pace="fast")
    lab.input("count", "parts.py:Count", host="both")
    lab.input("spin", "parts.py:Spin", host="both")
    with pytest.raises(AgentError):
        lab.run(tmp_path, show=told)
    assert told.of("held")[0].startswith(
        "tick 5 is held by input/count, input/spin, output/recorder on"
    )
