"""The shape of key expressions: what a shared router lets through."""

import random
import time

import pytest
import zenoh

from rems_net.errors import ExperimentError
from rems_net.router.asking import glob, shaped
from rems_net.router.gate.shapes import CHUNK, CHUNKS, LONGEST, fault

#: what all rooms of ours, the board, and the README's plain Zenoh programs send
OURS = (
    "rems/robot/sim/state",
    "rems/robot/sim/@step/command",
    "rems/robot/*/**",
    "rems/robot/sim/@call/*",
    "rems/*/*/@alive",
    "*/clock/@alive",
    "rems/robot/*/@crowd/state",
    "rems/robot/@step/state",
    "team1-$*/robot/ca$*/state/wheel/left/velocity",
    f"rems/machine/{'m' * 63}/@file/{'0' * 64}",
    "@rems/who/anna",
    "rems/ro$*/m$*l/st$*",
    "**",
    "*",
)
REFUSED = {
    "team1/**/a/**/a/**/a": "`**` elsewhere",
    "**/a": "`**` elsewhere",
    "rems/robot/$*a$*a/command": "more than one `*`",
    "rems/robot/aaaaaaaaaaaa$*aaaaa": "inside a chunk of more than 16 bytes",
    "/".join("a" * (CHUNKS + 1)): "13 chunks",
    "a" * (CHUNK + 1): "more than 64 bytes",
    "ä" * 33: "more than 64 bytes",
    "a//b": "empty chunk",
    "": "empty chunk",
    "a#b": "one of",
    "a?b": "one of",
    "a$b": "one of",
    "a*": "one of",
    "a/$*": "one of",
    "a/***": "one of",
}


def test_what_a_class_sends_is_let_through() -> None:
    for key in OURS:
        assert fault(key) is None, key


@pytest.mark.parametrize("key", REFUSED)
def test_the_rest_is_refused_by_name(key: str) -> None:
    assert REFUSED[key] in str(fault(key))


def test_what_is_let_through_is_a_key_expression_of_zenoh() -> None:
    """An expression that is none ends the router for all."""
    draw = random.Random(1)
    parts = ["a", "@", "/", "/", "*", "$", "$*", "**", "#", "?", "ä", " ", "bc"]
    passed = 0
    for _ in range(20_000):
        key = "".join(draw.choices(parts, k=draw.randrange(1, 9)))
        if fault(key) is None:
            zenoh.KeyExpr(key)  # raises if it is none
            passed += 1
    assert passed > 1_000


def test_our_own_client_says_so_before_anything_is_sent() -> None:
    for key in ("robot/**/state", "robot/*o*/state", "/".join("a" * 13)):
        with pytest.raises(ExperimentError, match="expected at most 12 chunks, one"):
            glob(key)
    assert str(glob("rems/**/**")) == "rems/**"
    with pytest.raises(ExperimentError, match="more than 64 bytes"):
        shaped("rems/robot/" + "a" * 65)


def chunk(draw: random.Random) -> str:
    """Return a chunk of few different letters, so that it nearly matches others."""
    letters = "".join(draw.choices("aaaaab", k=draw.choice((1, 7, 14, 31, 62))))
    kind = draw.randrange(4)
    if kind == 0:
        return "*"
    if kind == 1 or len(letters) > 14:
        return letters + "$*" * (kind < 3)
    at = draw.randrange(len(letters))
    return f"{letters[:at]}$*{letters[at:]}"


def expression(draw: random.Random) -> str:
    """Return one of the longest key expressions that the rule lets through."""
    chunks = [chunk(draw) for _ in range(CHUNKS)]
    if draw.random() < 0.5:
        chunks[-1] = "**"
    return "/".join(chunks)


def worst(count: int, declared: int) -> float:
    """Return the seconds in which Zenoh compares one expression with so many."""
    draw = random.Random(count)
    others = [zenoh.KeyExpr.autocanonize(expression(draw)) for _ in range(declared)]
    slowest = 0.0
    for _ in range(count):
        one = zenoh.KeyExpr.autocanonize(expression(draw))
        took = []
        for _ in range(3):
            begun = time.thread_time()
            for other in others:
                one.intersects(other)
            took.append(time.thread_time() - begun)
        slowest = max(slowest, min(took))
    return slowest


def test_an_expression_is_compared_with_a_thousand_in_10_ms() -> None:
    assert len("/".join(["a" * CHUNK] * CHUNKS)) == LONGEST
    assert worst(30, 1_000) < 0.01


@pytest.mark.slow
def test_many_expressions_are_compared_with_a_thousand_in_10_ms() -> None:
    assert worst(3_000, 1_000) < 0.01
