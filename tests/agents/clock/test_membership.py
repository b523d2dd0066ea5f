"""Who takes part: joining, refusals, and an agent in plain Zenoh."""

import os
import platform
import socket
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any

import pytest

from rems_net import Experiment
from rems_net.agents.about.wiring import Entry, resolve
from rems_net.agents.clock.clock import Clock
from rems_net.agents.clock.members import Member, Members
from rems_net.agents.clock.progress import Progress
from rems_net.agents.host import handshake
from rems_net.agents.protocol.limits import AHEAD
from rems_net.agents.protocol.messages import Request
from rems_net.agents.protocol.plan import HERE
from rems_net.agents.protocol.terms import Terms
from rems_net.errors import ExperimentError, FabricError
from rems_net.router.finding.address import host_and_port
from rems_net.router.message import pack
from rems_net.router.session import Session
from rems_net.router.settings import Link
from tests.agents.runs import PARTS, Router, Told, digest, until
from tests.signals import freeze, thaw

PLAIN = PARTS.parent.parent / "docs" / "programs" / "plain_agent.py"


def plain_agent() -> str:
    return PLAIN.read_text("utf-8")


def lab(ticks: int = 60) -> Experiment:
    """robot/twin and the recorder have a process; all others but robot/plain none."""
    made = Experiment("plain", dt=0.05, duration=ticks * 0.05, folder=PARTS)
    made.input("steady", "parts.py:Steady", host=HERE)
    for name in ("plain", "twin"):
        made.robot(name, "parts.py:Cart", "parts.py:Euler", command="input/steady")
    made.process(
        "follow",
        "parts.py:Follow",
        leader="robot/plain/state",
        me="robot/dog/state",
        host=HERE,
    )
    cart = ("parts.py:Cart", "parts.py:Euler")
    made.robot("dog", *cart, command="process/follow", host=HERE)
    made.output("csv", "csv", host=HERE)
    return made


@pytest.fixture(scope="module")
def ours(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Return the digest that every run must have; in this one robot/plain is ours."""
    out = tmp_path_factory.mktemp("ours")
    made = lab()
    made.plans["robot/plain"].host = HERE
    made.run(out, show=Told())
    return digest(out)


def with_plain_agent(out: Path, beside: Any = None) -> None:
    """Run the experiment with the agent in plain Zenoh as `robot/plain`."""
    agents: list[subprocess.Popen[str]] = []

    def start(clock: Clock) -> None:
        agents.append(
            subprocess.Popen(
                [sys.executable, "-c", plain_agent(), told.endpoint],
                stderr=subprocess.PIPE,
                text=True,
            )
        )
        if beside is not None:
            beside(clock, agents[0].pid)

    told = Told(start)
    try:
        pace = "fast" if beside is None else 1.0
        made = lab()
        made.plans["robot/plain"].machine = "plain"
        made.run(out, pace=pace, show=told)
    finally:
        try:
            _, said = agents[0].communicate(timeout=20)
        except subprocess.TimeoutExpired:
            agents[0].kill()
            _, said = agents[0].communicate()
    assert (agents[0].returncode, said) == (0, "")


def test_the_agent_in_plain_zenoh_gives_the_same_bytes(
    tmp_path: Path, ours: str
) -> None:
    code = plain_agent()
    assert "rems_net" not in code
    with_plain_agent(tmp_path)
    assert digest(tmp_path) == ours


def test_it_outlives_a_freeze(tmp_path: Path, ours: str) -> None:
    """Ticks are said again while it stands still, and it says done again."""

    def hold(clock: Clock, pid: int) -> None:
        until(lambda: clock.tick.n > 10)
        freeze(pid)
        threading.Event().wait(1.5)
        thaw(pid)

    with_plain_agent(tmp_path, hold)
    assert digest(tmp_path) == ours


# -- who may join --------------------------------------------------------------------


def request(key: str, host: str, pid: int = 1, **more: Any) -> Request:
    entry = Entry(key, host, {}, **more)
    return Request(host, platform.node(), pid, "", [entry], {})


def test_a_taken_name_and_junk_are_refused_and_change_nothing(
    tmp_path: Path, ours: str
) -> None:
    keys = ("clock/@step/tick", "clock/@step/roster", "clock/@step/done", "stop")

    def intrude(clock: Clock) -> None:
        until(lambda: clock.tick.n > 3)
        key = clock.session.key("clock", "@join")
        with Session(Link(told.endpoint)) as session:
            for asked, sentence in (
                (request("robot/twin", "other"), "there is a robot/twin already, on "),
                (request("robot/x", "robot/twin"), "there is a host 'robot/twin' alre"),
            ):
                with pytest.raises(FabricError) as caught:
                    session.ask(key, asked.to_wire())
                assert str(caught.value).startswith(sentence)
                assert str(caught.value).endswith(
                    "; give this one another name. (R0445)"
                )
            with pytest.raises(FabricError):
                session.ask(key, b"\xc1")
            for junk_at in keys:
                for payload in (b"\xc1", b"", pack([1, 2, 3]), pack({"no": "sense"})):
                    session.put(f"rems/{junk_at}", payload)
            threading.Event().wait(0.5)

    told = Told(intrude)
    assert lab().run(tmp_path, pace=1, show=told).ticks == 60
    assert digest(tmp_path) == ours
    where = "what came at clock/@join is passed over: "
    twin, host, noise = (x for x in told.of("rejected") if x.startswith(where))
    assert twin.startswith(f"{where}there is a robot/twin already, on ")
    assert host.startswith(f"{where}there is a host 'robot/twin' already, on ")
    assert noise.startswith(f"{where}These 1 bytes are no message")
    for at in ("clock/@step/tick", "clock/@step/done", "stop"):
        assert any(f"came at rems/{at} is" in x for x in told.of("rejected")), at


# -- the roster itself ---------------------------------------------------------------


def test_a_host_that_asks_twice_is_in_once() -> None:
    members = Members(0, Terms(0.1))
    first = members.join(request("robot/a", "h", pid=os.getpid()), 1, 0.0)
    assert members.join(request("robot/a", "h", pid=os.getpid()), 2, 0.0) is first
    with pytest.raises(ExperimentError, match="there is a robot/a already"):
        members.join(request("robot/a", "h", pid=7), 2, 0.0)
    members.drop(first)
    again = members.join(request("robot/a", "h", pid=7), 5, 0.0)
    assert again.entries[0].since == 5


def test_an_epoch_for_every_change_and_for_no_other() -> None:
    members = Members(0, Terms(0.1))
    progress = Progress(members)
    members.join(request("robot/a", "a"), 1, 0.0)
    late = members.join(request("robot/b", "b", since=4), 1, 0.0)
    epochs = []
    for n in range(1, 7):
        if n == 6:
            members.drop(late)
        progress.update(n)
        epochs.append((progress.roster.epoch, sorted(progress.roster.agents)))
    one, two = ["robot/a"], ["robot/a", "robot/b"]
    assert epochs == [(1, one)] * 3 + [(2, two)] * 2 + [(3, one)]
    # A host may have lost the roster of a tick that it has not done yet.
    assert [progress.roster_of(e).epoch for e in ("1", "2", "3", "")] == [1, 2, 3, 3]
    members.join(request("robot/c", "c"), 6 + 2 * AHEAD, 0.0)
    progress.update(6 + 2 * AHEAD)
    assert [progress.roster_of(e).epoch for e in ("1", "3", "4")] == [4, 3, 4]


def test_what_a_step_takes_is_due_at_its_last_step() -> None:
    entry = Entry("robot/a", "h", {}, every=3, since=4)
    assert [entry.due(n) for n in range(10)] == [0, 0, 0, 0, 0, 0, 6, 6, 6, 9]


def test_globs_and_names_find_ports_in_order() -> None:
    agents = {
        key: Entry(key, key, outs)
        for key, outs in {
            "robot/b": {"state": "d"},
            "robot/a": {"state": "d", "sensors": "d"},
            "input/k": {"value": "d"},
        }.items()
    }

    def found(source: str) -> list[str]:
        return [s.key for s in resolve(source, agents, "a reader")]

    assert found("robot/*/state") == ["robot/a/state", "robot/b/state"]
    assert found("robot/*") == ["robot/a/state", "robot/a/sensors", "robot/b/state"]
    assert found("input/k") == ["input/k/value"]
    with pytest.raises(ExperimentError, match="which has 2 ports; write one of"):
        found("robot/a")


def test_many_who_hold_a_tick_are_counted() -> None:
    members = Members(0, Terms(0.1))
    progress = Progress(members)
    for i in range(30):
        members.all[f"h{i:02}"] = Member(i, f"h{i:02}", "desk", 1, "", [])
    named = "h00 on desk and h01 on desk and h02 on desk"
    late = set(members.all)
    assert progress.describe(late) == f"{named} and 27 more hosts"
    late = {"h00", "h01", "h02", "h03"}
    assert progress.describe(late) == f"{named} and 1 more host"


def test_a_host_that_waits_shows_why_no_router_answers() -> None:
    """Its router was frozen, refuses it, or another program has the port by now."""
    with Router() as router:
        session = Session(Link(router.endpoint))
        session.open()
    with session:
        until(lambda: not session.connected)
        assert handshake._nobody(session).startswith("no router answers at ")
        with socket.create_server(host_and_port(router.endpoint)):
            shown = handshake._nobody(session)
    assert shown.startswith(f"{router.endpoint} takes connections and answers")
