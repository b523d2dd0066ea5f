"""The table of a member's states: which comes after which, and when it is given up."""

import time
from collections.abc import Callable

import pytest

from rems_net.agents.about.wiring import Entry
from rems_net.agents.clock.admission import Admissions
from rems_net.agents.clock.members import Member, Members, State
from rems_net.agents.clock.pacing import Pacing
from rems_net.agents.clock.progress import Progress
from rems_net.agents.protocol.messages import Farewell, Request
from rems_net.agents.protocol.terms import Terms, Wait
from rems_net.errors import AgentError, ExperimentError
from rems_net.events import Event, listening
from rems_net.router.session import Session
from rems_net.router.settings import Link
from tests.agents.runs import until

BACK = 0.3


class Run:
    """A run of one host, `robot/a`, without its mail: the test brings what comes."""

    def __init__(self, **terms: object) -> None:
        hosts = {"h": frozenset(["robot/a"])}
        given = Terms(0.1, hosts=hosts, tickets={"h": 7}, wait=Wait(back=BACK), **terms)  # type: ignore[arg-type]
        self.members = Members(1, given)
        self.started: list[str] = []
        self.deaths: list[AgentError] = []
        self.admissions = Admissions(
            Session(Link("tcp/127.0.0.1:0", serve=True)),
            Pacing(0.1, 0.0),
            self.members,
            Progress(self.members),
            look=self._look,
            lives=lambda host: False,
            start=self.started.append,
            read=lambda timeout: False,
            say_roster=lambda: None,
        )
        self.admissions.gathered = True

    def _look(self) -> None:
        if self.deaths:
            raise self.deaths.pop()

    def come(self, pid: int = 1) -> Member:
        agents = [Entry("robot/a", "h", {}, [])]
        asked = Request("h", "desk", pid, "", agents, {}, False, 7)
        self.admissions.make_way(asked)
        member = self.members.join(asked, 1, 0.0)
        self.admissions.welcome(member)
        return member

    def until(self, done: Callable[[], bool]) -> None:
        """Read on until something is so."""

        def look() -> bool:
            self.admissions.read(0.0)
            return done()

        until(look)

    def wait(self, state: State) -> None:
        """Read on until the host is in this state."""
        self.until(lambda: states(self.members.all["h"]) == [state])


def states(*members: Member) -> list[State]:
    return [member.state for member in members]


def seen(run: Run) -> Member:
    member = run.come()
    assert states(member) == [State.UNSEEN]
    run.admissions.notice(member.badge, alive=True)
    assert states(member) == [State.SEEN]
    return member


def test_out_of_sight_is_given_up_when_its_time_is_over() -> None:
    run = Run()
    member = seen(run)
    run.admissions.notice(member.badge, alive=False)
    assert states(member) == [State.UNSEEN]
    run.admissions.notice(member.badge, alive=True)
    run.admissions.notice(member.badge, alive=False)
    begun = time.monotonic()
    with pytest.raises(AgentError, match=r"robot/a: is out of sight on desk for 0.3 s"):
        run.wait(State.GONE)
    assert time.monotonic() - begun >= BACK
    assert states(member) == [State.GONE]
    with pytest.raises(ExperimentError, match="h was given up: is out of sight"):
        run.come(2)


def test_who_crashes_out_of_sight_has_all_its_time_to_come_back() -> None:
    """What was left of its time before the crash does not count."""
    run, told = Run(restarts={"h": 1}), list[Event]()
    member = seen(run)
    run.admissions.notice(member.badge, alive=False)
    with listening(told.append):
        run.deaths.append(AgentError("h", "was killed by signal 9"))
        run.admissions.read(0.0)
        assert states(member) == [State.CRASHED]
        assert run.admissions.awaited()
        # Its process is started after half a second, when that time is over.
        run.until(lambda: bool(run.started))
        again = run.come(2)
    assert states(member, again) == [State.GONE, State.UNSEEN]
    assert run.members.gone() == {}
    assert [(e.kind, e.agent) for e in told] == [
        ("crashed", "robot/a"),
        ("back", "robot/a"),
    ]
    run.admissions.notice(again.badge, alive=True)
    farewell = Farewell(again.badge, [], ("robot/a", "it is empty"))
    with pytest.raises(AgentError, match="robot/a: it is empty"):
        run.admissions.hear_farewell(again, farewell)
    assert states(again) == [State.GONE]


@pytest.mark.parametrize("drop", [False, True])
def test_who_does_not_come_back_is_given_up(drop: bool) -> None:
    run, told = Run(restarts={"h": 2}, drop=drop), list[Event]()
    member = seen(run)

    def give_up() -> None:
        with listening(told.append):
            run.deaths.append(AgentError("h", "was killed by signal 9"))
            run.wait(State.CRASHED)
            run.wait(State.GONE)

    if drop:
        give_up()
        assert told[-1].kind == "dropped"
    else:
        with pytest.raises(AgentError, match=r"did not come back within 0\.3 s of its"):
            give_up()
    assert run.started == ["h"]
    assert states(member) == [State.GONE]
    assert not run.admissions.awaited()


def test_ticks_of_one_step_of_the_clock_have_no_rate() -> None:
    """Windows' clock has steps of 16 ms, in which many ticks are done."""
    member = Member(1, "h", "desk", 1, "", [])
    member.hear(1)
    member.n = 5
    assert member.rate(member.seen) == 0.0


@pytest.mark.parametrize(("is_open", "first"), [(True, 8000), (False, 200)])
def test_a_host_that_asks_again_begins_at_a_tick_that_comes(
    is_open: bool, first: int
) -> None:
    """Else it says that it is late by all the ticks since its first admission."""
    members = Members(1, Terms(0.02, open=is_open))
    agents = [Entry("robot/a", "h", {}, [], lockstep=not is_open)]
    asked = Request("h", "desk", 1, "", agents, {}, False, 0)
    once = members.join(asked, 200, 0.0)
    members.changed = False
    again = members.join(asked, 8000, 0.0)
    assert (again.badge, again.first) == (once.badge, first)
    # a roster of this tick, by which the host learns that it is admitted
    assert members.changed == is_open
