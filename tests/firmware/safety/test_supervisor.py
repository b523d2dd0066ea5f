"""The supervisor: whatever happens, in whatever order, it brings the link up again."""

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import pytest
from hypothesis import given, strategies as st

from tests.firmware.safety.scripted import HELD, Cause, Phase, State, Supervisor, World

MS = 1000
PAUSES = [250 * MS, 500 * MS, 1000 * MS, 2000 * MS]


@pytest.fixture(scope="module")
def supervisor(tmp_path_factory: pytest.TempPathFactory) -> Supervisor:
    return Supervisor(tmp_path_factory.mktemp("supervisor") / "supervisor.so")


class Event(NamedTuple):
    """Time goes on, something fails, and a step is made in that world."""

    us: int
    world: World
    fails: Cause | None = None


@dataclass
class Monitor:
    """The laws, in Python: it sees calls and what was answered, and no inner state."""

    locators: int
    turn: int = 0
    pause: int = 0
    open: bool = False
    declared: bool = False
    works: bool = False  # ... and nothing has failed yet
    good: int = 0  # from when on the session was a good one
    begin: int = 0  # not before this
    ends: bool = False  # it must be closed by the next step
    now: int = 0

    def fail(self, cause: Cause) -> None:
        """The next session is at another address, unless this one was good."""
        if cause == Cause.SETTINGS:
            self.turn = self.pause = 0
        elif not self.open or self.ends:
            return
        elif self.works and self.now >= self.good:
            self.pause = 0
        else:
            self.turn = (self.turn + 1) % max(1, self.locators)
        self.ends = True
        self.works = False

    def step(self, calls: str, world: World) -> None:
        ended, worked = self.ends, self.works
        assert calls in ("", "d", "gx") or (len(calls) == 1 and calls in "abc-")
        if ended:
            assert calls == ("gx" if self.open else "")
            self.open = self.declared = self.ends = False
            self.begin = self.now + PAUSES[self.pause]
            self.pause = min(3, self.pause + 1)
            return
        assert calls != "gx", "closed without a reason"
        if calls == "d":
            assert self.open
            assert not self.declared
            self.declared = True
            if world.declares == 1:
                self.works, self.good = True, self.now + HELD
            else:
                self.fail(Cause.NOT_DECLARED)
        elif calls:
            self.opened(calls, world)
        else:
            assert not self.open or worked, "declared at once"
        if worked and not (world.network and world.up):
            self.fail(Cause.NO_ROUTER)

    def opened(self, locator: str, world: World) -> None:
        assert not self.open, "never twice without a close"
        assert self.now >= self.begin
        assert world.network
        assert locator == ("abc"[self.turn] if self.locators else "-")
        if world.opens:
            self.open = True
        else:
            self.turn = (self.turn + 1) % max(1, self.locators)
            self.ends = True


def happen(supervisor: Supervisor, monitor: Monitor, event: Event) -> State:
    """Let it happen to both; the monitor asserts."""
    monitor.now += event.us
    if event.fails is not None:
        monitor.fail(event.fails)
        supervisor.fail(event.fails, monitor.now)
    calls, state = supervisor.step(event.world, monitor.now)
    monitor.step(calls, event.world)
    assert bool(state.session) == monitor.open
    assert (Phase(state.phase) == Phase.OPEN) == monitor.works
    return state


def recovers(supervisor: Supervisor, monitor: Monitor) -> None:
    """From here on all is well: open within the longest pause and a few steps."""
    for _ in range(PAUSES[-1] // (10 * MS) + 6):
        state = happen(supervisor, monitor, Event(10 * MS, World()))
        if monitor.works:
            return
    pytest.fail(f"it gave up in {Phase(state.phase).name}")


# -- every order of events -----------------------------------------------------

STEPS = (0, 125 * MS, 250 * MS, 2000 * MS)
BAD = World(network=False)
CHOICES = {
    Phase.NETWORK: [World(), BAD],
    Phase.OPENING: [World(), BAD, World(opens=False)],
    Phase.DECLARING: [World(), World(declares=0), World(declares=2)],
    Phase.OPEN: [World(), BAD, World(up=False)],
    Phase.CLOSING: [World()],
    Phase.WAITING: [World(), BAD],
}
FAILS = (None, Cause.PUT, Cause.DEAF, Cause.SETTINGS)
Key = tuple[object, ...]


def key(state: State, monitor: Monitor) -> Key:
    """What the future depends on: times are those that are left."""
    phase, left = Phase(state.phase), 0
    if phase in (Phase.WAITING, Phase.OPEN):
        left = max(0, state.until - monitor.now)
    locator = state.locator % max(1, monitor.locators)
    seen = replace(
        monitor,
        now=0,
        begin=max(0, monitor.begin - monitor.now),
        good=max(0, monitor.good - monitor.now) if monitor.works else 0,
    )
    return phase, state.cause, locator, state.attempt, left, *vars(seen).values()


@pytest.mark.parametrize("locators", [0, 1, 2, 3])
def test_every_order_of_events(supervisor: Supervisor, locators: int) -> None:
    """All that can be reached by these events, in any number and order of them."""
    supervisor.start(locators)
    monitor = Monitor(locators, now=1)
    state = happen(supervisor, monitor, Event(0, BAD))
    found: set[Key] = {key(state, monitor)}
    waiting = [(supervisor.save(), Phase(state.phase), monitor)]
    while waiting:
        saved, phase, before = waiting.pop()
        for us in STEPS:
            for world in CHOICES[phase]:
                for fails in FAILS:
                    supervisor.load(saved)
                    monitor = replace(before)
                    state = happen(supervisor, monitor, Event(us, world, fails))
                    if (new := key(state, monitor)) in found:
                        continue
                    found.add(new)
                    after = supervisor.save()
                    waiting.append((after, Phase(state.phase), monitor))
                    recovers(supervisor, replace(monitor))
    assert {words[0] for words in found} == set(Phase)
    assert {words[1] for words in found} == set(Cause) - {Cause.SILENT}


WORLDS = st.one_of(
    st.just(World()),
    st.just(World()),
    st.builds(
        World, st.booleans(), st.booleans(), st.booleans(), st.sampled_from([0, 1, 2])
    ),
)
EVENTS = st.builds(
    Event,
    st.one_of(st.integers(0, 100 * MS), st.integers(0, 5000 * MS)),
    WORLDS,
    st.one_of(st.none(), st.none(), st.sampled_from(list(Cause))),
)


@given(st.integers(0, 3), st.lists(EVENTS, max_size=100))
def test_any_times(supervisor: Supervisor, locators: int, script: list[Event]) -> None:
    supervisor.start(locators)
    monitor = Monitor(locators)
    for event in script:
        happen(supervisor, monitor, event)
    recovers(supervisor, monitor)


# -- one by one ----------------------------------------------------------------


def opens(
    supervisor: Supervisor, world: World, until: int, begin: int = 0
) -> list[tuple[int, str]]:
    """When, in ms, a session was opened, and where."""
    found = []
    for ms in range(begin, until, 10):
        calls, _ = supervisor.step(world, ms * MS)
        found += [(ms, call) for call in calls if call in "abc-"]
    return found


def test_pauses_grow_and_addresses_take_turns(supervisor: Supervisor) -> None:
    supervisor.start(3)
    found = opens(supervisor, World(opens=False), 15_000)
    assert [locator for _, locator in found] == list("abcabcabca")
    pauses = [later - at for (at, _), (later, _) in pairwise(found)]
    wanted = [250, 500, 1000, *[2000] * 6]
    for pause, want in zip(pauses, wanted, strict=True):
        assert want <= pause <= want + 40, "a few steps of 10 ms more"


def test_a_pause_begins_when_an_open_that_took_long_is_over(
    supervisor: Supervisor,
) -> None:
    supervisor.start(1)
    now = 0
    for _ in range(2):
        calls, _ = supervisor.step(World(opens=False), now)
    assert calls == "a"
    now += 2000 * MS  # as long as it took
    supervisor.step(World(), now)
    for ms in range(0, 250, 10):
        calls, state = supervisor.step(World(), now + ms * MS)
        assert (calls, Phase(state.phase)) == ("", Phase.WAITING)


def test_addresses_may_become_fewer(supervisor: Supervisor) -> None:
    supervisor.start(3)
    closed = World(opens=False)
    assert len(opens(supervisor, closed, 2_000)) == 4
    for count, where in ((1, "a"), (0, "-")):
        supervisor.locators(count)
        begin = 10_000 * (2 - count)
        found = opens(supervisor, closed, begin + 10_000, begin)
        assert {locator for _, locator in found} == {where}


def test_each_session_is_declared_anew(supervisor: Supervisor) -> None:
    supervisor.start(1)
    declared = 0
    for number in range(1, 101):
        for ms in range(0, 10_000, 10):
            calls, state = supervisor.step(World(), (number * 10_000 + ms) * MS)
            declared += calls == "d"
            if Phase(state.phase) == Phase.OPEN:
                break
        assert (declared, state.opened) == (number, number)
        supervisor.step(World(up=False), (number * 10_000 + 3000) * MS)
