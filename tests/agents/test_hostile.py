"""What a program that can merely connect does to a run: nothing, and it is told."""

import os
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from rems_net import Experiment
from rems_net.agents.about.wiring import Entry
from rems_net.agents.clock.clock import Clock
from rems_net.agents.protocol.badge import badge_of, new_run
from rems_net.agents.protocol.messages import Farewell, Request, pack_beat, pack_done
from rems_net.agents.protocol.plan import HERE
from rems_net.agents.protocol.roster import Roster
from rems_net.agents.protocol.terms import Wait
from rems_net.agents.tick import Tick
from rems_net.client import join
from rems_net.errors import AgentError, FabricError
from rems_net.router.mail import Mail, Mailbox
from rems_net.router.message import pack, pack_stamp
from rems_net.router.session import Session
from rems_net.router.settings import Link
from tests.agents.runs import PARTS, Told, digest, in_one_host, until

RUN = new_run()
BADGE = badge_of(RUN, 1)
VALUE = pack({"speed": 1.0, "turn": 1.0})
STATE = pack({"x": 9.0, "y": 9.0, "heading": 0.0})


def lab(seconds: float = 3.0, *here: str) -> Experiment:
    """The robots get the input from another process, and the output gets robot/a.

    here: the hosts that are no process.
    """
    made = Experiment("aimed_at", dt=0.02, duration=seconds, folder=PARTS)
    made.record = False  # a recording also has what was said of the attacks
    made.input("steady", "parts.py:Steady")
    for name in ("a", "b"):
        made.robot(name, "parts.py:Cart", "parts.py:Euler", command="input/steady")
    made.output("csv", "csv")
    made.plans["output/csv"].host = "robot/b"
    for plan in made.plans.values():
        plan.host = HERE if plan.host in here else plan.host
    return made


@pytest.fixture(scope="module")
def expected(tmp_path_factory: pytest.TempPathFactory) -> str:
    out = tmp_path_factory.mktemp("expected")
    in_one_host(lab()).run(out, pace=1, show=Told())
    return digest(out)


INFINITE = pack([float("inf"), 0.0])

Attack = Callable[[Session, Clock], None]


def put(key: str, payload: bytes, stamp: bytes | None = None) -> Attack:
    def attack(session: Session, clock: Clock) -> None:
        publisher = session.publisher(f"rems/{key}")
        for _ in range(20):
            publisher.put(payload, stamp)

    return attack


def future_values(session: Session, clock: Clock) -> None:
    """Values of ticks to come, which pushed every true one out of the buffer."""
    publisher = session.publisher("rems/input/steady/@step/value")
    for run in (RUN, clock.run_id):
        for n in range(clock.tick.n + 1, clock.tick.n + 40):
            publisher.put(VALUE, pack_stamp(n, n / 50, badge_of(run, 99)))


def far_ticks(session: Session, clock: Clock) -> None:
    """Ticks with the number of this very run, too far ahead to be a clock's."""
    publisher = session.publisher("rems/clock/@step/tick")
    for n in range(1_000, 6_000):
        publisher.put(pack_beat(clock.run_id, Tick(n, n / 50, 0.02, 1.0, 1), 0))


def junk(session: Session, clock: Clock) -> None:
    """What is no message at all."""
    for key in (
        "clock/@step/tick",
        "clock/@step/roster",
        "clock/@step/done",
        "clock/stops",
    ):
        for payload in (b"\xc1", b"", pack(5), pack({}), pack([[]] * 9), b"\x91" * 999):
            session.put(f"rems/clock/{key}", payload)


ATTACKS: dict[str, Attack] = {
    "a tick of another run": put(
        "clock/@step/tick", pack_beat(RUN, Tick(5, 0.1, 0.02, 0.0, 9), 0)
    ),
    "a tick in words": put("clock/@step/tick", pack([RUN, "7", "x", 0.1, 0.0, 1, 0])),
    "a tick as it was": put("clock/@step/tick", pack(Tick(5, 0.5, 0.1).to_plain())),
    "a tick with a large dt": put(
        "clock/@step/tick", pack_beat(RUN, Tick(5, 5e8, 1e8, 0.0, 9), 0)
    ),
    "ticks far ahead": far_ticks,
    "an empty roster": put("clock/@step/roster", Roster(99, 1, {}, {}, RUN).to_wire()),
    "a roster of nobody": put("clock/@step/roster", Roster(99, 1, {}, {}).to_wire()),
    "a done": put("clock/@step/done", pack_done(BADGE, 10**9)),
    "a done as it was": put("clock/@step/done", pack(["robot/a", 10**9])),
    "a value": put("input/steady/@step/value", VALUE, pack_stamp(5, 0.1, BADGE)),
    "a value without a stamp": put("input/steady/@step/value", VALUE),
    "a stamp of infinity": put("input/steady/@step/value", VALUE, INFINITE),
    "a closing value": put("robot/a/@step/state", STATE, pack_stamp(10**6, 1.0, BADGE)),
    "a closing stamp": put("robot/a/@step/state", STATE, INFINITE),
    "a command": put("robot/a/command", VALUE),
    "a command's stamp": put("robot/a/command", VALUE, INFINITE),
    "values of the future": future_values,
    "junk": junk,
}


#: runs that are attacked, each by every second
RUNS = 2


@pytest.mark.parametrize("first", range(RUNS))
def test_what_is_forged_changes_nothing(
    first: int, tmp_path: Path, expected: str
) -> None:
    """Each comes from a stranger of its own."""

    def attack(clock: Clock) -> None:
        until(lambda: clock.tick.n > 5)
        for name in list(ATTACKS)[first::RUNS]:
            with Session(Link(told.endpoint)) as session:
                ATTACKS[name](session, clock)
                threading.Event().wait(0.1)

    told = Told(attack)
    result = lab().run(tmp_path, pace=1, show=told)
    assert result.ticks == 150
    assert digest(tmp_path) == expected
    # Told once for each key, kind of reason and reader, and counted; never a line each.
    assert len(told.said) <= 80, told.said


def copied(clock: Clock, endpoint: str, stamp: Callable[[int, int], bytes]) -> None:
    """Values of steady's that a program put who has copied its badge."""
    until(lambda: clock.tick.n > 5)
    with Session(Link(endpoint)) as session:
        box, key = Mailbox(), "rems/input/steady/@step/value"
        session.watch(key, box)
        mail = box.get(20.0)
        assert isinstance(mail, Mail)
        session.put(key, pack({"speed": 0.1, "turn": 0.1}), "")
        publisher = session.publisher(key)
        for _ in range(5):
            said = box.get(20.0)
            assert isinstance(said, Mail)
            found = said.stamp()
            if found.badge:
                publisher.put(pack({"speed": 0.5, "turn": 0.1}), stamp(*found[:3:2]))


@pytest.mark.parametrize("ahead", [0, 1], ids=["after it", "before it"])
def test_a_copied_badge_is_no_secret(ahead: int, tmp_path: Path) -> None:
    """Two values of one tick are reported, whichever of them came first."""

    def attack(clock: Clock) -> None:
        copied(
            clock,
            told.endpoint,
            lambda n, badge: pack_stamp(n + ahead, (n + ahead) / 50, badge),
        )

    told = Told(attack)
    lab(1.0, "robot/b").run(tmp_path, pace=1, show=told)
    said = [line for line in told.said if "it is a second value of tick " in line]
    assert {line.split("]")[0] for line in said} == {"[robot/a", "[here"}
    assert all("with the badge of input/steady." in line for line in said)


def test_a_value_is_said_again_as_it_was(tmp_path: Path) -> None:
    """A verb that changes the robot between two ticks makes no second value of one."""
    answers: dict[int, set[bytes]] = {}

    def disturb(clock: Clock) -> None:
        until(lambda: clock.tick.n > 5)
        with join(at=told.endpoint) as fabric:
            box = Mailbox()
            fabric.session.watch("rems/robot/a/@step/state", box)
            until(lambda: not box.empty())
            fabric.clock("pause")
            until(lambda: clock.done == clock.tick.n)
            fabric.call("robot/a", "reset", (), {})
            asked = fabric.session.ask("rems/robot/a/state?since=1")
            while isinstance(mail := box.get(0.2), Mail):
                asked.append(mail)
            for mail in asked:
                answers.setdefault(mail.stamp().n, set()).add(mail.payload)
            fabric.clock("end")

    told = Told(disturb)
    lab(20.0, "input/steady", "robot/b").run(tmp_path, pace=1, show=told)
    assert len(answers) > 5
    assert all(len(payloads) == 1 for payloads in answers.values())


@pytest.mark.parametrize("driver", ["Euler", "FreeEuler"])
def test_a_stamp_of_the_future_is_obeyed_by_nobody(driver: str, tmp_path: Path) -> None:
    """It would be young for ever. One of now is obeyed."""
    states: list[float] = []

    def command(clock: Clock) -> None:
        until(lambda: clock.tick.n > 5)
        with join(at=told.endpoint) as fabric:

            def x_after(ahead: int) -> float:
                until(lambda: fabric.get("robot/a/state"))
                first = clock.tick.n
                while clock.tick.n < first + 10:
                    n = clock.tick.n + ahead
                    put("robot/a/command", VALUE, pack_stamp(n, n / 50))(
                        fabric.session, clock
                    )
                    threading.Event().wait(0.02)
                value = fabric.get("robot/a/state")["rems/robot/a/state"]["values"]
                return float(value["x"]["value"])

            states.extend((x_after(10**9), x_after(0)))
            fabric.clock("end")

    lab = Experiment("future", dt=0.02, duration=20.0, folder=PARTS)
    lab.record = False
    host = HERE if driver == "Euler" else None
    lab.robot("a", "parts.py:Cart", f"parts.py:{driver}", host=host)
    told = Told(command)
    lab.run(tmp_path, pace=1, show=told)
    assert states[0] == 0.0
    assert states[1] > 0.0
    assert [x for x in told.of("rejected") if "and it would be young for ever" in x]


def request(key: str = "robot/x", host: str = "robot/x", **more: Any) -> Request:
    return Request(host, "laptop", 7, "", [Entry(key, host, {}, **more)], {})


QUESTIONS: dict[str, tuple[str, bytes, str]] = {
    "five": ("@join", pack(5), "a host that joins is 5; expected a map of host, "),
    "nothing": ("@join", pack({}), "a host that joins is {}; expected a map of host"),
    "bytes": ("@join", b"\xc1", "These 1 bytes are no message: "),
    "a stranger": (
        "@join",
        request().to_wire(),
        "this run is closed, and has no place for robot/x; it waits for no host.",
    ),
    "a taken name": (
        "@join",
        request("robot/a").to_wire(),
        "there is a robot/a already, on ",
    ),
    "last words": (
        "@leave",
        Farewell(BADGE, [], ("robot/a", "died")).to_wire(),
        "no member of this run has that badge.",
    ),
    "last words as they were": (
        "@leave",
        pack({"host": "robot/a", "left": True}),
        "a host that leaves is {'host': 'robot/a', 'left': True}; expected a map of ",
    ),
}


def test_what_is_asked_wrongly_is_refused_in_a_sentence(
    tmp_path: Path, expected: str
) -> None:
    """A large call is refused unread, and tokens that come and go end nobody."""

    def ask(clock: Clock) -> None:
        until(lambda: clock.tick.n > 5)
        badges = list(clock.members.by_badge)
        with Session(Link(told.endpoint)) as session:
            session.present(f"rems/clock/@run/{clock.run_id}")
            for badge in badges:
                session.present(f"rems/clock/@member/{badge}")
            threading.Event().wait(0.2)
        with Session(Link(told.endpoint)) as session:
            for name, (key, payload, sentence) in QUESTIONS.items():
                with pytest.raises(FabricError) as caught:
                    session.ask(f"rems/clock/{key}", payload)
                assert str(caught.value).startswith(sentence), name
            large = pack({"args": [b"x" * 2_000_000], "kwargs": {}})
            for key in ("rems/robot/a/@call/reset", "rems/clock/@call/pause"):
                (answer,) = session.ask(key, large)
                assert b"a call takes at most 1000000." in answer.payload

    told = Told(ask)
    made = lab()
    made.wait = Wait(back=1.0)
    assert made.run(tmp_path, pace=1, show=told).ticks == 150
    assert digest(tmp_path) == expected


def test_who_leaves_early_is_a_failure(tmp_path: Path) -> None:
    """Even with a copied badge, a run that lost somebody does not end well."""

    def leave(clock: Clock) -> None:
        until(lambda: clock.tick.n > 5)
        badge = clock.members.all["robot/a"].badge
        with Session(Link(told.endpoint)) as session:
            session.ask("rems/clock/@leave", Farewell(badge, [], None).to_wire())

    told = Told(leave)
    with pytest.raises(AgentError) as caught:
        lab(3.0, "input/steady", "robot/b").run(tmp_path, pace=1, show=told)
    assert caught.value.agent == "robot/a"
    assert "before the end of the run" in caught.value.cause


def test_strangers_values_cost_no_memory(tmp_path: Path) -> None:
    """Twenty thousand invented keys below a glob that is read."""
    if not Path("/proc/self/statm").exists():
        pytest.skip("the memory of another process (/proc) is missing")
    sizes: list[int] = []

    def flood(clock: Clock) -> None:
        until(lambda: clock.tick.n > 5)
        sizes.append(resident(clock.members.all["log"].pid))
        with Session(Link(told.endpoint)) as session:
            for i in range(20_000):
                session.put(f"rems/robot/x{i}/@step/state", STATE)
            n = clock.tick.n
            until(lambda: clock.tick.n > n + 10)
        sizes.append(resident(clock.members.all["log"].pid))
        clock.pacing.end()

    told = Told(flood)
    made = in_one_host(lab(100.0), HERE)
    made.output("log", "parts.py:Log", robots="robot/*/state", host="log")
    made.run(tmp_path, pace=1, show=told)
    assert sizes[1] < sizes[0] + 20_000, sizes
    assert len(told.said) < 300


def resident(pid: int) -> int:
    """The memory of a process, in kB."""
    pages = Path(f"/proc/{pid}/statm").read_text(encoding="ascii").split()[1]
    return int(pages) * os.sysconf("SC_PAGE_SIZE") // 1024


def test_a_mailbox_has_an_end() -> None:
    from rems_net.router.mail import MAX_LETTERS

    box = Mailbox()
    for i in range(MAX_LETTERS + 10):
        box.put(i)
    until(lambda: box.dropped == 10)
    assert box.get(0) == 10
