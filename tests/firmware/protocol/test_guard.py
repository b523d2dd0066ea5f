"""How old a tick is, by answers alone; and STOP, a latch."""

from ctypes import Structure, byref, c_bool, c_double, c_uint, c_uint64

from hypothesis import given, settings, strategies as st

from tests.firmware.protocol.core import Core

laws = settings(max_examples=300)


class Answer(Structure):
    _fields_ = (("n", c_uint64), ("made", c_uint64))


class Guard(Structure):
    _fields_ = (
        *((name, c_bool) for name in ("stopped", "again")),
        *((name, c_uint64) for name in ("stops", "release", "said_again")),
        ("answers", Answer * 16),
        ("next", c_uint),
    )


def begun(core: Core, stops: int = 0, *, stopped: bool = False) -> Guard:
    guard = Guard()
    if stopped:
        core.c.guard_hear(byref(guard))
    core.c.guard_begin(byref(guard), c_uint64(stops), c_uint64(1_000_000))
    return guard


def made(core: Core, guard: Guard, n: int) -> int:
    core.c.guard_made.restype = c_uint64
    return int(core.c.guard_made(byref(guard), c_uint64(n)))


#: of each question: us until it is asked, until it is heard there, until it is answered
rounds = st.lists(
    st.tuples(*(st.integers(0, 400_000) for _ in range(3))), min_size=1, max_size=30
)


@laws
@given(rounds=rounds, tick=st.integers(5_000, 200_000), pause=st.integers(0, 10**6))
def test_no_tick_is_taken_for_younger_than_it_is(
    core: Core, rounds: list[tuple[int, int, int]], tick: int, pause: int
) -> None:
    """Whatever the network does: the guard takes no tick for younger than it is."""
    guard = begun(core)
    now, start = 10_000_000, 10_000_000

    def when(n: int) -> int:  # the clock pauses after its 20th tick
        return start + n * tick + (pause if n > 20 else 0)

    for wait, there, back in rounds:
        asked = now + wait
        n = max(k for k in range(2_000) if when(k) <= asked)
        age = (asked + there - when(n)) / 1e6
        core.c.guard_answer(byref(guard), c_uint64(n), c_double(age), c_uint64(asked))
        now = asked + there + back
        for k in (0, n - 1, n, n + 1, n + 50):
            if k >= 0 and (bound := made(core, guard, k)):
                assert bound <= when(k) + 1
        assert made(core, guard, n) >= when(n) - there - 1


def test_what_the_clock_does_not_know_says_nothing(core: Core) -> None:
    guard = begun(core)
    for seconds in (float("inf"), 1e12, 20.0):
        core.c.guard_answer(
            byref(guard), c_uint64(5), c_double(seconds), c_uint64(10**7)
        )
    assert made(core, guard, 10) == 0


words = st.lists(st.one_of(st.just("stop"), st.integers(0, 12)), max_size=30)


@laws
@given(words=words, stops=st.integers(0, 6), stopped=st.booleans())
def test_only_a_greater_even_number_releases(
    core: Core, words: list[str | int], stops: int, stopped: bool
) -> None:
    """As the guard of rems_net/agents/host has it, word for word."""
    guard = begun(core, stops, stopped=stopped)
    newest, release, holds = stops, stops + 2 - stops % 2, stopped or bool(stops % 2)
    assert guard.stopped == holds
    for word in words:
        if word == "stop":
            core.c.guard_hear(byref(guard))
            release = release if holds else newest + 2
            holds = True
        else:
            core.c.guard_take(byref(guard), c_uint64(int(word)), c_uint64(2_000_000))
            if int(word) % 2:
                holds, release = True, max(release, int(word) + 1)
            elif holds and int(word) >= release:
                holds = False
            newest = max(newest, int(word))
        assert guard.stopped == holds
