"""The motors held against a model in Python, by scripts of events."""

import math
from dataclasses import dataclass, field
from typing import NamedTuple

from hypothesis import given, strategies as st

from tests.firmware.safety.bench import MAX_AGE, PERIOD, TOP, Bench, Why, stands


class Tell(NamedTuple):
    left: float
    right: float
    age: int


class Wait(NamedTuple):
    us: int


class Tick(NamedTuple):
    age: int


class Stop(NamedTuple):
    why: Why


class Verb(NamedTuple):
    name: str


Event = Tell | Wait | Tick | Stop | Verb

#: of commands and ticks: most are young, some just at the limit, a few are to come
AGES = st.one_of(
    st.integers(0, 30_000),
    st.integers(-2, 2).map(lambda near: MAX_AGE + near),
    st.integers(-PERIOD, 2 * MAX_AGE),
)
SPEEDS = st.one_of(
    st.floats(-TOP, TOP),
    st.floats(allow_nan=True, allow_infinity=True),
    st.sampled_from([0.0, -0.0, TOP, -TOP, math.nextafter(TOP, 8)]),
)
GOOD = st.builds(Tell, st.floats(-TOP, TOP), st.floats(-TOP, TOP), AGES)
WAITS = st.one_of(
    st.just(PERIOD),
    st.integers(0, 3 * PERIOD),
    st.sampled_from([MAX_AGE - 1, MAX_AGE, MAX_AGE + 1, 3 * MAX_AGE]),
)
EVENTS = st.one_of(
    GOOD,
    GOOD,
    st.builds(Tell, SPEEDS, SPEEDS, AGES),
    st.builds(Wait, WAITS),
    st.builds(Wait, WAITS),
    st.builds(Tick, AGES),
    st.builds(Tick, st.just(0)),
    st.builds(Stop, st.sampled_from([Why.STOPPED, Why.LEFT])),
    st.builds(Verb, st.sampled_from(["release", "reset"])),
)


@dataclass
class Model:
    """What the header of motors says, in Python."""

    now: int
    ticked: int = 0
    told: tuple[Tell, int, int] | None = None  # what, when it was said, its tick
    hold: Why = Why.DRIVEN
    why: Why = Why.STARTED
    after: int = field(init=False)
    stood: int = 0
    expired: int = 0

    def __post_init__(self) -> None:
        self.after = self.now

    def do(self, event: Event, tick: int) -> None:
        match event:
            case Wait(us):
                self.now += us
            case Tell(age=age):
                self.told = event, self.now - age, tick
            case Tick(age):
                self.ticked = self.now - age
            case Stop(why):
                self.hold, self.told = why, None
            case Verb("release"):
                self.told = None
                if self.hold != Why.DRIVEN:
                    self.after, self.hold = self.now, Why.DRIVEN

    def step(self) -> Why:
        before, self.why = self.why, self.judge()
        if before == Why.DRIVEN != self.why:
            self.stood = self.now
            self.expired += self.why in (Why.OLD, Why.NO_TICK, Why.WRONG)
        return self.why

    def judge(self) -> Why:
        if self.hold != Why.DRIVEN:
            return self.hold
        if self.told is None or self.told[1] <= self.after:
            return Why.STARTED
        told, said, _ = self.told
        if not (abs(told.left) <= TOP and abs(told.right) <= TOP and told.age >= 0):
            return Why.WRONG
        if self.now - said > MAX_AGE:
            return Why.OLD
        if not 0 <= self.now - self.ticked <= MAX_AGE:
            return Why.NO_TICK
        if self.why != Why.DRIVEN and said <= self.stood:
            return self.why
        return Why.DRIVEN


def do(bench: Bench, event: Event, tick: int) -> None:
    match event:
        case Wait(us):
            bench.wait(us)
        case Tell(left, right, age):
            bench.tell(left, right, bench.now - age, tick)
        case Tick(age):
            bench.tick(bench.now - age)
        case Stop(why):
            bench.stop(why)
        case Verb(name):
            getattr(bench, name)()


@given(st.lists(st.tuples(EVENTS, st.booleans()), max_size=60))
def test_motors_do_what_their_header_says(
    bench: Bench, script: list[tuple[Event, bool]]
) -> None:
    """A step after some events, and none after others, as tasks happen to run."""
    bench.begin(10_000_000)
    model = Model(10_000_000)
    for tick, (event, stepped) in enumerate(script, 1):
        do(bench, event, tick)
        model.do(event, tick)
        if not stepped:
            continue
        reading, why = bench.step(), model.step()
        assert (reading.why, reading.expired) == (why, model.expired)
        if why == Why.DRIVEN:
            assert model.told is not None
            told, _, echo = model.told
            assert (reading.left, reading.right) == (told.left, told.right)
            assert reading.tick == echo
        else:
            assert stands(reading)
            assert reading.tick == 0


@given(st.lists(EVENTS, max_size=80))
def test_no_wheel_turns_without_a_reason(bench: Bench, script: list[Event]) -> None:
    """Laws that hold whatever the model says, after every step of the period."""
    bench.begin(10_000_000)
    said: dict[int, Tell] = {}  # by tick
    times: dict[int, int] = {}
    ticks, stopped, holds = [0], 10_000_000, False
    for number, event in enumerate(script, 1):
        do(bench, event, number)
        if isinstance(event, Tell):
            said[number], times[number] = event, bench.now - event.age
        elif isinstance(event, Tick):
            ticks.append(bench.now - event.age)
        elif isinstance(event, Stop):
            stopped, holds = bench.now, True
        elif event == Verb("release"):
            holds = False
        reading = bench.step()
        assert math.isfinite(reading.x + reading.y + reading.heading)
        for pulse in reading.pulses:
            assert pulse == 0 or 700 <= pulse <= 2300
        if any(reading.pulses):
            assert not holds
            told = said[reading.tick]
            assert abs(told.left) <= TOP
            assert abs(told.right) <= TOP
            assert 0 <= bench.now - times[reading.tick] <= MAX_AGE
            assert times[reading.tick] > stopped
            assert 0 <= bench.now - ticks[-1] <= MAX_AGE
        bench.wait(1)
